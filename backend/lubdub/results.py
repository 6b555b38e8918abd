"""The frozen values that rooms hand to each other. All lengths are millimetres in the body frame unless said."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Literal, get_args

import numpy as np

from lubdub.geometry.builds import Builds
from lubdub.geometry.colour import Colouring
from lubdub.geometry.frames import Similarity
from lubdub.geometry.signs import Signs
from lubdub.geometry.stickers import StickerProof
from lubdub.geometry.surface import Surface

AreaName = Literal["aortic", "pulmonary", "tricuspid", "mitral"]
LandmarkName = Literal["suprasternal_notch", "xiphisternum", "navel", "nipple_left", "nipple_right"]
Sex = Literal["female", "male"]
Posture = Literal["supine", "sitting"]
MethodName = Literal["lubdub", "paper", "rule"]
VerdictWord = Literal["show", "show_with_care", "refuse"]

AREA_NAMES: tuple[AreaName, ...] = get_args(AreaName)  # in listening order
LANDMARK_NAMES: tuple[LandmarkName, ...] = get_args(LandmarkName)
PUBERTY_YEARS = 12.0  # from here on, a girl's or woman's breasts may move the skin of the chest against the ribs
BONE_LANDMARKS: tuple[LandmarkName, ...] = ("suprasternal_notch", "xiphisternum")
NIPPLES: frozenset[LandmarkName] = frozenset(("nipple_left", "nipple_right"))
UNREADABLE_FILE = "unreadable_file"

Progress = Callable[[str, float], None]
"""Called with the stage's name (`read`, `clean`, `fit`, `choose`, `project`, `judge`) and the fraction done, 0 to 1."""


@dataclass(frozen=True)
class Reason:
    """Why a result is not simply shown: a stable code, one sentence, and what to do."""

    code: str
    message: str
    advice: str

    def to_json(self) -> dict[str, str]:
        """As in the result format."""
        return {"code": self.code, "message": self.message, "advice": self.advice}


class ScanFault(Exception):
    """Why there is nothing to show. Carries the reason."""

    def __init__(self, reason: Reason) -> None:
        super().__init__(f"{reason.message} {reason.advice}".strip())
        self.reason = reason


class ScanUnreadable(ScanFault):
    """The file cannot be read as a body scan at all."""


class ScanRefused(ScanFault):
    """The file was read, but nothing may be shown."""


@dataclass(frozen=True)
class Patient:
    """What was said about the person; age in years (fractions for babies), None when not said."""

    age_years: float | None = None
    sex: Sex | None = None
    posture: Posture = "supine"

    @property
    def may_have_breasts(self) -> bool:
        """Whether breasts may have moved the skin: assumed of whoever may be a woman after puberty."""
        return self.sex != "male" and (self.age_years is None or self.age_years >= PUBERTY_YEARS)


@dataclass(frozen=True)
class Unit:
    """The unit of the file's coordinates, and whether somebody said so or the size of body or stickers did."""

    name: str
    mm_per_unit: float
    source: Literal["given", "found", "sticker"]


@dataclass(frozen=True)
class RawScan:
    """What stands in the file, in the file's own coordinates and unit. unit_by_format: what the format itself
    prescribes (glTF: "m"), if anything; warnings: what the file itself says that nobody can see in its points."""

    surface: Surface
    file_format: str
    unit_by_format: str | None = None
    warnings: tuple[Reason, ...] = ()
    colouring: Colouring | None = None


@dataclass(frozen=True)
class CleanScan:
    """The chest alone: bed, floor, clutter and islands gone.

    points: (n, 3), n <= about 25,000, evenly spread; normals: (n, 3) outward units; is_border: (n,) bool,
    True on the scan's rim, where a nearest point means little. drape: gives `display`, which may still be in the
    making; body_from_file: file coordinates -> body; notes: what was done, in words ("kept 1 of 3 pieces"); warnings:
    what was noticed while cleaning and cannot be seen in the cleaned points any more.
    """

    points: np.ndarray
    normals: np.ndarray
    is_border: np.ndarray
    drape: Callable[[], Surface]
    body_from_file: Similarity
    unit: Unit
    notes: tuple[str, ...] = ()
    warnings: tuple[Reason, ...] = ()

    @cached_property
    def display(self) -> Surface:
        """The same skin for showing, at most 40,000 vertices, triangulated even when the file was a cloud."""
        return self.drape()

    def moved(self, move: Similarity) -> CleanScan:
        """The same skin after a rigid move; body_from_file follows, so file coordinates stay what they were."""
        return replace(
            self,
            points=move.apply(self.points),
            normals=move.turn(self.normals),
            drape=lambda: Surface(move.apply(self.display.vertices), self.display.triangles),
            body_from_file=move.after(self.body_from_file),
        )


@dataclass(frozen=True)
class Landmark:
    """One point. position: (3,); uncertainty: one standard deviation."""

    position: np.ndarray
    source: Literal["given", "suggested", "sticker"]
    uncertainty_mm: float

    @property
    def is_marked(self) -> bool:
        """Whether a person put it there, by a click or by a sticker."""
        return self.source != "suggested"


Landmarks = Mapping[LandmarkName, Landmark]


@dataclass(frozen=True)
class Reference:
    """One reference body, lying on its back. surface: torso skin of the shared topology; card: its card.json;
    landmarks, areas: name -> (3,) on the skin; spread_mm: how far two people's marks lie apart, empty without any."""

    id: str
    surface: Surface
    landmarks: Mapping[LandmarkName, np.ndarray]
    areas: Mapping[AreaName, np.ndarray]
    card: Mapping[str, Any]
    spread_mm: Mapping[AreaName, float] = field(default_factory=dict)


@dataclass(frozen=True)
class ShapeBasis:
    """A linear model of lying torsos: vertices = mean + modes^T c, c ~ N(0, 1) over all people, up to a similarity.

    mean: (n, 3); modes: (k, n, 3), each one standard deviation; triangles: (m, 3). landmark_corners, landmark_weights:
    (5, 3) barycentric places in the order of LANDMARK_NAMES; area_corners, area_weights: (2, 4, 3) in that of
    AREA_NAMES, [0] with the adult apex, [1] the under-fours'. data_weight: (n,) 1 on the trunk, 0 on arms and back.
    """

    mean: np.ndarray
    modes: np.ndarray
    triangles: np.ndarray
    landmark_corners: np.ndarray
    landmark_weights: np.ndarray
    area_corners: np.ndarray
    area_weights: np.ndarray
    data_weight: np.ndarray
    builds: Builds


@dataclass(frozen=True)
class Library:
    """All reference bodies, the basis drawn from them, signs of landmarks, and the hash of the files they came from."""

    references: tuple[Reference, ...]
    basis: ShapeBasis
    signs: Signs
    sha256: str


@dataclass(frozen=True)
class RankedReference:
    """How like the scan a reference is. weight: its share in the answer, 0 to 1."""

    id: str
    chamfer_mm: float
    weight: float


@dataclass(frozen=True)
class Fit:
    """A body bent onto the scan. landmarks, areas: name -> (3,), carried by the mesh. surface_residual_mm: root mean
    square distance of matched skin; matched_share: how much of the visible trunk found skin; strangeness: root mean
    square shape coefficient against what was expected (0.2 is usual)."""

    surface: Surface
    landmarks: Mapping[LandmarkName, np.ndarray]
    areas: Mapping[AreaName, np.ndarray]
    surface_residual_mm: float
    matched_share: float
    strangeness: float
    steps: tuple[Mapping[str, float], ...] = ()

    def moved(self, move: Similarity) -> Fit:
        """The same body after a rigid move."""
        return replace(
            self,
            surface=Surface(move.apply(self.surface.vertices), self.surface.triangles),
            landmarks={name: move.apply(place) for name, place in self.landmarks.items()},
            areas={name: move.apply(place) for name, place in self.areas.items()},
        )


@dataclass(frozen=True)
class Estimate:
    """Where a method believes an area is. position: (3,); sigma_mm: (2,) across and along the body."""

    position: np.ndarray
    sigma_mm: np.ndarray


@dataclass(frozen=True)
class Located:
    """What each of the three methods returns: the areas before they are judged, and how it got there. measures: named
    numbers for the judge, e.g. `rule_disagreement_mm`; notes: what was done that one would not expect, in words."""

    areas: Mapping[AreaName, Estimate]
    fit: Fit | None
    references: tuple[RankedReference, ...]
    selected: str | None
    measures: Mapping[str, float]
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Area:
    """One listening area on the skin. position, normal: (3,); radius_mm holds the truth 9 times in 10."""

    position: np.ndarray
    normal: np.ndarray
    radius_mm: float
    instruction: str


@dataclass(frozen=True)
class Quality:
    """The numbers a clinician may ask for; None where a method has no such number."""

    surface_residual_mm: float | None
    landmark_residual_mm: float | None
    coverage: float
    spread_mm: float | None


@dataclass(frozen=True)
class Outcome:
    """Everything known at the end of a run. areas is empty when refused. `report.result_json` writes it out."""

    verdict: VerdictWord
    reasons: tuple[Reason, ...]
    areas: Mapping[AreaName, Area]
    landmarks: Landmarks
    scan: CleanScan | None
    fit: Fit | None
    references: tuple[RankedReference, ...]
    selected: str | None
    quality: Quality | None
    timings_s: Mapping[str, float]
    method: Mapping[str, str]
    steps: tuple[Mapping[str, float], ...] = ()
    notes: tuple[str, ...] = ()
    stickers: StickerProof | None = None


@dataclass(frozen=True)
class Examination:
    """What is known before any landmark is placed. coverage: of the chest's front; None when its lie is unclear; size:
    `width_mm`, `length_mm`, `depth_mm` of the cleaned body, `chest_width_mm` when found."""

    scan: CleanScan
    size: Mapping[str, float]
    coverage: float | None
    suggested: Landmarks
    warnings: tuple[Reason, ...]
    stickers: StickerProof | None = None
