"""FastAPI only: HTTP to values and back."""
