"""Files whose bytes depend on their content alone."""

from __future__ import annotations

import hashlib
import io
import json
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

ZIP_DATE = (1980, 1, 1, 0, 0, 0)
"""The earliest date a zip archive can hold; the clock must not leave a trace."""


def npz_bytes(arrays: Mapping[str, np.ndarray]) -> bytes:
    """A compressed npz, its arrays sorted by name and undated."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for name in sorted(arrays):
            content = io.BytesIO()
            np.lib.format.write_array(content, np.ascontiguousarray(arrays[name]), allow_pickle=False)
            entry = zipfile.ZipInfo(f"{name}.npy", ZIP_DATE)
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, content.getvalue())
    return out.getvalue()


def write(path: Path, content: bytes) -> str:
    """Writes the bytes and returns their SHA-256."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content)
    return hashlib.sha256(content).hexdigest()


def write_json(path: Path, value: Mapping[str, Any]) -> str:
    """Writes readable JSON, keys in the order given, and returns its SHA-256."""
    text = json.dumps(value, indent=2, ensure_ascii=False) + "\n"
    return write(path, text.encode())


def rounded(values: np.ndarray, step: float) -> np.ndarray:
    """float32 values on a grid, so that the last bits of a sum leave no trace."""
    return (np.round(np.asarray(values, np.float64) / step) * step).astype(np.float32)
