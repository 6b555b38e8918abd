"""Putting an outcome together: what was found, how long it took, and what would be needed to repeat it."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

import numpy as np

from lubdub import __version__
from lubdub.areas import anatomy
from lubdub.areas.bones import BoneSettings
from lubdub.areas.project import DropSettings
from lubdub.fitting import starts
from lubdub.fitting.pose import PoseSettings
from lubdub.fitting.refine import RefineSettings
from lubdub.fitting.schedule import PAPER
from lubdub.fitting.shape import ShapeFitSettings
from lubdub.geometry.frames import Similarity
from lubdub.geometry.sparse import solver_name
from lubdub.geometry.stickers import STICKERS
from lubdub.judging.measures import StrainSettings, chest_coverage
from lubdub.judging.reasons import LIE_UNCLEAR
from lubdub.judging.verdict import Evidence, Gates
from lubdub.landmarks import patches, places, tint
from lubdub.landmarks.check import LandmarkLimits
from lubdub.landmarks.stickers import StickerSettings
from lubdub.landmarks.suggest import SuggestionSettings
from lubdub.library import nearest
from lubdub.library.similar import SimilaritySettings
from lubdub.methods import Chest
from lubdub.results import (
    Area,
    AreaName,
    Examination,
    Landmark,
    Library,
    Located,
    MethodName,
    Outcome,
    Progress,
    Quality,
    Reason,
    VerdictWord,
)
from lubdub.scans import check, clean, crop, limits, normals, pieces, planes, units
from lubdub.stages import ADULT_STERNUM_MM, SETTINGS
from lubdub.stickers import Prepared, StickerGates

_STARTS_AT = {"read": 0.0, "clean": 0.1, "fit": 0.3, "choose": 0.6, "project": 0.9, "judge": 0.97}


class Clock:
    """Times the stages and tells the listener when each begins."""

    def __init__(self, progress: Progress) -> None:
        self._progress = progress
        self._start = time.perf_counter()
        self._seconds: dict[str, float] = {}

    @contextmanager
    def __call__(self, stage: str) -> Iterator[None]:
        """Around one stage."""
        self._progress(stage, _STARTS_AT[stage])
        begun = time.perf_counter()
        try:
            yield
        finally:
            self._seconds[stage] = self._seconds.get(stage, 0.0) + time.perf_counter() - begun

    def seconds(self) -> dict[str, float]:
        """Stage -> seconds, and the total so far."""
        return {**self._seconds, "total": time.perf_counter() - self._start}


def outcome(
    chest: Chest,
    located: Located,
    areas: Mapping[AreaName, Area],
    evidence: Evidence,
    judged: tuple[VerdictWord, tuple[Reason, ...]],
    provenance: Mapping[str, str],
    clock: Clock,
) -> Outcome:
    """The whole result of a run; its areas are left out when it was refused."""
    verdict, reasons = judged
    fit = located.fit
    quality = Quality(
        surface_residual_mm=fit.surface_residual_mm if fit else None,
        landmark_residual_mm=located.measures.get("landmark_residual_mm"),
        coverage=evidence.coverage,
        spread_mm=located.measures.get("spread_mm"),
    )
    return Outcome(
        verdict=verdict,
        reasons=reasons,
        areas={} if verdict == "refuse" else areas,
        landmarks=chest.landmarks,
        scan=chest.scan,
        fit=fit,
        references=located.references,
        selected=located.selected,
        quality=quality,
        timings_s=clock.seconds(),
        method=provenance,
        steps=fit.steps if fit else (),
        notes=located.notes,
    )


def refused(reason: Reason, ready: Prepared | None, provenance: Mapping[str, str], clock: Clock) -> Outcome:
    """A run that stopped before there was anything to judge; ready: None when it stopped before it was prepared."""
    scan, proof = (ready.scan, ready.proof) if ready else (None, None)
    return Outcome("refuse", (reason,), {}, {}, scan, None, (), None, None, clock.seconds(), provenance, stickers=proof)


def constants() -> str:
    """The settings of every room, written out. Numbers inside a formula stand in the code, which the version names."""
    return repr(
        (
            (
                limits.LIMITS,
                units.LIMITS,
                clean.SETTINGS,
                crop.SETTINGS,
                normals.SETTINGS,
                pieces.SETTINGS,
                planes.SETTINGS,
            ),
            check.SETTINGS,
            SETTINGS,
            ShapeFitSettings(),
            RefineSettings(),
            PoseSettings(),
            starts.SETTINGS,
            PAPER,
            SimilaritySettings(),
            nearest.SETTINGS,
            BoneSettings(),
            (anatomy.AORTIC, anatomy.PULMONARY, anatomy.TRICUSPID, anatomy.MITRAL, anatomy.MITRAL_UNDER_FOUR),
            DropSettings(),
            LandmarkLimits(),
            StickerSettings(),
            StickerGates(),
            STICKERS,
            SuggestionSettings(),
            (places.PLACES, places.NAVEL, places.NIPPLE),
            (patches.SETTINGS, tint.SETTINGS),
            StrainSettings(),
            Gates(),
        )
    )


def provenance(method: MethodName, library: Library) -> dict[str, str]:
    """What decides the numbers: the code by its version, method, solver, settings and references."""
    return {
        "name": method,
        "version": __version__,
        "solver": solver_name(),
        "parameters_sha256": hashlib.sha256(constants().encode()).hexdigest(),
        "references_sha256": library.sha256,
    }


def examined(chest: Chest, trunk_weight: np.ndarray) -> Examination:
    """What can be said of a scan before anybody marked it. The chest must have a fit.

    trunk_weight: the basis' data_weight; the chest is measured on the fitted trunk, without the arms beside it.
    """
    if chest.fit is None:
        raise ValueError("an examination needs a fitted body")
    points = chest.scan.points
    low, high = np.percentile(points, (0.5, 99.5), axis=0)
    fitted = chest.fit.landmarks
    length = float(np.linalg.norm(fitted["suprasternal_notch"] - fitted["xiphisternum"]))
    trunk = chest.fit.surface.vertices[trunk_weight > 0.5]
    at_chest = trunk[np.abs(trunk[:, 1] - fitted["xiphisternum"][1]) < 0.25 * length]
    size = {"width_mm": high[0] - low[0], "length_mm": high[1] - low[1], "depth_mm": high[2] - low[2]}
    size["chest_width_mm"] = np.ptp(at_chest[:, 0])
    places = np.array([*chest.fit.areas.values(), fitted["suprasternal_notch"]])
    coverage = chest_coverage(chest.scan, places, length / ADULT_STERNUM_MM)
    return Examination(
        scan=chest.scan,
        size={name: float(value) for name, value in size.items()},
        coverage=coverage,
        suggested={name: mark for name, mark in chest.landmarks.items() if mark.source != "given"},
        warnings=check.check_scan(chest.scan),
    )


def examined_unturned(ready: Prepared, guess: Similarity) -> Examination:
    """What can be said of a scan whose shape does not show how it lies: its size, and where its stickers are.

    guess: the rigid move that turns the scan the likeliest way. The origin is the middle of the upper, front edge.
    """
    turned = ready.scan.moved(Similarity(1.0, guess.rotation, np.zeros(3)))
    low, high = np.percentile(turned.points, (0.5, 99.5), axis=0)
    scan = turned.moved(Similarity(1.0, np.eye(3), -np.array([(low[0] + high[0]) / 2, high[1], high[2]])))
    size = {"width_mm": high[0] - low[0], "length_mm": high[1] - low[1], "depth_mm": high[2] - low[2]}
    stuck = {name: scan.body_from_file.apply(ready.marked[name]) for name in ready.by_sticker}
    return Examination(
        scan=scan,
        size={name: float(value) for name, value in size.items()},
        coverage=None,
        suggested={name: Landmark(place, "sticker", SETTINGS.sticker_mm) for name, place in stuck.items()},
        warnings=(LIE_UNCLEAR, *check.check_scan(scan)),
    )
