"""The steps of the pipeline that join two rooms: small, in the order in which the pipeline takes them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from lubdub.areas.anatomy import age_from_sternum, sternum_length_mm, still_high
from lubdub.areas.project import Skin, on_file
from lubdub.areas.rule import region_radius_mm, sigma_on_skin
from lubdub.areas.words import instruction
from lubdub.fitting.expected import STRICT, UNLIKE, Expected, Span, expect
from lubdub.fitting.pose import find_pose
from lubdub.fitting.refine import refine
from lubdub.fitting.shape import Pose, Pull, ShapeFitSettings, Target, carried, fit_shape
from lubdub.fitting.starts import End, best_end, ended, sized_starts, start_from, starts_at_notch
from lubdub.geometry.colour import Tint
from lubdub.geometry.frames import Similarity, body_axes
from lubdub.geometry.neighbours import SurfaceFinder
from lubdub.geometry.raycast import SkinCaster
from lubdub.geometry.whereabouts import whereabouts
from lubdub.judging import reasons
from lubdub.judging.measures import chest_coverage, chest_rise
from lubdub.judging.verdict import Evidence
from lubdub.landmarks.check import check_landmarks
from lubdub.landmarks.frame import can_frame, frame_from_landmarks, long_axis
from lubdub.landmarks.suggest import suggest, suggest_bones
from lubdub.methods import NEEDED, Chest
from lubdub.results import (
    BONE_LANDMARKS,
    LANDMARK_NAMES,
    NIPPLES,
    Area,
    AreaName,
    CleanScan,
    Fit,
    Landmark,
    LandmarkName,
    Library,
    Located,
    MethodName,
    Patient,
    RawScan,
    Reason,
    ScanRefused,
    ShapeBasis,
)

ADULT_STERNUM_MM = 150.0


@dataclass(frozen=True)
class StageSettings:
    """How far clicks are trusted (one standard deviation) and what an unmarked scan must show."""

    bone_click_mm: float = 6.0
    """An expert is off by 5 mm, a parent by 10."""
    skin_click_mm: float = 5.0
    sticker_mm: float = 5.0
    """A sticker is read to 1 mm, and saves the click; but it lies where a finger felt the bone."""
    navel_pull_mm: float = 8.0
    nipple_pull_mm: float = 10.0
    breast_nipple_pull_mm: float = 30.0
    """After puberty a woman's nipples slide 30-40 mm over the ribs when she lies down."""
    to_landmarks: ShapeFitSettings = field(
        default_factory=lambda: ShapeFitSettings(
            iterations=6, first_scale_mm=8.0, modes_by_iteration=(), effective_points=500.0
        )
    )
    """A few more steps of the fit towards all landmarks, before the overlay. Here the skin counts for more: the mesh's
    own marks of 120 simulated people were 4.50 mm off when it counted for 300 points, 4.44 with 500, 4.49 with 1000."""
    overlay_bone_mm: float = 4.0
    """How near the overlay comes to the believed breastbone; drawn to the bare clicks, its marks were 0.1 mm worse."""
    overlay_breast_nipple_mm: float = 10.0
    """With 5 the marks of women with large breasts were 5.5 mm off, not 5.2: breasts slide as no basis knows."""
    sternum_share: float = 0.16
    """How far a breastbone is from what age and sex let one expect: 8 % between people, and a stature unknown."""
    pose_margin: float = 0.18
    """By how much the best turn must beat every other. Of 161 simulated people, unmarked and lying anyhow, 84 of them
    over four, 12 were laid wrong: 11 with 0.09 at most. Over four all others had 0.21 and more; small children, whose
    belly is as round as their chest, anything: four in ten are asked for marks."""
    pose_misfit_mm: float = 38.0
    """For a body as large as the basis' mean; good scans leave 9-30, babies' up to 50; the wrong one with a margin of
    0.17 had 43."""


SETTINGS = StageSettings()


class LieUnclear(ScanRefused):
    """No turn explains the scan, or two explain it alike. guess: the rigid move by the best of them, scan to body."""

    def __init__(self, reason: Reason, guess: Similarity) -> None:
        super().__init__(reason)
        self.guess = guess


@dataclass(frozen=True)
class Laid:
    """A scan in the body frame, the given landmarks in it, and where a shape fit should start.

    by_sticker: those of the landmarks that printed stickers gave; tint: the skin's colours, if any.
    """

    scan: CleanScan
    given: Mapping[LandmarkName, np.ndarray]
    start: Pose
    by_sticker: frozenset[LandmarkName] = frozenset()
    tint: Tint | None = None


def lay_down(
    scan: CleanScan,
    in_file: Mapping[LandmarkName, np.ndarray],
    basis: ShapeBasis,
    patient: Patient,
    by_sticker: frozenset[LandmarkName] = frozenset(),
    tint: Tint | None = None,
) -> Laid:
    """Turn a scan into the body frame: by its landmarks, or by its shape when they do not suffice.

    in_file: landmarks in the file's coordinates; by_sticker: those of them that printed stickers gave; tint: for later.
    Raises LieUnclear when no turn explains the scan, ScanRefused when the landmarks contradict it.
    """
    clicked = {name: scan.body_from_file.apply(np.asarray(place, float)) for name, place in in_file.items()}
    if can_frame(clicked):
        move = frame_from_landmarks(clicked, scan.points, scan.normals)
        given = {name: move.apply(place) for name, place in clicked.items()}
        return Laid(scan.moved(move), given, start_from(given, basis, expected(patient, basis)), by_sticker, tint)
    found = find_pose(scan, basis, expected=expected(patient, basis, STRICT))
    rotation = found.pose.body_from_basis.rotation.T
    move = Similarity(1.0, rotation, -rotation @ found.fit.landmarks["suprasternal_notch"])
    if found.misfit_mm > SETTINGS.pose_misfit_mm * found.pose.body_from_basis.scale:
        raise LieUnclear(reasons.FIT_FAILED, move)
    if found.margin < SETTINGS.pose_margin:
        raise LieUnclear(reasons.ORIENTATION_UNKNOWN, move)
    start = Pose(move.after(found.pose.body_from_basis), found.pose.coefficients)
    given = {name: move.apply(place) for name, place in clicked.items()}
    return Laid(scan.moved(move), given, start, by_sticker, tint)


def check(laid: Laid, patient: Patient) -> tuple[Reason, ...]:
    """Whether the given landmarks can belong to one body of this age. Raises ScanRefused when not."""
    sternum = expected_sternum(patient)
    return check_landmarks(laid.scan, laid.given, sternum.length_mm if sternum else None)


def understand(laid: Laid, patient: Patient, method: MethodName, library: Library) -> Chest:
    """Fit the shape basis where the method needs it, suggest what was not clicked, straighten the frame."""
    given = {name: _mark(name, place, laid.by_sticker) for name, place in laid.given.items()}
    if method != "lubdub" and all(name in given for name in NEEDED[method]):
        return Chest(laid.scan, given, patient, _age(patient, given, None))
    # Bone clicks do not pull the body: skin and clicks are then two witnesses who have not heard each other.
    seen = {name: place for name, place in laid.given.items() if name not in BONE_LANDMARKS}
    target, body, starts = Target.of(laid.scan), expected(patient, library.basis), [laid.start]
    if seen and not all(name in laid.given for name in BONE_LANDMARKS):
        starts = _sized(laid.start, seen, library.basis, body)
    end = best_end(target, _pulls(seen, patient), library.basis, starts, body)
    chest = _straightened(Chest(laid.scan, given, patient, _age(patient, given, end.fit)), end, laid.given)
    if len(given) == len(LANDMARK_NAMES):
        return chest
    suggested = suggest(chest.scan, chest.fit or end.fit, library.basis.data_weight, library.signs, laid.tint)
    chest = replace(chest, landmarks={**suggested, **chest.landmarks})
    return chest if given else _second_look(chest, library.basis)


def _second_look(chest: Chest, basis: ShapeBasis) -> Chest:
    """An unmarked chest fitted again from where its own relief has navel and nipples, if that explains it better.

    A fit slides along smooth skin with friction, and the turn that was found may be far from the right size and place.
    """
    if chest.pose is None or chest.fit is None:
        return chest
    target, seen = Target.of(chest.scan), {n: mark for n, mark in chest.landmarks.items() if n not in BONE_LANDMARKS}
    places = {name: mark.position for name, mark in seen.items()}
    pulls = {
        name: Pull(pull.position, float(np.hypot(pull.sigma_mm, seen[name].uncertainty_mm)))
        for name, pull in _pulls(places, chest.patient).items()
    }
    body = expected(chest.patient, basis)
    starts = _sized(start_from(places, basis, body), places, basis, body)
    starts += starts_at_notch(chest.fit, places["navel"], basis, body)
    end = best_end(target, pulls, basis, starts, body)
    if end.misfit_mm >= ended(chest.pose, chest.fit, basis, target, body).misfit_mm:
        return chest
    return _straightened(replace(chest, landmarks={**chest.landmarks, **suggest_bones(chest.scan, end.fit)}), end, {})


def _sized(start: Pose, seen: Mapping[LandmarkName, np.ndarray], basis: ShapeBasis, body: Expected) -> list[Pose]:
    """Starts of several sizes about the middle of the landmarks seen on the skin."""
    return sized_starts(start, np.mean(list(seen.values()), axis=0), basis, body)


def expected(patient: Patient, basis: ShapeBasis, unlike: float = UNLIKE) -> Expected:
    """The body of such a person before anybody looks at the scan."""
    return expect(basis, patient.age_years, patient.sex, expected_sternum(patient), unlike)


def expected_sternum(patient: Patient) -> Span | None:
    """How long the breastbone of such a person usually is; None when the age was not said."""
    if patient.age_years is None:
        return None
    length = sternum_length_mm(patient.age_years, patient.sex)
    return Span(length, SETTINGS.sternum_share * length)


def with_overlay(chest: Chest, method: MethodName, library: Library) -> Chest:
    """The chest with the fitted body brought to its landmarks and laid on its skin, for the method that shows it."""
    if method != "lubdub" or chest.fit is None or chest.pose is None:
        return chest
    target, pulls, usual = Target.of(chest.scan), _overlay_pulls(chest), expected(chest.patient, library.basis)
    _, body = fit_shape(target, pulls, library.basis, chest.pose, SETTINGS.to_landmarks, usual)
    overlay = refine(body, target, pulls, library.basis)
    areas = carried(overlay.surface, library.basis, still_high(chest.age_years)).areas
    return replace(chest, overlay=replace(overlay, areas=areas))


def _overlay_pulls(chest: Chest) -> dict[LandmarkName, Pull]:
    """To the believed breastbone, and to navel and nipples where they were marked."""
    pulls = {name: Pull(mark.position, mark.uncertainty_mm) for name, mark in chest.marked.items()}
    if chest.patient.may_have_breasts:
        pulls |= {n: replace(pulls[n], sigma_mm=SETTINGS.overlay_breast_nipple_mm) for n in pulls.keys() & NIPPLES}
    bone = chest.breastbone()
    ends = zip(BONE_LANDMARKS, (bone.notch, bone.joint), strict=True)
    return pulls | {name: Pull(end, SETTINGS.overlay_bone_mm) for name, end in ends}


def _mark(name: LandmarkName, place: np.ndarray, by_sticker: frozenset[LandmarkName]) -> Landmark:
    if name in by_sticker:
        return Landmark(place, "sticker", SETTINGS.sticker_mm)
    sigma = SETTINGS.bone_click_mm if name in BONE_LANDMARKS else SETTINGS.skin_click_mm
    return Landmark(place, "given", sigma)


def _pulls(seen: Mapping[LandmarkName, np.ndarray], patient: Patient) -> dict[LandmarkName, Pull]:
    """What navel and nipples say of the bones: less than where they are themselves."""
    nipple = SETTINGS.breast_nipple_pull_mm if patient.may_have_breasts else SETTINGS.nipple_pull_mm
    return {name: Pull(place, SETTINGS.navel_pull_mm if name == "navel" else nipple) for name, place in seen.items()}


def _straightened(chest: Chest, end: End, given: Mapping[LandmarkName, np.ndarray]) -> Chest:
    """The chest with its fit, moved so that the fitted front is on +z, the clicked long axis over +y, the notch at 0.

    The chest slopes against the bed, so the line through the landmarks says where the head is in the frontal
    plane, but not how that plane lies: the fitted body does.
    """
    best = {**end.fit.landmarks, **given}
    front = end.pose.body_from_basis.rotation[:, 2]
    up = long_axis(best)
    rotation = body_axes(up - (up @ front) * front, front)
    move = Similarity(1.0, rotation, -rotation @ best["suprasternal_notch"])
    return replace(
        chest,
        scan=chest.scan.moved(move),
        landmarks={name: replace(mark, position=move.apply(mark.position)) for name, mark in chest.landmarks.items()},
        fit=end.fit.moved(move),
        pose=Pose(move.after(end.pose.body_from_basis), end.pose.coefficients),
    )


def _age(patient: Patient, given: Mapping[LandmarkName, Landmark], fit: Fit | None) -> float:
    """The age as said; otherwise the age that usually goes with this breastbone."""
    if patient.age_years is not None:
        return patient.age_years
    places = dict(fit.landmarks) if fit else {}
    places |= {name: mark.position for name, mark in given.items()}
    if not all(name in places for name in BONE_LANDMARKS):
        return 18.0
    return age_from_sternum(float(np.linalg.norm(places["suprasternal_notch"] - places["xiphisternum"])))


def project(chest: Chest, located: Located, raw: RawScan) -> tuple[dict[AreaName, Area], dict[AreaName, float]]:
    """The areas on the file's own surface, and how far each place was from scanned skin."""
    skin = Skin(chest.scan)
    caster = SkinCaster(chest.scan.display)
    notch = chest.notch(located.fit)
    finder = SurfaceFinder(raw.surface)
    areas, gaps = {}, {}
    for name, estimate in located.areas.items():
        place = skin.drop(estimate.position)
        position = on_file(place, finder, chest.scan.body_from_file)
        words = instruction(whereabouts(caster, place.position, notch))
        radius = region_radius_mm(sigma_on_skin(estimate.sigma_mm, place.normal))
        areas[name] = Area(position, place.normal, radius, words)
        gaps[name] = place.gap_mm
    return areas, gaps


def evidence(
    chest: Chest, located: Located, gaps: Mapping[AreaName, float], areas: Mapping[AreaName, Area], method: MethodName
) -> Evidence:
    """What the judge looks at."""
    size = located.measures["sternum_mm"] / ADULT_STERNUM_MM
    places = np.array([area.position for area in areas.values()] + [np.zeros(3)])
    coverage = chest_coverage(chest.scan, places, size)
    # Only a fit says which way the front faces well enough to measure depths.
    rise = chest_rise(chest.scan, chest.landmarks) if chest.fit else None
    return Evidence(located, method, chest.patient, chest.landmarks, gaps, coverage, rise, size)
