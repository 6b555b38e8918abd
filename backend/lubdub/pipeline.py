"""The whole journey on one screen: read -> clean -> landmarks -> choose -> fit -> project -> judge."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from lubdub.results import (
    Examination,
    LandmarkName,
    Library,
    MethodName,
    Outcome,
    Patient,
    Progress,
)


@dataclass(frozen=True)
class Request:
    """What was asked. landmarks: name -> (3,) in the file's own coordinates and unit; unit: m, cm, mm or None."""

    patient: Patient = field(default_factory=Patient)
    landmarks: Mapping[LandmarkName, np.ndarray] = field(default_factory=dict)
    unit: str | None = None
    method: MethodName = "lubdub"


def quiet(stage: str, fraction: float) -> None:
    """A progress listener that does not listen."""


def examine(data: bytes, request: Request, library: Library, progress: Progress = quiet) -> Examination:
    """Read and clean a scan and suggest its landmarks, before any run.

    Raises ScanUnreadable when the bytes are no body scan, ScanRefused when nothing may be shown of it.
    """
    raise NotImplementedError


def locate(data: bytes, request: Request, library: Library, progress: Progress = quiet) -> Outcome:
    """The four areas on this body, judged. A refusal is an Outcome too; only ScanUnreadable is raised."""
    raise NotImplementedError
