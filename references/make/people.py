"""The reference bodies: who they are. Every one lies on the back, arms a little out, with a breath let out."""

from __future__ import annotations

from dataclasses import dataclass, replace

from references.make.phenotype import Phenotype, Sex, median_stature


@dataclass(frozen=True)
class Person:
    """id: the folder's name; build: words for the card."""

    id: str
    build: str
    phenotype: Phenotype


BELLY = {"torso/measure-waist-circ": 0.8, "torso/torso-scale-depth": 0.35}


def _person(
    age: float, sex: Sex, name: str, build: str, tall: float = 1.0, belly: float = 0.0, **parts: float
) -> Person:
    stature = round(median_stature(age, sex) * tall)
    modifiers = {part: value * belly for part, value in BELLY.items()} if belly else {}
    recipe = replace(Phenotype(age, sex, float(stature), modifiers=modifiers), **parts)  # type: ignore[arg-type]
    return Person(name, build, recipe)


PEOPLE: tuple[Person, ...] = (
    _person(0.0, "female", "newborn-girl", "newborn at term, average"),
    _person(0.0, "male", "newborn-boy-small", "newborn, small and thin", 0.94, weight=0.2),
    _person(0.75, "male", "infant-boy-09m", "9 months, average"),
    _person(0.75, "female", "infant-girl-09m-chubby", "9 months, chubby", weight=0.85),
    _person(2.0, "female", "girl-02", "2 years, average"),
    _person(2.0, "male", "boy-02-thin", "2 years, thin", weight=0.15),
    _person(4.0, "male", "boy-04", "4 years, average"),
    _person(4.0, "female", "girl-04-chubby", "4 years, chubby", weight=0.85),
    _person(6.0, "female", "girl-06", "6 years, average"),
    _person(6.0, "male", "boy-06-thin", "6 years, thin", weight=0.15),
    _person(8.0, "male", "boy-08", "8 years, average"),
    _person(8.0, "female", "girl-08-heavy", "8 years, heavy", weight=1.15),
    _person(10.0, "female", "girl-10", "10 years, average"),
    _person(10.0, "male", "boy-10-heavy", "10 years, heavy", weight=1.2),
    _person(12.0, "male", "boy-12", "12 years, average"),
    _person(12.0, "female", "girl-12-thin", "12 years, thin, small breasts", weight=0.2, cup=0.2),
    _person(14.0, "female", "girl-14", "14 years, average, middle breasts", cup=0.45),
    _person(14.0, "male", "boy-14-tall", "14 years, tall and thin", 1.06, weight=0.25, height=0.58),
    _person(25.0, "male", "man-25", "average"),
    _person(30.0, "male", "man-30-thin", "thin", weight=0.1, muscle=0.35),
    _person(28.0, "male", "man-28-muscular", "tall and muscular", 1.07, muscle=0.95, height=0.6),
    _person(35.0, "male", "man-35-small", "small", 0.91, height=0.38),
    _person(45.0, "male", "man-45-heavy", "heavy, large belly", belly=1.0, weight=1.25),
    _person(60.0, "male", "man-60-heavy-tall", "tall and heavy", 1.05, 0.6, weight=1.0, height=0.57),
    _person(75.0, "male", "man-75", "average, old", 0.98, muscle=0.3),
    _person(25.0, "female", "woman-25-small-breasts", "average, small breasts", cup=0.1),
    _person(30.0, "female", "woman-30", "average, middle breasts"),
    _person(33.0, "female", "woman-33-large-breasts", "average, large breasts", cup=0.9, firmness=0.45),
    _person(28.0, "female", "woman-28-thin", "thin, small breasts", weight=0.1, cup=0.2),
    _person(
        26.0, "female", "woman-26-muscular", "tall and muscular, small breasts", 1.07, muscle=0.9, height=0.6, cup=0.25
    ),
    _person(50.0, "female", "woman-50-heavy", "heavy, large breasts", belly=0.6, weight=1.2, cup=0.8, firmness=0.3),
    _person(40.0, "female", "woman-40-small", "small, middle breasts", 0.91, height=0.38, cup=0.45),
    _person(74.0, "female", "woman-74", "average, old, middle breasts", 0.97, cup=0.5, firmness=0.15),
    _person(
        78.0,
        "female",
        "woman-78-thin",
        "thin, old, small breasts",
        0.96,
        weight=0.15,
        muscle=0.25,
        cup=0.2,
        firmness=0.1,
    ),
)
