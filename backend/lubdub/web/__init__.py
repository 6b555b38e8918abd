"""FastAPI only: translates HTTP to the values of the other rooms and back. Never parses a scan."""
