"""The live views of this process: one per open case, in step with the points stored for it.

Nothing lives only here: the points are stored with the case at each change, by this process or another one, and a view
that was stopped is built again from them, here or elsewhere.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass, field, replace

import numpy as np

from lubdub.cases.database import Database
from lubdub.cases.errors import FileNotFound
from lubdub.cases.files import FileVault
from lubdub.cases.revising import revise
from lubdub.cases.snapshots import Snapshot, Snapshots
from lubdub.report.archive import examination_from_bytes
from lubdub.results import LANDMARK_NAMES, Examination, Landmark, LandmarkName
from lubdub.views.placing import PlacingView
from lubdub.views.scene import Sides
from lubdub.views.servers import LiveServer, OpenView
from lubdub.views.turning import turned
from lubdub.web.following import RegisteredViews
from lubdub.web.listeners import LastSeen
from lubdub.web.pages.marks import Marks

PLACED_SPREAD_MM = 5.0
"""Shown with a placed point; the pipeline has its own numbers."""


@dataclass
class Showing:
    """What is shown of a case: its view, the examination it was drawn from, and how the picture is turned."""

    view: PlacingView
    examination: Examination
    snapshot: Snapshot
    sides: Sides
    turns: tuple[str, ...] = ()
    lock: threading.Lock = field(default_factory=threading.Lock)


class ViewDesk(RegisteredViews[Showing]):
    """Opens views, stores what is placed in them, and knows of each change, so that pages can follow."""

    def __init__(self, files: FileVault, database: Database) -> None:
        """Over the open vault and database."""
        super().__init__()
        self._files = files
        self._database = database
        self._snapshots = Snapshots(database)
        self._last_seen: LastSeen[Snapshot] = LastSeen()

    def open(self, case_id: str, sides: Sides) -> OpenView[Showing]:
        """The case's view, built if need be. Raises FileNotFound before the scan is checked, ViewsFull.

        sides: the words on its plates. A view somebody looks at keeps those it was built with.
        """
        snapshot = self._snapshots.one(case_id)
        if snapshot is None:
            raise FileNotFound("the case is deleted")
        running = self._registry.get(case_id)
        if running is not None:
            is_other = running.content.sides != sides and running.watchers == 0
            if is_other or not _is_same_body(running.content.snapshot, snapshot):
                self._registry.close(case_id)
        return self._registry.open(case_id, lambda server: self._build(case_id, server, snapshot, sides))

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
        """Change what was said, store it, and show it; every process that shows or tells of the case follows."""

        def changed(stored: bytes | None) -> bytes:
            return how(Marks() if stored is None else Marks.from_bytes(stored)).to_bytes()

        marks = Marks.from_bytes(revise(self._database, self._files, case_id, "marks.json", changed))
        running = self._registry.get(case_id)
        if running is not None:
            self._show_marks(running.content, marks)
        return marks

    def snapshot(self, case_id: str) -> Snapshot | None:
        """How the case stands now; None when it is deleted."""
        return self._snapshots.one(case_id)

    def listening(
        self, case_id: str, snapshot: Snapshot | None
    ) -> AbstractContextManager[Callable[[], Snapshot | None]]:
        """While somebody is told of the case's changes: how it stood at the last look; None once it is deleted.

        snapshot: how it stands now.
        """
        return self._last_seen.listening(case_id, snapshot)

    def look_again(self) -> None:
        """Look once at every case that is shown or told of. Views of bodies that are gone, or somebody else's now, are
        stopped; the others show what is stored. Off the event loop only."""
        shown = self._registry.ids()
        listened = self._last_seen.listened()
        found = self._snapshots.of({*shown, *listened})
        self._last_seen.keep(listened, found)
        for case_id in shown:
            running, now = self._registry.get(case_id), found.get(case_id)
            if running is None:
                continue
            if now is None or not _is_same_body(running.content.snapshot, now):
                self.close(case_id)
            elif now.files.get("marks.json") != running.content.snapshot.files.get("marks.json"):
                running.content.snapshot = now
                self._show_marks(running.content, self.marks(case_id))

    def _show_marks(self, showing: Showing, marks: Marks) -> None:
        with showing.lock:
            if showing.turns != marks.turns:
                showing.turns = marks.turns
                showing.view.turn_to(turned(showing.examination.scan, marks.turns))
            self._show(showing.view, showing.examination, marks)

    def is_watched(self, case_id: str, window: str = "") -> bool:
        """Whether a browser, or this very window of one, is attached to the case's view."""
        return self._registry.is_watched(case_id, window)

    def watched(self, case_id: str, change: int, window: str = "") -> None:
        """A browser's window came or went."""
        self._registry.watched(case_id, change, window)

    def close(self, case_id: str) -> None:
        """Stop the case's view. Off the event loop only."""
        self._registry.close(case_id)

    def _build(self, case_id: str, server: LiveServer, snapshot: Snapshot, sides: Sides) -> Showing:
        examination = examination_from_bytes(self._files.read(case_id, "examination.npz"))
        marks = self.marks(case_id)

        def placed(name: LandmarkName, position: np.ndarray) -> None:
            in_file = view.scan.body_from_file.inverse().apply(position).tolist()
            self.change(case_id, lambda marks: marks.with_placed(name, in_file))

        # Known points frame the picture better than guesses; without guesses nobody knows which way they lie.
        is_clear = len(examination.suggested) == len(LANDMARK_NAMES)
        framing = shown_points(examination, marks) if is_clear else {}
        view = PlacingView(server, turned(examination.scan, marks.turns), framing, placed, sides)
        self._show(view, examination, marks)
        return Showing(view, examination, snapshot, sides, marks.turns)

    def _show(self, view: PlacingView, examination: Examination, marks: Marks) -> None:
        is_name = marks.sides_confirmed and marks.target in LANDMARK_NAMES
        view.target = marks.target if is_name else None  # type: ignore[assignment]
        shown = replace(examination, scan=view.scan)
        view.show(shown_points(shown, marks) if marks.sides_confirmed else {})


def _is_same_body(before: Snapshot, now: Snapshot) -> bool:
    """Whether a view may stay: the same family's, of the same scan."""
    what = "examination.npz"
    return (before.owner, before.files.get(what)) == (now.owner, now.files.get(what))


def shown_points(examination: Examination, marks: Marks) -> Mapping[LandmarkName, Landmark]:
    """The pins: placed points, and suggestions that were not skipped."""
    shown = {name: mark for name, mark in examination.suggested.items() if name not in marks.skipped}
    for name, place in marks.placed.items():
        position = examination.scan.body_from_file.apply(np.asarray(place, float))
        shown[name] = Landmark(position, "given", PLACED_SPREAD_MM)  # type: ignore[index]
    return shown
