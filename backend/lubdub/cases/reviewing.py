"""What a review amounts to: clinicians' acts, read in order. Nothing here knows of the database."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any, Literal

from lubdub.cases.values import Actor
from lubdub.results import AREA_NAMES, AreaName, LandmarkName

Deed = Literal["look", "move", "undo", "landmarks", "sign", "return", "unusable"]
DECISIONS: tuple[Deed, ...] = ("sign", "return", "unusable")
Position = tuple[float, float, float]
"""A place on the scan's skin, in the file's own coordinates and unit."""


@dataclass(frozen=True)
class Reviewer:
    """A clinician at work. name: as it is shown beside a signature, and kept with it."""

    actor: Actor
    name: str


@dataclass(frozen=True)
class ReviewStep:
    """One act. said: area or landmark, and position, of a move; the same without position of a look or undo; reason
    and note of a decision."""

    number: int
    run: str
    deed: Deed
    by: str
    by_name: str
    at: datetime
    said: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Correction:
    """Where a clinician moved an area or landmark to, who, and when."""

    position: Position
    by_name: str
    at: datetime


@dataclass(frozen=True)
class Review:
    """How the review of one run's result stands.

    version: the number of the case's last step; who wants to go on must know it. corrected: the areas that were
    moved; landmarks: those that were moved and wait for a new run; seen: who saw which areas as they are now.
    last_move: what an undo would take back. decision: how it ended, None while it goes on.
    """

    version: int = 0
    corrected: Mapping[AreaName, Correction] = field(default_factory=dict)
    landmarks: Mapping[LandmarkName, Correction] = field(default_factory=dict)
    seen: Mapping[str, frozenset[AreaName]] = field(default_factory=dict)
    last_move: Mapping[str, str] | None = None
    decision: ReviewStep | None = None
    steps: tuple[ReviewStep, ...] = ()

    def unseen_by(self, actor: Actor) -> tuple[AreaName, ...]:
        """The areas this clinician has neither looked at nor moved since they were last moved."""
        seen = self.seen.get(actor.name, frozenset())
        return tuple(name for name in AREA_NAMES if name not in seen)


def review_of(steps: Iterable[ReviewStep], run: str | None) -> Review:
    """The review of one run, from all steps of its case in order. Steps of earlier runs only count for the version."""
    known = list(steps)
    own = [step for step in known if step.run == run]
    moves = _standing_moves(own)
    return Review(
        version=known[-1].number if known else 0,
        corrected={step.said["area"]: _correction(step) for step in moves if "area" in step.said},
        landmarks={step.said["landmark"]: _correction(step) for step in moves if "landmark" in step.said},
        seen=_seen(own),
        last_move=_subject(moves[-1]) if moves else None,
        decision=next((step for step in reversed(own) if step.deed in DECISIONS), None),
        steps=tuple(own),
    )


def _standing_moves(steps: Iterable[ReviewStep]) -> list[ReviewStep]:
    """The moves that no undo took back, oldest first."""
    moves: list[ReviewStep] = []
    for step in steps:
        if step.deed == "move":
            moves.append(step)
        elif step.deed == "undo":
            moves.pop()
    return moves


def _seen(steps: Iterable[ReviewStep]) -> dict[str, frozenset[AreaName]]:
    """Who saw which areas as they are now: whoever else saw one before it was moved must look again."""
    seen: dict[str, set[AreaName]] = {}
    for step in steps:
        if "area" not in step.said:
            continue
        name: AreaName = step.said["area"]
        if step.deed in ("move", "undo"):
            for others in seen.values():
                others.discard(name)
        seen.setdefault(step.by, set()).add(name)
    return {by: frozenset(names) for by, names in seen.items()}


def _subject(step: ReviewStep) -> Mapping[str, str]:
    return {what: step.said[what] for what in ("area", "landmark") if what in step.said}


def _correction(step: ReviewStep) -> Correction:
    x, y, z = (float(value) for value in step.said["position"])
    return Correction((x, y, z), step.by_name, step.at)
