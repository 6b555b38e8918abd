"""A stand-in for the people of the cohort: reference bodies, so that no test needs the downloaded source."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from lubdub.library.load import load_library
from lubdub.results import AREA_NAMES, LANDMARK_NAMES
from references.make.makehuman import BaseMesh
from references.make.phenotype import Phenotype
from references.make.subject import Subject
from references.make.torso import Torso
from tests.benchmark import cohort
from tests.benchmark.cohort import Person, group_of


def _workshop() -> SimpleNamespace:
    surface = load_library().references[0].surface
    count = len(surface.vertices)
    trunk = np.clip(4 * load_library().basis.data_weight, 0.0, 1.0)
    torso = Torso(np.arange(count), surface.triangles, trunk, {}, {}, {}, {})
    base = BaseMesh(surface.vertices, surface.triangles, {})
    return SimpleNamespace(torso=torso, makehuman=SimpleNamespace(base=base))


def _subject(number: int) -> Subject:
    references = [one for one in load_library().references if one.card["age_years"] >= 6]
    one = references[number % len(references)]
    landmarks = np.array([one.landmarks[name] for name in LANDMARK_NAMES])
    areas = np.array([one.areas[name] for name in AREA_NAMES])
    phenotype = Phenotype(one.card["age_years"], one.card["sex"], one.card["stature_mm"])
    sternum = float(landmarks[0, 1] - landmarks[1, 1])
    usual = np.array([areas, areas + [0.0, 10.0, 0.0]])
    return Subject(phenotype, one.surface.vertices, landmarks, areas, sternum, landmarks[:2], areas, usual)


@pytest.fixture(scope="module", autouse=True)
def stand_ins():
    """The cohort draws reference bodies while these tests run."""
    with pytest.MonkeyPatch.context() as patch:
        made = _workshop()
        patch.setattr(cohort, "workshop", lambda: made)
        patch.setattr(
            cohort, "draw_person", lambda seed, number: (_subject(number), Person(f"{number}", group_of(number).name))
        )
        yield
