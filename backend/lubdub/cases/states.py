"""A case's life: which state may follow which."""

from __future__ import annotations

from typing import Literal

Status = Literal[
    "awaiting_scan",
    "checking",
    "awaiting_landmarks",
    "queued",
    "running",
    "done",
    "in_review",
    "reviewed",
    "returned",
    "unusable",
    "refused",
    "failed",
    "deleted",
]
JobKind = Literal["check", "locate"]

IN_WORK: tuple[Status, ...] = ("checking", "queued", "running")
DECIDED: tuple[Status, ...] = ("reviewed", "returned", "unusable")
"""A clinician signed the places, gave the case back to be done again, or said that no places may be used."""
ENDED: tuple[Status, ...] = ("done", "in_review", *DECIDED, "refused", "failed", "deleted")
HAS_RESULT: tuple[Status, ...] = ("done", "in_review", "reviewed")
"""What was sent to the clinician stays as it was sent: only taking it back lets points or scan be changed again."""
TURNED_DOWN: tuple[Status, ...] = ("refused", "returned", "unusable")
"""No places are shown, and the case's reason says why."""

TAKES_SCAN: tuple[Status, ...] = ("awaiting_scan", "awaiting_landmarks", "done", "returned", "refused", "failed")
"""A new scan may replace an old one at any rest, so that a refused one can be made again."""

TAKES_LANDMARKS: tuple[Status, ...] = ("awaiting_landmarks", "done", "returned", "refused", "failed")
"""Landmarks may be corrected after a run; the check must have gone well once (the store looks for its file)."""

AFTER_CANCEL: dict[Status, Status] = {
    "checking": "awaiting_scan",
    "queued": "awaiting_landmarks",
    "running": "awaiting_landmarks",
}
