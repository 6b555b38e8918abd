"""A scan's size in words, in the unit found and in the others it might have."""

from __future__ import annotations

from collections.abc import Callable

from lubdub.geometry.frames import MM_PER_UNIT
from lubdub.results import Examination

PLAUSIBLE_MM = (50.0, 1500.0)
"""Chests wider or narrower than this are not worth asking about: a newborn has 90 mm, the largest adult 600."""


class SizeWords:
    """What to ask about one examination. gettext: the page's language."""

    def __init__(self, examination: Examination, gettext: Callable[[str], str]) -> None:
        """Over what the check found."""
        self._size = examination.size
        self._unit = examination.scan.unit
        self._ = gettext

    @property
    def width_mm(self) -> float:
        """Breadth of the chest, or of all that was scanned when the chest was not told apart."""
        return float(self._size.get("chest_width_mm", self._size.get("width_mm", 0.0)))

    def question(self) -> str:
        """The size as a question."""
        _ = self._
        return _("The chest in this scan is {width} cm wide, and the scan is {length} cm long. Is that right?").format(
            width=cm(self.width_mm), length=cm(float(self._size.get("length_mm", 0.0)))
        )

    def others(self) -> list[tuple[str, str]]:
        """Unit -> words, for the units in which this could still be a chest."""
        _ = self._
        found = []
        for unit, mm_per_unit in MM_PER_UNIT.items():
            width = self.width_mm * mm_per_unit / self._unit.mm_per_unit
            if unit != self._unit.name and PLAUSIBLE_MM[0] <= width <= PLAUSIBLE_MM[1]:
                found.append((unit, _("No, it is about {width} cm wide").format(width=cm(width))))
        return found


def cm(mm: float) -> str:
    """Centimetres as people say them: 24, and 4.5 below ten."""
    value = mm / 10
    return f"{value:.0f}" if value >= 10 else f"{value:.1f}".removesuffix(".0")
