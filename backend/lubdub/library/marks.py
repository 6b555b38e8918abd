"""Areas that clinicians marked on reference bodies, nobody seeing another's: files beside one's own bodies.

When two have handed in theirs, the body's areas are half-way between them, and how far they lie apart is their spread.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from lubdub.geometry.anchors import anchored
from lubdub.results import AREA_NAMES, AreaName, Reference

FOLDER = "marks"
MARKERS = 2
"""So many mark a body, each by themselves."""
STEPS_KEPT = 200


@dataclass(frozen=True)
class Step:
    """An area was put at place (3,), mm, in the body's own frame."""

    area: AreaName
    place: np.ndarray


@dataclass(frozen=True)
class AreaMarks:
    """What one person has marked on one body.

    body, body_sha256: its id and shape; by: the person's id; tenant: their organisation's; version: goes up with every
    change; handed_in_at: ISO time, empty while they are at work.
    """

    body: str
    body_sha256: str
    by: str
    by_name: str
    tenant: str
    steps: tuple[Step, ...] = ()
    version: int = 0
    handed_in_at: str = ""

    @property
    def areas(self) -> dict[AreaName, np.ndarray]:
        """Where each area was put last, in listening order."""
        last = {step.area: step.place for step in self.steps}
        return {name: last[name] for name in AREA_NAMES if name in last}

    def with_step(self, area: AreaName, place: np.ndarray) -> AreaMarks:
        """The area put there. Steps too old to be taken back are forgotten, but not where they led."""
        old, kept = self.steps[: -STEPS_KEPT + 1], self.steps[-STEPS_KEPT + 1 :]
        led_to = {step.area: step for step in old}.values()
        return replace(self, steps=(*led_to, *kept, Step(area, place)), version=self.version + 1)

    def without_last(self) -> AreaMarks:
        """The last step taken back."""
        return replace(self, steps=self.steps[:-1], version=self.version + 1)

    def fits(self, card: Mapping[str, Any]) -> bool:
        """Whether this very shape was marked; a body made anew must be marked anew."""
        return self.body_sha256 == card["sha256"]


@dataclass(frozen=True)
class Agreement:
    """What two people's marks amount to. areas: name -> (3,) on the skin; spread_mm: how far the two lie apart."""

    areas: Mapping[AreaName, np.ndarray]
    spread_mm: Mapping[AreaName, float]
    names: tuple[str, ...]
    people: tuple[str, ...] = field(default=())


def read_marks(folder: Path | None, body: str = "*") -> list[AreaMarks]:
    """All marks on a body, or on all bodies. Raises ValueError or KeyError for a file that holds none."""
    if folder is None:
        return []
    return [_from_json(json.loads(path.read_text())) for path in sorted((folder / FOLDER).glob(f"{body}/*.json"))]


def write_marks(folder: Path, marks: AreaMarks) -> None:
    """Keep these, in place of what the same person marked on the same body before."""
    place = _place(folder, marks.body, marks.by)
    place.parent.mkdir(parents=True, exist_ok=True)
    put_text(place, json.dumps(_to_json(marks), indent=1) + "\n")


def drop_marks(folder: Path, body: str, by: str) -> bool:
    """Take somebody's marks on a body away; False when there are none."""
    place = _place(folder, body, by)
    if not place.is_file():
        return False
    place.unlink()
    return True


def agreement(reference: Reference, marks: Iterable[AreaMarks]) -> Agreement | None:
    """What the marks handed in on this body amount to; None before there are two of this very shape."""
    counted = [one for one in marks if one.handed_in_at and one.body == reference.id and one.fits(reference.card)]
    if len(counted) < MARKERS:
        return None
    counted = sorted(counted, key=lambda one: (one.handed_in_at, one.by))[:MARKERS]
    places = np.array([[one.areas[name] for name in AREA_NAMES] for one in counted])
    middles = anchored(reference.surface, places.mean(axis=0)).on(reference.surface.vertices)
    apart = np.linalg.norm(places[0] - places[1], axis=1)
    return Agreement(
        areas=dict(zip(AREA_NAMES, middles, strict=True)),
        spread_mm={name: float(far) for name, far in zip(AREA_NAMES, apart, strict=True)},
        names=tuple(one.by_name for one in counted),
        people=tuple(one.by for one in counted),
    )


def marked(reference: Reference, marks: Iterable[AreaMarks]) -> Reference:
    """The body with the areas that people agreed on, or as it was."""
    found = agreement(reference, marks)
    if found is None:
        return reference
    card = {**reference.card, "placed_by": " and ".join(found.names)}
    return replace(reference, areas=found.areas, spread_mm=found.spread_mm, card=card)


def put_text(path: Path, text: str) -> None:
    """Write a file so that whoever reads it meanwhile finds the old text or the new one, whole."""
    new = path.with_name(path.name + ".new")
    new.write_text(text)
    new.replace(path)


def _place(folder: Path, body: str, by: str) -> Path:
    if not all(name and name.replace("-", "").isalnum() for name in (body, by)):
        raise ValueError("There is no such body or person.")
    return folder / FOLDER / body / f"{by}.json"


def _to_json(marks: AreaMarks) -> dict[str, Any]:
    return {
        "body": marks.body,
        "body_sha256": marks.body_sha256,
        "by": marks.by,
        "by_name": marks.by_name,
        "tenant": marks.tenant,
        "version": marks.version,
        "handed_in_at": marks.handed_in_at,
        "steps": [{"area": step.area, "place": np.round(step.place, 3).tolist()} for step in marks.steps],
    }


def _from_json(said: dict[str, Any]) -> AreaMarks:
    steps = tuple(Step(step["area"], np.array(step["place"], float)) for step in said.pop("steps"))
    return AreaMarks(**said, steps=steps)
