"""What a body is made from: age, sex, build; and how tall people are at an age."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Literal

import numpy as np

Sex = Literal["female", "male"]

ANCESTRIES = ("african", "asian", "caucasian")
EVEN_ANCESTRY = dict.fromkeys(ANCESTRIES, 1.0 / 3.0)

STATURE_YEARS = (0.0, 0.75, 1.0, 2.0, 3.0, 5.0, 8.0, 12.0, 15.0, 18.0)
STATURE_MM: dict[Sex, tuple[float, ...]] = {
    "male": (500, 715, 755, 875, 955, 1100, 1280, 1495, 1700, 1765),
    "female": (495, 700, 740, 865, 950, 1090, 1275, 1515, 1620, 1635),
}
"""Median stature by age: WHO growth standards and references (2006, 2007), rounded to 5 mm."""


def median_stature(age_years: float, sex: Sex) -> float:
    """Median stature in mm."""
    return float(np.interp(age_years, STATURE_YEARS, STATURE_MM[sex]))


@dataclass(frozen=True)
class Phenotype:
    """A recipe for one body. muscle to firmness run from 0 (least) to 1 (most), 0.5 is average; weight goes on to 1.3.

    arms_deg: how far (left, right) arm is lowered from MakeHuman's half-raised pose: 35 lies a little out.
    """

    age_years: float
    sex: Sex
    stature_mm: float
    muscle: float = 0.5
    weight: float = 0.5
    height: float = 0.5
    proportions: float = 0.5
    cup: float = 0.5
    firmness: float = 0.5
    arms_deg: tuple[float, float] = (35.0, 35.0)
    ancestry: Mapping[str, float] = field(default_factory=lambda: dict(EVEN_ANCESTRY))
    modifiers: Mapping[str, float] = field(default_factory=dict)

    @property
    def makehuman_age(self) -> float:
        """MakeHuman's age: 0 at 1 year, 0.1875 at 10, 0.5 at 25, 1 at 90; a newborn lies below 0."""
        years = self.age_years
        return (years - 1) / 48 if years < 25 else min(1.0, 0.5 + (years - 25) / 130)

    def to_json(self) -> dict[str, object]:
        """All parameters, rounded so that they can be typed in again."""
        return {name: _rounded(value) for name, value in asdict(self).items()}


def _rounded(value: object) -> object:
    if isinstance(value, float):
        return round(value, 4)
    if isinstance(value, dict):
        return {key: _rounded(part) for key, part in sorted(value.items())}
    return [_rounded(part) for part in value] if isinstance(value, tuple) else value


def draw_phenotype(random: np.random.Generator, age_years: float, sex: Sex) -> Phenotype:
    """A random person of this age and sex; cup only matters in women and girls near puberty."""
    parts = random.dirichlet([1.0, 1.0, 1.0])
    grown = sex == "female" and age_years >= 12
    tall = float(np.clip(random.normal(1.0, 0.045), 0.9, 1.1))
    return Phenotype(
        age_years=age_years,
        sex=sex,
        stature_mm=median_stature(age_years, sex) * tall,
        muscle=random.uniform(0.15, 0.85),
        weight=random.uniform(0.05, 1.25),
        height=float(np.clip(0.45 + 2.0 * (tall - 1.0), 0.3, 0.65)),
        proportions=random.uniform(0.1, 0.9),
        cup=random.uniform(0.0, 1.0) if grown else 0.5,
        firmness=random.uniform(0.0, 1.0) if grown else 0.5,
        ancestry=dict(zip(ANCESTRIES, (float(part) for part in parts), strict=True)),
    )
