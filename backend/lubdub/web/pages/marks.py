"""What a person has said on the pages about one scan: the sides are right, these points lie here, skip those."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any

from lubdub.results import LANDMARK_NAMES, LandmarkName
from lubdub.views.turning import Turn

MOST_UNDONE = 30
MOST_TURNS = 60


@dataclass(frozen=True)
class Marks:
    """placed: name -> [x, y, z] in the file's own coordinates; stuck: those of them that stickers marked, until they
    are moved; kept: suggestions left as they are; past: what undo goes back to, oldest first; is_taught: the two
    bones were explained; turns: how a picture whose lie is unclear was turned, oldest first."""

    sides_confirmed: bool = False
    placed: Mapping[str, list[float]] = field(default_factory=dict)
    kept: tuple[str, ...] = ()
    skipped: tuple[str, ...] = ()
    target: str | None = None
    past: tuple[Mapping[str, Any], ...] = ()
    stuck: tuple[str, ...] = ()
    is_taught: bool = False
    turns: tuple[str, ...] = ()

    def confirmed(self, asked: tuple[LandmarkName, ...], stuck: Mapping[str, list[float]] | None = None) -> Marks:
        """The sides are right; the first point that is not known yet is asked for.

        stuck: what stickers mark, name -> [x, y, z]; what was already said about a point stays.
        """
        new = {name: place for name, place in (stuck or {}).items() if not self.is_answered(name)}
        marks = replace(self, sides_confirmed=True, placed={**self.placed, **new}, stuck=(*self.stuck, *new))
        return replace(marks, target=self.target or marks._open(asked))

    def with_known(self, placed: Mapping[str, list[float]]) -> Marks:
        """Points that are known from elsewhere; they can still be moved."""
        return replace(self, placed=dict(placed))

    def taught(self) -> Marks:
        """What to feel for was shown."""
        return replace(self, is_taught=True)

    def turned(self, way: Turn) -> Marks:
        """The picture a quarter further round, one of four to each way."""
        turns = (*self.turns, way)
        if turns[-4:] == (way,) * 4:
            turns = turns[:-4]
        return replace(self, turns=turns[-MOST_TURNS:])

    def with_placed(self, name: LandmarkName, position: list[float]) -> Marks:
        """A point put somewhere, or moved. It stays the target, so that the next tap corrects it."""
        clear = self._remembering()._without(name)
        return replace(clear, placed={**clear.placed, name: position}, target=name)

    def keeping(self, asked: tuple[LandmarkName, ...]) -> Marks:
        """The suggestion for the target is left as it is; on to the next point."""
        if self.target is None:
            return self
        clear = self._remembering()._without(self.target)
        return replace(clear, kept=(*clear.kept, self.target)).onward(asked)

    def skipping(self, asked: tuple[LandmarkName, ...]) -> Marks:
        """The target is left out; on to the next point."""
        if self.target is None:
            return self
        clear = self._remembering()._without(self.target)
        return replace(clear, skipped=(*clear.skipped, self.target)).onward(asked)

    def onward(self, asked: tuple[LandmarkName, ...]) -> Marks:
        """On to the next unanswered point."""
        return replace(self, target=self._open(asked))

    def choosing(self, name: LandmarkName) -> Marks:
        """The next tap is for this point; one that was left out or kept is open again."""
        return replace(self._without(name), placed=self.placed, stuck=self.stuck, target=name)

    def undone(self) -> Marks:
        """One step back."""
        if not self.past:
            return self
        last = self.past[-1]
        return replace(
            self,
            placed=last["placed"],
            kept=tuple(last["kept"]),
            skipped=tuple(last["skipped"]),
            stuck=tuple(last.get("stuck", ())),
            target=last["target"],
            past=self.past[:-1],
        )

    def is_answered(self, name: str) -> bool:
        """Whether something was said about the point."""
        return name in self.placed or name in self.kept or name in self.skipped

    def to_bytes(self) -> bytes:
        """As stored."""
        return json.dumps(asdict(self)).encode()

    @staticmethod
    def from_bytes(data: bytes) -> Marks:
        """As it was stored."""
        said = json.loads(data)
        for name in ("kept", "skipped", "past", "stuck", "turns"):
            said[name] = tuple(said.get(name, ()))
        return Marks(**said)

    def _open(self, asked: tuple[LandmarkName, ...]) -> str | None:
        return next((name for name in asked if not self.is_answered(name)), None)

    def _without(self, name: str) -> Marks:
        return replace(
            self,
            placed={one: place for one, place in self.placed.items() if one != name},
            stuck=tuple(one for one in self.stuck if one != name),
            kept=tuple(one for one in self.kept if one != name),
            skipped=tuple(one for one in self.skipped if one != name),
        )

    def _remembering(self) -> Marks:
        now = {
            "placed": dict(self.placed),
            "kept": list(self.kept),
            "skipped": list(self.skipped),
            "stuck": list(self.stuck),
            "target": self.target,
        }
        return replace(self, past=(*self.past, now)[-MOST_UNDONE:])


def asked_points(sex: str | None, age_years: float | None, puberty_years: float) -> tuple[LandmarkName, ...]:
    """Which points are asked for, bones first. Nipples are not asked of women past puberty: they slide on the ribs."""
    if sex == "female" and (age_years is None or age_years >= puberty_years):
        return ("suprasternal_notch", "xiphisternum", "navel")
    return LANDMARK_NAMES
