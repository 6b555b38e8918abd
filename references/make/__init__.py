"""Builds everything in `references/` anew. Run `PYTHONPATH=backend python -m references.make`."""

import os

# Sums split over threads end in other last bits; one thread gives the same bytes on every run.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
