"""The live views of this process: one per open case, in step with the points stored for it.

Nothing lives only here: the points are stored with the case at each change, and a view that was stopped is
built again from them.
"""

from __future__ import annotations

import asyncio
import hashlib
import threading
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from lubdub.cases.errors import FileNotFound
from lubdub.cases.files import FileVault
from lubdub.report.archive import examination_from_bytes
from lubdub.results import LANDMARK_NAMES, Examination, Landmark, LandmarkName
from lubdub.views.placing import PlacingView
from lubdub.views.scene import Sides
from lubdub.views.servers import LiveServer, OpenView, ViewRegistry
from lubdub.views.turning import turned
from lubdub.web.pages_marks import Marks

REAP_EVERY_S = 60.0
PLACED_SPREAD_MM = 5.0
"""Shown with a placed point; the pipeline has its own numbers."""


@dataclass
class Showing:
    """What is shown of a case: its view, the examination it was drawn from, and how the picture is turned."""

    view: PlacingView
    examination: Examination
    sha256: str
    sides: Sides
    turns: tuple[str, ...] = ()
    lock: threading.Lock = field(default_factory=threading.Lock)


class ViewDesk:
    """Opens views, stores what is placed in them, and counts changes so that pages can follow."""

    def __init__(self, files: FileVault) -> None:
        """Over the open vault."""
        self._files = files
        self._registry: ViewRegistry[Showing] = ViewRegistry()
        self._versions: dict[str, int] = {}
        self._windows: Counter[tuple[str, str]] = Counter()
        self._lock = threading.Lock()

    def open(self, case_id: str, sides: Sides) -> OpenView[Showing]:
        """The case's view, built if need be. Raises FileNotFound before the scan is checked, ViewsFull.

        sides: the words on its plates. A view somebody looks at keeps those it was built with.
        """
        data = self._files.read(case_id, "examination.npz")
        sha256 = hashlib.sha256(data).hexdigest()
        running = self._registry.get(case_id)
        if running is not None:
            is_other = running.content.sides != sides and running.watchers == 0
            if is_other or running.content.sha256 != sha256:
                self._registry.close(case_id)
        return self._registry.open(case_id, lambda server: self._build(case_id, server, data, sha256, sides))

    def running(self, case_id: str) -> OpenView[Showing] | None:
        """The case's view if it is open."""
        return self._registry.get(case_id)

    def examination(self, case_id: str) -> Examination:
        """What the check of the scan found. Raises FileNotFound."""
        running = self._registry.get(case_id)
        if running is not None:
            return running.content.examination
        return examination_from_bytes(self._files.read(case_id, "examination.npz"))

    def marks(self, case_id: str) -> Marks:
        """What was said so far."""
        try:
            return Marks.from_bytes(self._files.read(case_id, "marks.json"))
        except FileNotFound:
            return Marks()

    def change(self, case_id: str, how: Callable[[Marks], Marks]) -> Marks:
        """Change what was said, store it, show it, and tell the pages."""
        with self._lock:
            marks = how(self.marks(case_id))
            self._files.put(case_id, "marks.json", marks.to_bytes())
            self._versions[case_id] = self.version(case_id) + 1
        running = self._registry.get(case_id)
        if running is not None:
            self._follow(running.content, marks)
        return marks

    def _follow(self, showing: Showing, marks: Marks) -> None:
        with showing.lock:
            if showing.turns != marks.turns:
                showing.turns = marks.turns
                showing.view.turn_to(turned(showing.examination.scan, marks.turns))
            self._show(showing.view, showing.examination, marks)

    def version(self, case_id: str) -> int:
        """Goes up with every change."""
        return self._versions.get(case_id, 0)

    def is_watched(self, case_id: str, window: str = "") -> bool:
        """Whether a browser, or this very window of one, is attached to the case's view."""
        running = self._registry.get(case_id)
        if running is None or running.watchers == 0:
            return False
        return not window or self._windows[case_id, window] > 0

    def watched(self, case_id: str, change: int, window: str = "") -> None:
        """A browser's window came or went."""
        with self._lock:
            self._windows[case_id, window] += change
            if self._windows[case_id, window] <= 0:
                del self._windows[case_id, window]
        self._registry.watched(case_id, change)

    def close(self, case_id: str) -> None:
        """Stop the case's view. Off the event loop only."""
        self._registry.close(case_id)
        self._versions.pop(case_id, None)

    def close_all(self) -> None:
        """Stop every view. Off the event loop only."""
        self._registry.close_all()

    async def reap_for_ever(self) -> None:
        """Stop views nobody looks at, until cancelled."""
        while True:
            await asyncio.sleep(REAP_EVERY_S)
            await asyncio.to_thread(self._registry.reap)

    def _build(self, case_id: str, server: LiveServer, data: bytes, sha256: str, sides: Sides) -> Showing:
        examination = examination_from_bytes(data)
        marks = self.marks(case_id)

        def placed(name: LandmarkName, position: np.ndarray) -> None:
            in_file = view.scan.body_from_file.inverse().apply(position).tolist()
            self.change(case_id, lambda marks: marks.with_placed(name, in_file))

        # Known points frame the picture better than guesses; without guesses nobody knows which way they lie.
        is_clear = len(examination.suggested) == len(LANDMARK_NAMES)
        framing = shown_points(examination, marks) if is_clear else {}
        view = PlacingView(server, turned(examination.scan, marks.turns), framing, placed, sides)
        self._show(view, examination, marks)
        return Showing(view, examination, sha256, sides, marks.turns)

    def _show(self, view: PlacingView, examination: Examination, marks: Marks) -> None:
        is_name = marks.sides_confirmed and marks.target in LANDMARK_NAMES
        view.target = marks.target if is_name else None  # type: ignore[assignment]
        shown = replace(examination, scan=view.scan)
        view.show(shown_points(shown, marks) if marks.sides_confirmed else {})


def shown_points(examination: Examination, marks: Marks) -> Mapping[LandmarkName, Landmark]:
    """The pins: placed points, and suggestions that were not skipped."""
    shown = {name: mark for name, mark in examination.suggested.items() if name not in marks.skipped}
    for name, place in marks.placed.items():
        position = examination.scan.body_from_file.apply(np.asarray(place, float))
        shown[name] = Landmark(position, "given", PLACED_SPREAD_MM)  # type: ignore[index]
    return shown
