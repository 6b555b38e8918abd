"""The live views of reference bodies that are marked: one for each body and clinician, in step with what is stored."""

from __future__ import annotations

import threading
from collections.abc import Collection
from contextlib import suppress
from dataclasses import dataclass, field

import numpy as np

from lubdub.cases.errors import BodyNotFound, StateConflict
from lubdub.cases.reviewing import Reviewer
from lubdub.geometry.frames import Similarity
from lubdub.geometry.raycast import SkinCaster
from lubdub.geometry.skin_walk import SkinWalker
from lubdub.jobs.reference_marks import AreaMarks, ReferenceMarks
from lubdub.results import Area, AreaName, CleanScan, Landmark, Reference, Unit
from lubdub.views.marking_areas import AreaMarkingView
from lubdub.views.scene import Sides, trunk_mm
from lubdub.views.servers import LiveServer, OpenView
from lubdub.web.clinician_views import ClinicianViews, key_of

MOST_MM = 40.0
"""One call moves an area no further than this."""
HANDLE_MM = 8.0
"""Radius of the disc by which a marked area is held; it stands for nothing."""
FIRST_DOWN = 0.35
"""An area that was not placed yet starts on the midline, so far down from notch to navel: the same for all four."""


@dataclass
class Body:
    """A reference body as a skin to mark."""

    scan: CleanScan
    landmarks: dict[str, Landmark]
    walker: SkinWalker

    @staticmethod
    def of(reference: Reference) -> Body:
        """Without its areas."""
        surface = reference.surface
        as_it_lies = Similarity(1.0, np.eye(3), np.zeros(3))
        rim = np.zeros(len(surface.vertices), bool)
        unit = Unit("mm", 1.0, "given")
        scan = CleanScan(surface.vertices, surface.normals, rim, lambda: surface, as_it_lies, unit)
        landmarks = {str(name): Landmark(place, "given", 5.0) for name, place in reference.landmarks.items()}
        return Body(scan, landmarks, SkinWalker(surface, surface.vertices, surface.normals))

    def areas(self, marks: AreaMarks) -> dict[AreaName, Area]:
        """The marks as areas to be drawn."""
        return {name: Area(place, self.walker.normal(place), HANDLE_MM, "") for name, place in marks.areas.items()}

    def nudged(self, marks: AreaMarks, name: AreaName, left_mm: float, up_mm: float) -> np.ndarray:
        """(3,) where an area lies so far along the skin from where it is, or from where unplaced ones start."""
        start = marks.areas.get(name)
        far = [float(np.clip(value, -MOST_MM, MOST_MM)) for value in (left_mm, up_mm)]
        return self.walker.walk(self._middle() if start is None else start, *far)

    def _middle(self) -> np.ndarray:
        down = FIRST_DOWN * trunk_mm(self.scan, self.landmarks)  # type: ignore[arg-type]
        before = np.array([0.0, -down, float(self.scan.points[:, 2].max()) + 100.0])
        met = SkinCaster(self.scan.display).hit(before, np.array([0.0, 0.0, -1.0]))
        return self.walker.nearest(before if met is None else met)


@dataclass
class Marking:
    """What one clinician has open of one body. version: of the marks as they are shown."""

    view: AreaMarkingView
    body: Body
    sides: Sides
    version: int = -1
    lock: threading.Lock = field(default_factory=threading.Lock)


class BodyViews(ClinicianViews[Marking]):
    """Opens views of bodies, and shows in each what its clinician has marked."""

    def __init__(self, marks: ReferenceMarks) -> None:
        super().__init__()
        self._marks = marks

    def open(self, name: str, by: Reviewer, sides: Sides) -> OpenView[Marking]:
        """The clinician's view of the body, built if need be. Raises BodyNotFound, ViewsFull."""
        reference, key = self._marks.body(by, name), key_of(name, by)
        running = self._registry.get(key)
        if running is not None and running.content.sides != sides:
            self._registry.close(key)
        return self._registry.open(key, lambda server: self._build(reference, by, server, sides))

    def follow(self, name: str, by: Reviewer) -> None:
        """Show the marks as they are now, if the clinician has the body open."""
        running = self.running(name, by)
        if running is not None:
            self._show(name, by, running.content)

    def take_in_hand(self, name: str, by: Reviewer, area: AreaName | None) -> None:
        """The next tap on the skin puts this area there; none when there is no area."""
        running = self.running(name, by)
        if running is not None:
            running.content.view.in_hand = area

    def look_at_all(self, name: str, by: Reviewer) -> None:
        """Turn the clinician's view to the whole chest."""
        running = self.running(name, by)
        if running is not None:
            running.content.view.look_at_all()

    def nudged(self, marks: AreaMarks, by: Reviewer, area: AreaName, left_mm: float, up_mm: float) -> np.ndarray:
        """(3,) on the body's skin, so far from where the area is. Raises BodyNotFound."""
        running = self.running(marks.body, by)
        body = Body.of(self._marks.body(by, marks.body)) if running is None else running.content.body
        return body.nudged(marks, area, left_mm, up_mm)

    def _living(self, subjects: set[str]) -> Collection[str]:
        return self._marks.names()

    def _build(self, reference: Reference, by: Reviewer, server: LiveServer, sides: Sides) -> Marking:
        body = Body.of(reference)

        def placed(area: AreaName, place: np.ndarray) -> None:
            with suppress(StateConflict, BodyNotFound):  # the picture then shows what counts
                self._marks.place(by, reference.id, marking.version, area, place)
            self._show(reference.id, by, marking)

        age = float(reference.card["age_years"])
        view = AreaMarkingView(server, body.scan, body.landmarks, placed, age, sides)  # type: ignore[arg-type]
        marking = Marking(view, body, sides)
        self._show(reference.id, by, marking)
        return marking

    def _show(self, name: str, by: Reviewer, marking: Marking) -> None:
        with marking.lock:
            marks = self._marks.mine(by, name)
            marking.view.show(marking.body.areas(marks))
            marking.version = marks.version
