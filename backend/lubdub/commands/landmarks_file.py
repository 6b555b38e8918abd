"""Reads the points a person placed on a scan, strictly: a misspelt name or a lost number must not pass unseen."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from lubdub.commands.faults import CommandFault

NAMES = ("suprasternal_notch", "xiphisternum", "navel", "nipple_left", "nipple_right")
"""As `results.LANDMARK_NAMES`, which cannot be imported here without NumPy; a test compares them."""
MAX_BYTES = 100_000  # five points need 400


def read_landmarks(path: Path) -> dict[str, list[float]]:
    """Landmark name -> three coordinates, in the scan file's own coordinates and unit. Raises CommandFault."""
    try:
        with path.open("rb") as file:
            text = file.read(MAX_BYTES + 1)
        content = json.loads(text, object_pairs_hook=_without_repeats) if len(text) <= MAX_BYTES else None
    except OSError as fault:
        raise CommandFault(f"The landmarks file {path} cannot be opened: {fault.strerror}.") from fault
    except (ValueError, RecursionError) as fault:
        raise CommandFault(f"The landmarks file {path} is not JSON: {fault}.") from fault
    if not isinstance(content, dict):
        raise CommandFault(f'The landmarks file {path} must hold one JSON object: {{"navel": [x, y, z], ...}}.')
    unknown = [name for name in content if name not in NAMES]
    if unknown:
        raise CommandFault(f"The landmarks file {path} names {unknown[0]!r}; the names are {', '.join(NAMES)}.")
    return {name: _coordinates(name, value, path) for name, value in content.items()}


def _coordinates(name: str, value: Any, path: Path) -> list[float]:
    if not isinstance(value, list) or len(value) != 3 or not all(_is_coordinate(number) for number in value):
        raise CommandFault(f"In the landmarks file {path}, {name} must be three finite numbers: [x, y, z].")
    return [float(number) for number in value]


def _is_coordinate(number: object) -> bool:
    if isinstance(number, bool) or not isinstance(number, int | float):
        return False
    try:
        return math.isfinite(float(number))
    except OverflowError:
        return False


def _without_repeats(pairs: Sequence[tuple[str, Any]]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for name, value in pairs:
        if name in found:
            raise ValueError(f"{name!r} stands there twice")
        found[name] = value
    return found
