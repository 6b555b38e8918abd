"""Where the four areas lie on the chest, from anatomy tables: no clinician has placed these marks.

S is the length of the breastbone: from the suprasternal notch (the bone's upper edge, not the hollow above
it) to the xiphisternal joint (the lower end of its hard part). Distances run along the body and across it,
seen from the front, and are shares of S, so that they grow with the child.

Sources: a rib-by-rib skeleton measured at S = 158 mm and the ladder of intercostal spaces below the notch
(2nd space 58 mm, 4th 101 mm, 5th 120 mm for S about 145 mm), which agree within 10 mm. The apex: Antia 1978,
Arch Dis Child 53:585 (n = 353) and Oyinlade, Nigeria (n = 237): 4th space up to 3 years, then moving to the
5th; 5th space at the midclavicular line, 80-95 mm from the midline, in adults.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from lubdub.results import AreaName


@dataclass(frozen=True)
class Place:
    """A place and how far people differ from it, in shares of S.

    below: below the notch; left: to the patient's left of the midline; the spreads are one standard deviation.
    """

    below: float
    left: float
    spread_below: float
    spread_left: float


AORTIC = Place(0.40, -0.17, 0.03, 0.03)
"""2nd intercostal space at the right edge of the breastbone."""
PULMONARY = Place(0.40, 0.17, 0.03, 0.03)
"""2nd intercostal space at the left edge."""
TRICUSPID = Place(0.81, 0.22, 0.04, 0.03)
"""Left edge, between the 4th and 5th spaces, where the sources disagree by one space."""
MITRAL = Place(1.06, 0.54, 0.08, 0.06)
"""The apex from 7 years on: 5th space, midclavicular line."""
MITRAL_UNDER_FOUR = Place(0.90, 0.58, 0.08, 0.06)
"""The apex under 4 years: 4th space, at or just lateral to the midclavicular line, medial to the nipple line."""

APEX_AGES_YEARS = (4.0, 5.0, 6.0, 7.0)
APEX_STILL_HIGH = (0.92, 0.51, 0.14, 0.0)
"""Share of children whose apex is still in the 4th space at those ages (Oyinlade: 91.7, 51.3, 14.3 %)."""


def places(age_years: float) -> Mapping[AreaName, Place]:
    """The four places for somebody of this age."""
    high = still_high(age_years)
    return {
        "aortic": AORTIC,
        "pulmonary": PULMONARY,
        "tricuspid": TRICUSPID,
        "mitral": _blend(MITRAL_UNDER_FOUR, MITRAL, high),
    }


def still_high(age_years: float) -> float:
    """Share of children of this age whose apex is still in the 4th space."""
    return float(np.interp(age_years, APEX_AGES_YEARS, APEX_STILL_HIGH, left=1.0))


def _blend(first: Place, second: Place, share: float) -> Place:
    below = share * first.below + (1 - share) * second.below
    left = share * first.left + (1 - share) * second.left
    # Between the two ages a child has one apex or the other: the doubt is that of the mixture.
    doubt = share * (1 - share)
    return Place(
        below,
        left,
        float(np.hypot(second.spread_below, np.sqrt(doubt) * (second.below - first.below))),
        float(np.hypot(second.spread_left, np.sqrt(doubt) * (second.left - first.left))),
    )


STERNUM_AT_BIRTH_MM = 48.0
"""The formulas below start at one year and give 57-60 mm at birth, which would put the lower end on the belly; with
48 mm the apex lies 28 mm from the midline, as measured in newborns (Antia 1978)."""


def sternum_length_mm(age_years: float, sex: str | None) -> float:
    """Length of the breastbone to expect.

    Under 18 by age: 1,080 children by CT, doi 10.3892/etm.2022.11496 (R² 0.89, boys and girls). Adults: three
    measured skeletons 144-158 mm, women about 10 mm less.
    """
    if age_years < 1:
        return STERNUM_AT_BIRTH_MM + age_years * (_childs_sternum_mm(1.0, sex) - STERNUM_AT_BIRTH_MM)
    if age_years < 18:
        return _childs_sternum_mm(age_years, sex)
    return {"male": 155.0, "female": 143.0}.get(sex or "", 149.0)


def _childs_sternum_mm(age_years: float, sex: str | None) -> float:
    boys = 5.616 * age_years + 60.408
    girls = -0.134 * age_years**2 + 6.543 * age_years + 56.805
    return {"male": boys, "female": girls}.get(sex or "", (boys + girls) / 2)


def age_from_sternum(length_mm: float) -> float:
    """The age whose boys have this breastbone, for when nobody said the age; 18 for adult lengths."""
    return float(np.clip((length_mm - 60.408) / 5.616, 0.0, 18.0))
