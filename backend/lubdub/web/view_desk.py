"""The live views of this process: one per open case, in step with the points stored for it.

Nothing lives only here: the points are stored with the case at each change, and a view that was stopped is
built again from them.
"""

from __future__ import annotations

import asyncio
import hashlib
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from lubdub.cases.errors import FileNotFound
from lubdub.cases.files import FileVault
from lubdub.report.archive import examination_from_bytes
from lubdub.results import LANDMARK_NAMES, Examination, Landmark, LandmarkName
from lubdub.views.placing import PlacingView
from lubdub.views.servers import LiveServer, OpenView, ViewRegistry
from lubdub.web.pages_marks import Marks

REAP_EVERY_S = 60.0
PLACED_SPREAD_MM = 5.0
"""Shown with a placed point; the pipeline has its own numbers."""


@dataclass(frozen=True)
class Showing:
    """What is shown of a case: its view and the examination it was drawn from."""

    view: PlacingView
    examination: Examination
    sha256: str


class ViewDesk:
    """Opens views, stores what is placed in them, and counts changes so that pages can follow."""

    def __init__(self, files: FileVault) -> None:
        """Over the open vault."""
        self._files = files
        self._registry: ViewRegistry[Showing] = ViewRegistry()
        self._versions: dict[str, int] = {}
        self._lock = threading.Lock()

    def open(self, case_id: str) -> OpenView[Showing]:
        """The case's view, built if need be. Raises FileNotFound before the scan is checked, ViewsFull."""
        data = self._files.read(case_id, "examination.npz")
        sha256 = hashlib.sha256(data).hexdigest()
        running = self._registry.get(case_id)
        if running is not None and running.content.sha256 != sha256:
            self._registry.close(case_id)
        return self._registry.open(case_id, lambda server: self._build(case_id, server, data, sha256))

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
            self._show(running.content.view, running.content.examination, marks)
        return marks

    def version(self, case_id: str) -> int:
        """Goes up with every change."""
        return self._versions.get(case_id, 0)

    def is_watched(self, case_id: str) -> bool:
        """Whether a browser is attached to the case's view."""
        running = self._registry.get(case_id)
        return running is not None and running.watchers > 0

    def watched(self, case_id: str, change: int) -> None:
        """A browser came or went."""
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

    def _build(self, case_id: str, server: LiveServer, data: bytes, sha256: str) -> Showing:
        examination = examination_from_bytes(data)

        def placed(name: LandmarkName, position: np.ndarray) -> None:
            in_file = examination.scan.body_from_file.inverse().apply(position).tolist()
            self.change(case_id, lambda marks: marks.with_placed(name, in_file))

        view = PlacingView(server, examination.scan, examination.suggested, placed)
        self._show(view, examination, self.marks(case_id))
        return Showing(view, examination, sha256)

    def _show(self, view: PlacingView, examination: Examination, marks: Marks) -> None:
        is_name = marks.sides_confirmed and marks.target in LANDMARK_NAMES
        view.target = marks.target if is_name else None  # type: ignore[assignment]
        view.show(shown_points(examination, marks) if marks.sides_confirmed else {})


def shown_points(examination: Examination, marks: Marks) -> Mapping[LandmarkName, Landmark]:
    """The pins: placed points, and suggestions that were not skipped."""
    shown = {name: mark for name, mark in examination.suggested.items() if name not in marks.skipped}
    for name, place in marks.placed.items():
        position = examination.scan.body_from_file.apply(np.asarray(place, float))
        shown[name] = Landmark(position, "given", PLACED_SPREAD_MM)  # type: ignore[index]
    return shown
