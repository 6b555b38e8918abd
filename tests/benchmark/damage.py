"""What can go wrong with a scan or with the clicks on it, done to simulated people on purpose.

Until a file is written everything is in millimetres in the scene's axes: +x the patient's left, +y head, +z up from
the bed. The clicks are those a person would make on this very scan: carried along with the skin, left out where
there is no skin to click.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from lubdub.geometry.surface import Surface
from lubdub.results import AREA_NAMES, BONE_LANDMARKS, LANDMARK_NAMES, LandmarkName, Patient
from lubdub.stages import ADULT_STERNUM_MM
from references.make.cameras import SCANNERS, Scene, Shot
from references.make.moment import Moment, draw_moment
from references.make.scan import joined
from references.make.scene import cloth
from references.make.subject import Subject
from tests.benchmark import cohort
from tests.benchmark.measure import Case

Clicks = dict[LandmarkName, np.ndarray]

SKIN_NEAR_MM = 15.0
"""Where the scan has no point this near, there is nothing to click."""


@dataclass(frozen=True)
class Staging:
    """Somebody about to be scanned; whatever is random comes from `random`."""

    subject: Subject
    person: cohort.Person
    scanner: str
    random: np.random.Generator
    other: Callable[[], Subject]
    """Draws somebody else."""

    @staticmethod
    def of(seed: int, number: int, kind: int) -> Staging:
        """Person `number` of a seed, for damage number `kind`."""
        subject, person = cohort.draw_person(seed, number)
        random = np.random.default_rng([seed, number, 1000 + kind])
        return Staging(
            subject, person, cohort.scanner_of(number), random, lambda: cohort.draw_person(seed, number + 7)[0]
        )

    def lay(self, moment: Moment | None = None) -> tuple[Scene, cohort.Places]:
        """On the bed."""
        return cohort.lay(self.subject, self.random, moment)

    def draft(self, scene: Scene, places: cohort.Places) -> Draft:
        """Scan the scene."""
        shot = SCANNERS[self.scanner](scene, self.random)
        surface = Surface(shot.file_from_scene.inverse().apply(shot.surface.vertices), shot.surface.triangles)
        return Draft(
            surface, dict(zip(LANDMARK_NAMES, places.clicks, strict=True)), places.landmarks, places.areas, shot
        )

    def ordinary(self) -> Draft:
        """A good scan of this person."""
        return self.draft(*self.lay())


@dataclass(frozen=True)
class Draft:
    """A scan before it is written. surface and all places in the scene's mm; landmarks (5, 3) and areas (4, 3): truth.

    shot: how the file's axes lie; file_scale: on top of the device's own; unit: what the person says it is.
    """

    surface: Surface
    clicks: Clicks
    landmarks: np.ndarray
    areas: np.ndarray
    shot: Shot = field(repr=False)
    file_scale: float = 1.0
    unit: str | None = None

    def moved(self, move: Callable[[np.ndarray], np.ndarray]) -> Draft:
        """The scan and everything on it after a map of places (..., 3)."""
        return replace(
            self,
            surface=Surface(move(self.surface.vertices), self.surface.triangles),
            clicks={name: move(place) for name, place in self.clicks.items()},
            landmarks=move(self.landmarks),
            areas=move(self.areas),
        )

    def kept(self, keep: np.ndarray) -> Draft:
        """Only these vertices (n,) bool, and the clicks that still have skin."""
        surface = self.surface.kept(keep)
        clicks = {name: place for name, place in self.clicks.items() if _gap(surface, place) < SKIN_NEAR_MM}
        return replace(self, surface=surface, clicks=clicks)

    def clicked(self, name: LandmarkName, place: np.ndarray) -> Draft:
        """With one click put elsewhere, on the skin that is seen there from the front."""
        return replace(self, clicks={**self.clicks, name: on_scan(self.surface, place)})

    def case(self, staging: Staging, name: str) -> Case:
        """As a file with its truth."""
        to_file, scale = self.shot.file_from_scene, self.file_scale

        def in_file(names: Any, places: np.ndarray) -> dict[Any, np.ndarray]:
            return dict(zip(names, scale * to_file.apply(places), strict=True))

        written = Surface(scale * to_file.apply(self.surface.vertices), self.surface.triangles)
        phenotype = staging.subject.phenotype
        return Case(
            name=f"{name}: {staging.person.name}",
            group=staging.person.group,
            camera=staging.scanner,
            data=replace(self.shot, surface=written).encoded(),
            patient=Patient(phenotype.age_years, phenotype.sex),
            clicks=in_file(self.clicks, np.array(list(self.clicks.values())).reshape(-1, 3)),
            landmarks=in_file(LANDMARK_NAMES, self.landmarks),
            areas=in_file(AREA_NAMES, self.areas),
            mm_per_unit=1.0 / (scale * to_file.scale),
            unit=self.unit,
        )


def on_scan(surface: Surface, place: np.ndarray) -> np.ndarray:
    """(3,) the point of the scan that is met above or below a place (3,) when looked at from the front."""
    beside = np.linalg.norm(surface.vertices[:, :2] - place[:2], axis=1)
    near = np.flatnonzero(beside < max(10.0, float(beside.min()) + 1.0))
    heights = surface.vertices[near, 2]
    chosen = near[np.abs(heights - np.percentile(heights, 70)).argmin()]
    return surface.vertices[chosen]


def _gap(surface: Surface, place: np.ndarray) -> float:
    return float(np.linalg.norm(surface.vertices - place, axis=1).min()) if len(surface.vertices) else np.inf


def good(staging: Staging) -> Draft:
    """Nothing wrong: what must be shown."""
    return staging.ordinary()


def mirrored_by_body(staging: Staging) -> Draft:
    """Mirrored, and the person clicks the nipple on the patient's left hand: the skin contradicts it."""
    draft = staging.ordinary().moved(lambda places: places * [-1.0, 1.0, 1.0])
    turned_over = Surface(draft.surface.vertices, draft.surface.triangles[:, ::-1])
    return replace(draft, surface=turned_over)


def mirrored_by_picture(staging: Staging) -> Draft:
    """Mirrored, and the person clicks where left is in pictures: nothing on the scan can show it."""
    draft = mirrored_by_body(staging)
    return replace(draft, clicks=_exchanged(draft.clicks, "nipple_left", "nipple_right"))


def nipples_swapped(staging: Staging) -> Draft:
    """Left clicked as right."""
    draft = staging.ordinary()
    return replace(draft, clicks=_exchanged(draft.clicks, "nipple_left", "nipple_right"))


def notch_and_navel_swapped(staging: Staging) -> Draft:
    """The body stands on its head."""
    draft = staging.ordinary()
    return replace(draft, clicks=_exchanged(draft.clicks, "suprasternal_notch", "navel"))


def _exchanged(clicks: Clicks, one: LandmarkName, other: LandmarkName) -> Clicks:
    swapped: dict[LandmarkName, LandmarkName] = {one: other, other: one}
    return {name: clicks[swapped.get(name, name)] for name in clicks}


def one_wild(name: LandmarkName) -> Callable[[Staging], Draft]:
    """One click 60-150 mm off, in any direction along the skin; less in a child, who is smaller."""

    def make(staging: Staging) -> Draft:
        draft, random = staging.ordinary(), staging.random
        angle, size = random.uniform(0, 2 * np.pi), staging.subject.sternum_mm / ADULT_STERNUM_MM
        off = random.uniform(60.0, 150.0) * max(size, 0.6) * np.array([np.cos(angle), np.sin(angle), 0.0])
        return draft.clicked(name, draft.clicks[name] + off)

    return make


def hollow_clicked(staging: Staging) -> Draft:
    """The hollow one sees above the breastbone instead of the bone one feels: 20-30 mm too high in an adult."""
    draft = staging.ordinary()
    high = staging.random.uniform(20.0, 30.0) * staging.subject.sternum_mm / ADULT_STERNUM_MM
    return draft.clicked("suprasternal_notch", draft.clicks["suprasternal_notch"] + [0.0, high, 0.0])


def half_missing(axis: int, side: float) -> Callable[[Staging], Draft]:
    """Only one side of the chest's middle was scanned. axis: 0 across, 1 along; side: +1 keeps left or upper."""

    def make(staging: Staging) -> Draft:
        draft = staging.ordinary()
        middle = draft.landmarks[:2].mean(axis=0)[axis] + staging.random.uniform(-15.0, 15.0)
        return draft.kept(side * (draft.surface.vertices[:, axis] - middle) > 0)

    return make


def boneless(make: Callable[[Staging], Draft]) -> Callable[[Staging], Draft]:
    """Another damage, and nobody felt for the breastbone."""

    def work(staging: Staging) -> Draft:
        draft = make(staging)
        seen = {name: place for name, place in draft.clicks.items() if name not in BONE_LANDMARKS}
        return replace(draft, clicks=seen)

    return work


def centimetres_called_metres(staging: Staging) -> Draft:
    """A hundred times too large."""
    draft = staging.ordinary()
    return replace(draft, file_scale=0.1 / draft.shot.file_from_scene.scale, unit="m")


def inches_not_said(staging: Staging) -> Draft:
    """A unit nobody named and the product does not know."""
    draft = staging.ordinary()
    return replace(draft, file_scale=1.0 / 25.4 / draft.shot.file_from_scene.scale)


def inches_called_centimetres(staging: Staging) -> Draft:
    """An adult the size of a baby."""
    return replace(inches_not_said(staging), unit="cm")


def scaled(factor: float) -> Callable[[Staging], Draft]:
    """A device that measures wrong: the file is so many times too large, and nobody knows."""
    return lambda staging: replace(staging.ordinary(), file_scale=factor)


def sunken(mm: float) -> Callable[[Staging], Draft]:
    """A funnel chest: the front about the breastbone's lower end lies so much deeper, at an adult's size."""

    def work(staging: Staging) -> Draft:
        draft = staging.ordinary()
        notch, joint = draft.landmarks[:2]
        length = float(np.linalg.norm(joint - notch))
        deepest, depth = notch + 0.85 * (joint - notch), mm * length / ADULT_STERNUM_MM

        def sink(places: np.ndarray) -> np.ndarray:
            across, along, above = np.moveaxis((places - deepest) / length, -1, 0)
            share = np.where(above > -0.4, np.exp(-((across / 0.3) ** 2 + (along / 0.4) ** 2) / 2), 0.0)
            return places - depth * share[..., None] * np.array([0.0, 0.0, 1.0])

        return draft.moved(sink)

    return work


def motion_blur(staging: Staging) -> Draft:
    """The person moved: two poses 5-20 mm apart lie over each other."""
    draft, random = staging.ordinary(), staging.random
    size = max(0.5, staging.subject.sternum_mm / ADULT_STERNUM_MM)
    direction = random.normal(size=3)
    shift = direction / np.linalg.norm(direction) * random.uniform(5.0, 20.0) * size
    second = Surface(draft.surface.vertices + shift, draft.surface.triangles)
    return replace(draft, surface=joined([draft.surface, second]))


def two_people(staging: Staging) -> Draft:
    """Somebody else lies beside, as near as can be; the clicks are on the right person."""
    scene, places, _ = _pair(staging)
    return staging.draft(scene, places)


def clicks_on_two_people(staging: Staging) -> Draft:
    """The same, but navel and nipples were clicked on the other one."""
    scene, places, beside = _pair(staging)
    return staging.draft(scene, replace(places, clicks=np.concatenate([places.clicks[:2], beside[2:]])))


def _pair(staging: Staging) -> tuple[Scene, cohort.Places, np.ndarray]:
    """The scene with both, the first one's places, and where the other one would be clicked (5, 3)."""
    random, other = staging.random, staging.other()
    scene, places = staging.lay(replace(draw_moment(random, 1.0), raised_deg=0.0))
    beside, beside_places = cohort.lay(other, random, replace(draw_moment(random, 1.0), raised_deg=0.0))
    gap = 0.92 * (_half_width(scene) + _half_width(beside)) * random.choice([-1.0, 1.0])
    shift = np.array([gap, random.uniform(-60.0, 60.0), scene.centre[2] - beside.centre[2]])
    second = Surface(beside.people.vertices + shift, beside.people.triangles)
    both = replace(scene, people=joined([scene.people, second]), centre=scene.centre + [0.25 * gap, 0.0, 0.0])
    return both, places, beside_places.clicks + shift


def _half_width(scene: Scene) -> float:
    near = np.abs(scene.people.vertices[:, 1] - scene.centre[1]) < 0.5 * scene.length
    return float(np.ptp(scene.people.vertices[near, 0])) / 2


def dressed(garment: str) -> Callable[[Staging], Draft]:
    """Clothes 3-15 mm over the skin: a T-shirt, a band over the breasts, or a cloth over part of the chest."""

    def make(staging: Staging) -> Draft:
        scene, places = staging.lay()
        random, marks = staging.random, places.landmarks
        breadth, sternum = (marks[3, 0] - marks[4, 0]) / 0.6, staging.subject.sternum_mm
        middle = 0.5 * (marks[3] + marks[4])
        side = middle[0] + 0.55 * breadth * np.array([-1.0, 1.0])
        if garment == "T-shirt":
            along = marks[2, 1] - 0.6 * sternum, marks[0, 1] + 0.05 * sternum
        elif garment == "band":
            along = middle[1] - 0.3 * sternum, middle[1] + 0.3 * sternum
        else:
            start = random.uniform(-1.4, -0.4) * sternum
            along = marks[0, 1] + start - 0.5 * sternum, marks[0, 1] + start + 0.5 * sternum
            side = side + random.choice([-1.0, 0.0, 1.0]) * 0.5 * breadth
        thickness = random.uniform(3.0, 8.0 if garment == "band" else 15.0)
        bridged = 60.0 if garment == "band" else 24.0
        worn = cloth(scene.people, random, (side[0], side[1]), along, thickness, bridged)
        draft = staging.draft(replace(scene, people=joined([scene.people, worn])), places)
        # Through cloth nobody sees the navel or the nipples.
        unseen = 8.0 * random.normal(size=(5, 2)) / np.sqrt(2.0)
        for place, name in enumerate(LANDMARK_NAMES):
            x, y = places.clicks[place, :2]
            hidden = place >= 2 and side[0] < x < side[1] and along[0] < y < along[1]
            draft = draft.clicked(name, places.clicks[place] + [*(unseen[place] * hidden), 0.0])
        return draft

    return make


def back_side(by_body: bool) -> Callable[[Staging], Draft]:
    """Lying on the belly. The clicks lie over the front's: by_body, or as if this back were a front."""

    def make(staging: Staging) -> Draft:
        scene, places = staging.lay(Moment(roll_deg=180.0))
        draft = staging.draft(scene, places)
        for name, place in zip(LANDMARK_NAMES, places.clicks, strict=True):
            draft = draft.clicked(name, place)
        if by_body:
            return draft
        return replace(draft, clicks=_exchanged(draft.clicks, "nipple_left", "nipple_right"))

    return make


def elsewhere(part: str) -> Callable[[Staging], Draft]:
    """Legs or head alone, with clicks in the usual pattern on whatever there is."""

    def make(staging: Staging) -> Draft:
        scene, places = staging.lay(Moment())
        along = {"legs": -2.2, "head": 0.85}[part] * scene.length
        draft = staging.draft(replace(scene, centre=scene.centre + [0.0, along, 0.0]), places)
        y = draft.surface.vertices[:, 1]
        limit = places.landmarks[2, 1] - 0.5 * scene.length if part == "legs" else places.landmarks[0, 1]
        draft = draft.kept(y < limit if part == "legs" else y > limit)
        body = draft.surface.vertices[draft.surface.vertices[:, 2] > scene.centre[2] + 0.1 * scene.length]
        pattern = places.clicks - places.clicks.mean(axis=0)
        pattern = pattern * min(1.0, 0.8 * float(np.ptp(body[:, 1])) / float(np.ptp(pattern[:, 1])))
        for name, place in zip(LANDMARK_NAMES, pattern, strict=True):
            draft = draft.clicked(name, np.median(body, axis=0) + place)
        return draft

    return make
