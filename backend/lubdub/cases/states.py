"""A case's life: which state may follow which."""

from __future__ import annotations

from typing import Literal

Status = Literal[
    "awaiting_scan", "checking", "awaiting_landmarks", "queued", "running", "done", "refused", "failed", "deleted"
]
JobKind = Literal["check", "locate"]

IN_WORK: tuple[Status, ...] = ("checking", "queued", "running")
ENDED: tuple[Status, ...] = ("done", "refused", "failed", "deleted")

TAKES_SCAN: tuple[Status, ...] = ("awaiting_scan", "awaiting_landmarks", "done", "refused", "failed")
"""A new scan may replace an old one at any rest, so that a refused one can be made again."""

TAKES_LANDMARKS: tuple[Status, ...] = ("awaiting_landmarks", "done", "refused", "failed")
"""Landmarks may be corrected after a run; the check must have gone well once (the store looks for its file)."""

AFTER_CANCEL: dict[Status, Status] = {
    "checking": "awaiting_scan",
    "queued": "awaiting_landmarks",
    "running": "awaiting_landmarks",
}
