"""What a result and an examination look like, for the documentation; the pipeline writes them, a test compares."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from lubdub.results import AreaName, LandmarkName, VerdictWord
from lubdub.web.schemas import ReasonOut

Place = Annotated[list[float], Field(min_length=3, max_length=3, description="In the file's own coordinates and unit.")]
Direction = Annotated[list[float], Field(min_length=3, max_length=3, description="Unit length, out of the body.")]


class Exact(BaseModel):
    """Nothing may appear that is not documented here."""

    model_config = ConfigDict(extra="forbid")


class AreaOut(Exact):
    """One listening area on the skin."""

    position: Place
    normal: Direction
    radius_mm: float = Field(description="Radius of the region that holds the true place 9 times in 10.")
    instruction: str = Field(description="How to find it with a finger, from a bone that can be felt.")


class LandmarkOut(Exact):
    """One landmark as it was used."""

    position: Place
    source: Literal["given", "suggested", "sticker"]
    uncertainty_mm: float = Field(description="One standard deviation.")


class UnitOut(Exact):
    """The unit of the file's coordinates."""

    name: str
    mm_per_unit: float
    source: Literal["given", "found", "sticker"]


class StickersOut(Exact):
    """What printed stickers on the scan proved."""

    found: list[LandmarkName] = Field(description="The bones on which one was seen.")
    scale: float = Field(description="Their size on the scan over their printed size: 1 when both are true.")
    handedness: Literal["proved"] = Field(description="They read forwards: the scan is not mirrored.")


class ReferenceOut(Exact):
    """How like the scan a reference body is."""

    id: str
    chamfer_mm: float
    weight: float = Field(description="Its share in the answer, 0 to 1.")


class QualityOut(Exact):
    """Numbers a clinician may ask for; null where a method has no such number."""

    surface_residual_mm: float | None
    landmark_residual_mm: float | None
    coverage: float
    spread_mm: float | None


class CorrectedAreaOut(Exact):
    """Where a clinician put an area, on the cleaned skin (`scan.ply`); the computed one stays in `areas`.

    Of a mesh up to 40,000 vertices that is the file's own surface. Of points it is a smooth skin through them: 2 mm off
    the nearest one in the middle, 8 mm at most, on a depth frame whose own noise is as large.
    """

    position: Place
    normal: Direction
    moved_mm: float = Field(description="How far it lies from the computed place.")
    instruction: str = Field(description="How to find it with a finger, from a bone that can be felt.")
    by: str
    at: datetime


class ReviewOut(Exact):
    """How a clinician decided. Where an area was corrected, listen at the corrected one."""

    decision: Literal["signed", "returned", "unusable"]
    by: str
    at: datetime
    note: str
    areas: dict[AreaName, CorrectedAreaOut] = Field(description="Those that were moved; empty when none was.")


class ResultOut(Exact):
    """The four areas, or why none are shown. `areas` is absent when the verdict is `refuse`."""

    verdict: VerdictWord
    reasons: list[ReasonOut]
    areas: dict[AreaName, AreaOut] | None = None
    landmarks: dict[LandmarkName, LandmarkOut] | None = None
    unit: UnitOut | None = None
    stickers: StickersOut | None = Field(None, description="Null when no printed sticker was seen.")
    notes: list[str] | None = Field(None, description="What was done to the scan, in words.")
    references: list[ReferenceOut] | None = None
    selected: str | None = None
    quality: QualityOut | None = None
    steps: list[dict[str, float]] | None = Field(None, description="How the fit came closer, step by step.")
    timings_s: dict[str, float] | None = None
    method: dict[str, str] | None = Field(None, description="Version, solver and hashes: all that a repeat needs.")
    review: ReviewOut | None = Field(None, description="A clinician's decision; absent before there is one.")


class ExaminationOut(Exact):
    """What was found on the scan before any run."""

    unit: UnitOut
    body_from_file: list[list[float]] = Field(description="4 x 4 matrix from the file's frame to the body's, in mm.")
    size: dict[str, float] = Field(description="Of the cleaned body, in mm.")
    coverage: float | None = Field(description="How much of the chest is on the scan, 0 to 1; null when unknown.")
    notes: list[str]
    warnings: list[ReasonOut]
    suggested_landmarks: dict[LandmarkName, LandmarkOut] = Field(description="And those that printed stickers marked.")
    stickers: StickersOut | None = Field(None, description="Null when no printed sticker was seen.")
