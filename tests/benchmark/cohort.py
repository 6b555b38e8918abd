"""Unseen simulated people, their bones drawn under the skin with human spread, each before one of five scanners.

They come from the same base mesh as the references (other parameters, other modifiers, other deformations), so
they flatter every method that knows that mesh. The bones and areas do not follow the skin: that part is honest.

What is drawn (sd: one standard deviation; a to b: even; S: length of the breastbone; sizes for an adult):

| what | distribution |
|---|---|
| age, sex, build | by `GROUPS`, which take turns; stature sd 4.5 %; muscle, weight, proportions, breasts even |
| 7 local modifiers of 23 | -0.5 to 0.5 each, none known to the model (`references/make/makehuman.py`, UNSEEN) |
| smooth deformation | 40 Gaussian hills of 120 mm, root mean square 3 to 7 mm |
| S; both bones together | sd 8 %; sd 0.04 S |
| areas: level aortic, pulmonary, tricuspid, mitral; across | sd 0.03, 0.03, 0.04, 0.08 S; sd 0.03, 0.03, 0.03, 0.06 S |
| nipples up, out; navel | sd 0.075 S (women after puberty 0.13 S), 0.06 S; sd 0.12 S |
| lying: back pressed; belly sinks | 0.06 to 0.18 of the depth; 0 to 0.12 |
| breasts flatten; slide up, out | 0.35 to 0.8; 0.05 to 0.5 of their thickness each |
| arms from the body | 24 to 40 degrees, each side by itself |
| breath | -4 to 6 mm of the chest's rise; bones and areas ride on the ribs |
| roll; pitch; head end of the bed raised | sd 3; sd 2 degrees; one in four, 0 to 20 degrees |
| clicks | bones sd 8 mm, navel and nipples sd 5 mm, on the skin |
| overhead depth frame (L515) | one frame, 2.5 mm at 0.7 m growing with distance squared, holes, 3 % dropout |
| phone LiDAR mesh | 10 frames, 5 mm, each 3 mm out of place, fused on 7 to 10 mm voxels; scale sd 1 % |
| TrueDepth, fused | 9 close frames, 1 mm at 0.4 m, each 0.7 mm and 0.15 degrees out of place; scale sd 0.4 % |
| structured light | mesh of what is seen, 0.5 mm, bed cut away, any axes |
| Kinect | one coarse frame, 2 to 5 mm at 1 m, 70 % of it correlated, flying pixels at edges |

The same seed and number are always the same person; `scan` chooses another moment, other clicks, other noise.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from lubdub.fitting.shape import carried
from lubdub.geometry.anchors import Anchors, anchored
from lubdub.geometry.surface import Surface
from lubdub.results import AREA_NAMES, LANDMARK_NAMES, Patient, ShapeBasis
from references.make.anatomy import drop_on_skin
from references.make.basis import with_marks_in_place
from references.make.body import Workshop
from references.make.cameras import SCANNERS, Scene, Shot
from references.make.moment import Moment, breathe, draw_moment, raised_bed, tilted
from references.make.phenotype import Phenotype, Sex, draw_phenotype
from references.make.posture import bed_height, draw_lying
from references.make.scan import Stage, smooth_skin
from references.make.scene import bed
from references.make.subject import Subject, draw_subject
from tests.benchmark.measure import Case, shipped_library

CLICK_MM = np.array([8.0, 8.0, 5.0, 5.0, 5.0])
"""How far clicks lie from the true place, root mean square: bones felt through the skin, then what one sees."""

OTHER_PART_MM = 30.0
"""Skin in front of a place that is farther than this from the skin nearest to it belongs to something else."""

MATTRESS_GIVES_MM = 8.0


@dataclass(frozen=True)
class Group:
    """Who belongs to it. parts: what is fixed in the phenotype; the rest is drawn."""

    name: str
    ages: tuple[float, float]
    sexes: tuple[Sex, ...] = ("male", "female")
    parts: tuple[tuple[str, float], ...] = ()


GROUPS = (
    Group("under 4", (0.0, 4.0)),
    Group("4-11", (4.0, 12.0)),
    Group("12-17", (12.0, 18.0)),
    Group("men", (18.0, 65.0), ("male",)),
    Group("women, small breasts", (18.0, 65.0), ("female",), (("cup", 0.1),)),
    Group("women, middle breasts", (18.0, 65.0), ("female",), (("cup", 0.5),)),
    Group("women, large breasts", (18.0, 65.0), ("female",), (("cup", 0.9),)),
    Group("over 65", (65.0, 90.0)),
    Group("obese", (18.0, 65.0), ("male", "female"), (("weight", 1.25),)),
    Group("very thin", (18.0, 65.0), ("male", "female"), (("weight", 0.05),)),
)


def group_of(number: int) -> Group:
    """The groups take turns."""
    return GROUPS[number % len(GROUPS)]


def scanner_of(number: int) -> str:
    """The scanners take turns too, so that every group meets each of them."""
    names = list(SCANNERS)
    return names[(number + number // len(GROUPS)) % len(names)]


def cohort_case(seed: int, number: int, scan: int = 0, scanner: str | None = None) -> Case:
    """One of the people of a seed, always the same; `scan` and `scanner` choose another scan of this person."""
    subject, person = draw_person(seed, number)
    random = np.random.default_rng([seed, number, 1 + scan])
    scene, places = lay(subject, random)
    used = scanner or scanner_of(number)
    return case_of(person, used, subject, SCANNERS[used](scene, random), places)


@functools.cache
def workshop() -> Workshop:
    """MakeHuman and the shared topology, opened once."""
    return Workshop()


@dataclass(frozen=True)
class Person:
    """name: unlike anybody else's; group: a name of `GROUPS`."""

    name: str
    group: str


def draw_person(seed: int, number: int) -> tuple[Subject, Person]:
    """Who it is, before any scan."""
    random = np.random.default_rng([seed, number])
    group = group_of(number)
    phenotype = _phenotype(random, group)
    subject = draw_subject(workshop(), random, phenotype, lying=draw_lying(random))
    landmarks = np.concatenate([subject.mesh_bones, subject.landmarks[2:]])
    areas = areas_carried_by(subject.whole[workshop().torso.indices], landmarks, shipped_library().basis)
    return replace(subject, mesh_areas=areas), Person(f"{group.name} {number}", group.name)


def areas_carried_by(vertices: np.ndarray, landmarks: np.ndarray, basis: ShapeBasis) -> np.ndarray:
    """(4, 3) where a body (n, 3) of the shared topology carries the average body's areas between its own landmarks.

    The truth for a registration alone, in the basis' own correspondences: its training bodies were slid like that.
    landmarks: (5, 3) of a body whose bones follow its skin.
    """
    anchors = Anchors(basis.landmark_corners, basis.landmark_weights)
    slid = with_marks_in_place(workshop().torso, vertices, landmarks, anchors)
    areas = np.array(list(carried(Surface(slid, basis.triangles), basis).areas.values()))
    return Stage(Surface(vertices, basis.triangles)).nearest(areas)


def _phenotype(random: np.random.Generator, group: Group) -> Phenotype:
    sex = group.sexes[int(random.integers(len(group.sexes)))]
    drawn = draw_phenotype(random, float(random.uniform(*group.ages)), sex)
    arms = (float(random.uniform(24, 40)), float(random.uniform(24, 40)))
    return replace(drawn, arms_deg=arms, **dict(group.parts))  # type: ignore[arg-type]


@dataclass(frozen=True)
class Places:
    """What is known of a person in a scene, on the skin: clicks and truth, each (5, 3) landmarks or (4, 3) areas."""

    clicks: np.ndarray
    landmarks: np.ndarray
    areas: np.ndarray
    mesh_clicks: np.ndarray
    mesh_areas: np.ndarray


def lay(subject: Subject, random: np.random.Generator, moment: Moment | None = None) -> tuple[Scene, Places]:
    """The person on a bed at a moment, clicked by somebody; every place follows every deformation."""
    size = subject.sternum_mm / 150.0
    moment = moment or draw_moment(random, size)
    base, torso = workshop().makehuman.base, workshop().torso
    parts = _marked(subject, random.normal(size=(5, 2)) * CLICK_MM[:, None] / np.sqrt(2.0))
    anchors = anchored(Surface(subject.whole[torso.indices], torso.triangles), np.concatenate(parts))
    whole = tilted(breathe(torso, subject.whole, subject.sternum_mm, moment.breath_mm), moment)
    skin = smooth_skin(Surface(whole[: base.skin_count], base.triangles))
    places = Stage(skin).nearest(anchors.on(whole[torso.indices]))
    level = bed_height(whole, torso) + MATTRESS_GIVES_MM
    raised = raised_bed(level, subject.sternum_mm, moment.raised_deg)
    mattress = bed(level, random, 520.0, -1300.0, 480.0)
    length = float(np.linalg.norm(subject.landmarks[2]))
    scene = Scene(
        people=Surface(raised.bent(skin.vertices), skin.triangles),
        bed=Surface(raised.bent(mattress.vertices), mattress.triangles),
        centre=raised.bent(np.array([0.0, -0.45 * length, level])),
        length=length,
    )
    ends = np.cumsum([len(part) for part in parts])[:-1]
    return scene, Places(*np.split(raised.bent(places), ends))


def _marked(subject: Subject, noise: np.ndarray) -> tuple[np.ndarray, ...]:
    """In the order of `Places`, in the body frame. noise: (5, 2) of the clicks, seen from the front."""
    skin, triangles = subject.whole[workshop().torso.indices], workshop().torso.triangles
    mesh_landmarks = np.concatenate([subject.mesh_bones, subject.landmarks[2:]])

    def clicked(landmarks: np.ndarray) -> np.ndarray:
        beside = np.column_stack([landmarks[:, :2] + noise, landmarks[:, 2]])
        return np.array([_on_skin(place, skin, triangles) for place in beside])

    clicks, mesh_clicks = clicked(subject.landmarks), clicked(mesh_landmarks)
    return clicks, subject.landmarks, subject.areas, mesh_clicks, subject.mesh_areas


def _on_skin(place: np.ndarray, skin: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """(3,) the skin in front of a place (3,); the nearest where there is none, as above a newborn's notch.

    And the nearest where another part is in front, as an arm before the side of a large breast.
    """
    nearest = Stage(Surface(skin, triangles)).nearest(place[None])[0]
    try:
        front = drop_on_skin(place[None, :2], skin, triangles).positions[0]
    except ValueError:
        return nearest
    return front if np.linalg.norm(front - nearest) < OTHER_PART_MM else nearest


def case_of(person: Person, scanner: str, subject: Subject, shot: Shot, places: Places) -> Case:
    """The scan with its truth, in the file's coordinates."""

    def landmarks(points: np.ndarray) -> dict[Any, np.ndarray]:
        return dict(zip(LANDMARK_NAMES, shot.file_from_scene.apply(points), strict=True))

    def areas(points: np.ndarray) -> dict[Any, np.ndarray]:
        return dict(zip(AREA_NAMES, shot.file_from_scene.apply(points), strict=True))

    return Case(
        name=person.name,
        group=person.group,
        camera=scanner,
        data=shot.encoded(),
        patient=Patient(subject.phenotype.age_years, subject.phenotype.sex),
        clicks=landmarks(places.clicks),
        landmarks=landmarks(places.landmarks),
        areas=areas(places.areas),
        mm_per_unit=1.0 / shot.file_from_scene.scale,
        mesh_clicks=landmarks(places.mesh_clicks),
        mesh_areas=areas(places.mesh_areas),
    )
