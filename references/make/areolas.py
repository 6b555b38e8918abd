"""What skin shows by its colour: areolas and navels, and marks that could be taken for them.

None of it was measured on people; what is drawn (a to b: even; sizes in mm):

| what | distribution |
|---|---|
| radius of both areolas | women from 14 years 10 to 25, men 10 to 15; 4 to 13 years 6 to 12, under 4 years 6 to 9 |
| darker by (logarithm of green light) | 0.02 (nearly none) to 0.8 (strong); under 14 years half; sides 10 % apart |
| red light; blue light | 0.45 to 0.95 of it (redder, or only darker); 0.9 to 1.1 |
| rim; outline | 0.1 to 0.5 of the radius wide; up to 12 % from a circle |
| navel: radius; darker by | 5 to 9 times the body's size; 0 to 0.4, red 0.7 to 1 of it |
| flush: the skin's own redness | varies by up to 5 % over 40 to 150 mm |
| tone, blotches, moles, hair | as `draw_complexion` has them |
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from lubdub.geometry.surface import Surface
from references.make.paint import Complexion, Patch, Shadow
from references.make.phenotype import Phenotype

ADULT_YEARS, SMALL_YEARS = 14.0, 4.0
ADULT_MM = 150.0
"""Of a breastbone."""


def coloured(
    random: np.random.Generator, plain: Complexion, marks: np.ndarray, person: Phenotype, sternum_mm: float
) -> Complexion:
    """A skin with flush, navel and areolas. marks: (3, 3) navel, left and right nipple on the skin."""
    flush = random.normal(size=(12, 4)) * [0.04, 0.04, 0.04, 0.0] + [0.0, 0.0, 0.0, 1.0] * random.uniform(0, 7, (12, 1))
    navel = _patch(
        random,
        marks[0],
        random.uniform(5, 9) * min(1.0, sternum_mm / ADULT_MM),
        plain.tone * np.exp(-random.uniform(0.0, 0.4) * np.array([random.uniform(0.7, 1.0), 1.0, 1.0])),
    )
    darker = random.uniform(0.02, 0.8) * (0.5 if person.age_years < ADULT_YEARS else 1.0)
    shares = np.array([random.uniform(0.45, 0.95), 1.0, random.uniform(0.9, 1.1)])
    radius = random.uniform(*_radii(person))
    areolas = tuple(
        _patch(random, place, radius, plain.tone * np.exp(-darker * random.uniform(0.95, 1.05) * shares))
        for place in marks[1:]
    )
    return replace(
        plain, patches=(navel, *areolas), flush=np.column_stack([flush, np.full(12, random.uniform(0, 0.05))])
    )


def _radii(person: Phenotype) -> tuple[float, float]:
    if person.age_years < SMALL_YEARS:
        return 6.0, 9.0
    if person.age_years < ADULT_YEARS:
        return 6.0, 12.0
    return (10.0, 25.0) if person.sex == "female" else (10.0, 15.0)


def _patch(random: np.random.Generator, middle: np.ndarray, radius: float, tone: np.ndarray) -> Patch:
    return Patch(middle, radius, tone, random.uniform(0.1, 0.5), random.normal(size=(4, 3)))


def with_mole(random: np.random.Generator, plain: Complexion, skin: Surface) -> Complexion:
    """One large mole, 4 to 8 mm in radius, 20 to 60 mm from a nipple."""
    place = _beside(random, skin, plain.patches[random.integers(1, 3)].middle, 20.0, 60.0)
    tone = plain.tone * random.uniform(0.2, 0.5) * np.array([1.0, 0.8, 0.7])
    return replace(plain, patches=(*plain.patches, _patch(random, place, random.uniform(4, 8), tone)))


def with_plaster(random: np.random.Generator, plain: Complexion) -> Complexion:
    """A round plaster over one nipple and all its areola."""
    under = plain.patches[random.integers(1, 3)]
    tone = random.uniform(0.6, 0.9) * np.array([1.0, random.uniform(0.7, 0.95), random.uniform(0.5, 0.85)])
    plaster = Patch(under.middle, 1.2 * under.radius + 5.0, tone, 0.03, np.zeros((4, 3)))
    return replace(plain, patches=(*plain.patches, plaster))


def with_tattoo(random: np.random.Generator, plain: Complexion, skin: Surface) -> Complexion:
    """Dark, bluish blots of 3 to 8 mm in radius, near each other and near a nipple."""
    middle = _beside(random, skin, plain.patches[random.integers(1, 3)].middle, 30.0, 80.0)
    blots = tuple(
        _patch(
            random,
            _beside(random, skin, middle, 0.0, 25.0),
            random.uniform(3, 8),
            plain.tone * np.array([0.25, 0.3, 0.4]),
        )
        for _ in range(random.integers(4, 10))
    )
    return replace(plain, patches=(*plain.patches, *blots))


def with_shadow(random: np.random.Generator, plain: Complexion) -> Complexion:
    """A shadow over half of the body, its edge within 40 mm of a nipple."""
    place = plain.patches[random.integers(1, 3)].middle
    turn = random.uniform(0, 2 * np.pi)
    across = np.array([np.cos(turn), np.sin(turn), 0.0])
    return replace(
        plain,
        shadow=Shadow(
            place + random.uniform(-40, 40) * across, across, random.uniform(0.3, 0.7), random.uniform(2, 15)
        ),
    )


def _beside(
    random: np.random.Generator, skin: Surface, place: np.ndarray, nearest: float, farthest: float
) -> np.ndarray:
    """(3,) a vertex of the skin at such a distance."""
    near = np.array(cKDTree(skin.vertices).query_ball_point(place, farthest))
    far_enough = near[np.linalg.norm(skin.vertices[near] - place, axis=1) >= nearest]
    return np.asarray(skin.vertices[random.choice(np.sort(far_enough))])
