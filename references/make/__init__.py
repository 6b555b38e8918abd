"""Builds everything in `references/` anew: bodies, basis and demo scans. Run `python -m references.make`."""
