"""(7) The people around a result: case, consent, retention, audit, encrypted files."""
