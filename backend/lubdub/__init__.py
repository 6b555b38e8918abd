"""Lubdub: from a 3D scan of a bare chest to the four places to listen to its heart."""

__version__ = "0.1.0"
