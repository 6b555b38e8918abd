"""Results as bytes and back: one npz (arrays plus a JSON skeleton), read without pickle.

The sandboxed child writes it, the trusted processes read it, so reading accepts nothing but the values of
`results.py`.
"""

from __future__ import annotations

import dataclasses
import io
import json
import zipfile
from collections.abc import Callable, Mapping
from typing import Any, TypeVar

import numpy as np

from lubdub import results
from lubdub.geometry.frames import Similarity
from lubdub.geometry.stickers import StickerProof
from lubdub.geometry.surface import Surface

T = TypeVar("T")


def _clean_scan(display: Surface, **fields: Any) -> results.CleanScan:
    return results.CleanScan(drape=lambda: display, **fields)


_MAKERS: dict[str, Callable[..., Any]] = {
    kind.__name__: kind
    for kind in (
        Similarity,
        StickerProof,
        Surface,
        results.Area,
        results.Examination,
        results.Fit,
        results.Landmark,
        results.Outcome,
        results.Quality,
        results.RankedReference,
        results.Reason,
        results.Unit,
    )
} | {results.CleanScan.__name__: _clean_scan}


def examination_to_bytes(examination: results.Examination) -> bytes:
    """An examination as bytes."""
    return _pack(examination)


def examination_from_bytes(data: bytes) -> results.Examination:
    """The examination again. Raises ValueError for bytes that are none."""
    return _unpack(data, results.Examination)


def outcome_to_bytes(outcome: results.Outcome) -> bytes:
    """An outcome as bytes."""
    return _pack(outcome)


def outcome_from_bytes(data: bytes) -> results.Outcome:
    """The outcome again. Raises ValueError for bytes that are none."""
    return _unpack(data, results.Outcome)


def _pack(value: Any) -> bytes:
    arrays: list[np.ndarray] = []
    skeleton = json.dumps(_encode(value, arrays)).encode()
    buffer = io.BytesIO()
    named = {f"a{index}": array for index, array in enumerate(arrays)}
    np.savez(buffer, skeleton=np.frombuffer(skeleton, np.uint8), **named)  # type: ignore[arg-type]
    return buffer.getvalue()


def _unpack(data: bytes, kind: type[T]) -> T:
    try:
        with np.load(io.BytesIO(data), allow_pickle=False) as archive:
            value = _decode(json.loads(archive["skeleton"].tobytes()), archive)
    except (KeyError, OSError, TypeError, ValueError, EOFError, zipfile.BadZipFile) as error:
        raise ValueError("these bytes are no archive of ours") from error
    if not isinstance(value, kind):
        raise ValueError(f"the archive holds no {kind.__name__}")
    return value


def _encode(value: Any, arrays: list[np.ndarray]) -> Any:
    if isinstance(value, np.ndarray):
        arrays.append(value)
        return {"$array": len(arrays) - 1}
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        fields = {name: _encode(field, arrays) for name, field in _fields(value).items()}
        return {"$type": type(value).__name__, "fields": fields}
    if isinstance(value, Mapping):
        return {"$map": {str(key): _encode(item, arrays) for key, item in value.items()}}
    if isinstance(value, (tuple, list)):
        return [_encode(item, arrays) for item in value]
    if isinstance(value, np.generic):
        return value.item()
    return value


def _fields(value: Any) -> dict[str, Any]:
    """The fields of a dataclass; of a scan its skin for showing itself, not the way to it."""
    names = [field.name for field in dataclasses.fields(value)]
    if isinstance(value, results.CleanScan):
        names = ["display" if name == "drape" else name for name in names]
    return {name: getattr(value, name) for name in names}


def _decode(value: Any, archive: Mapping[str, np.ndarray]) -> Any:
    if isinstance(value, list):
        return tuple(_decode(item, archive) for item in value)
    if not isinstance(value, dict):
        return value
    if "$array" in value:
        return archive[f"a{int(value['$array'])}"]
    if "$map" in value:
        return {key: _decode(item, archive) for key, item in value["$map"].items()}
    return _MAKERS[value["$type"]](**{key: _decode(item, archive) for key, item in value["fields"].items()})
