"""The live views of results in review: one for each case and clinician, in step with the review as it is stored.

Nothing lives only here but how a clinician looks at it: a view that was stopped is built again.
"""

from __future__ import annotations

import hashlib
import threading
from collections.abc import Collection
from contextlib import suppress
from dataclasses import dataclass, field, replace

import numpy as np

from lubdub.cases.errors import CaseNotFound, StateConflict
from lubdub.cases.files import FileVault
from lubdub.cases.review import Reviews
from lubdub.cases.reviewing import Position, Review, Reviewer
from lubdub.cases.snapshots import Snapshots
from lubdub.cases.values import Case
from lubdub.geometry.skin_walk import SkinWalker
from lubdub.report.archive import outcome_from_bytes
from lubdub.report.corrected import walker_on
from lubdub.results import AreaName, LandmarkName, Outcome
from lubdub.views.reviewing import Layer, ReviewView, Shown
from lubdub.views.scene import Sides
from lubdub.views.servers import LiveServer, OpenView
from lubdub.web.clinician_views import ClinicianViews, key_of
from lubdub.web.reviewed import with_corrections

MOST_MM = 40.0
"""One call moves an area no further than this."""


@dataclass
class Judging:
    """What one clinician has open of one case: the view, what it was drawn from, and how it is looked at."""

    view: ReviewView
    computed: Outcome
    walker: SkinWalker
    sha256: str
    sides: Sides
    version: int = -1
    layer: Layer = "skin"
    is_before: bool = False
    has_pins: bool = False
    lock: threading.Lock = field(default_factory=threading.Lock)


class ReviewViews(ClinicianViews[Judging]):
    """Opens views of results, and shows in each what the review says now."""

    def __init__(self, files: FileVault, reviews: Reviews, snapshots: Snapshots) -> None:
        """Over the open vault, the reviews, and how cases stand."""
        super().__init__()
        self._files = files
        self._reviews = reviews
        self._snapshots = snapshots

    def open(self, case: Case, by: Reviewer, sides: Sides) -> OpenView[Judging]:
        """The clinician's view of the case, built if need be. Raises FileNotFound without a result, ViewsFull."""
        data = self._files.read(case.id, "outcome.npz")
        sha256, key = hashlib.sha256(data).hexdigest(), key_of(case.id, by)
        running = self._registry.get(key)
        if running is not None and (running.content.sha256 != sha256 or running.content.sides != sides):
            self._registry.close(key)
        return self._registry.open(key, lambda server: self._build(case, by, server, data, sides))

    def follow(self, case_id: str, by: Reviewer) -> None:
        """Show the review as it is now, if the clinician has it open."""
        running = self.running(case_id, by)
        if running is not None:
            self._show(case_id, by, running.content)

    def look(self, case_id: str, by: Reviewer, name: AreaName | None) -> None:
        """Turn the clinician's view to an area; to the whole chest without a name."""
        running = self.running(case_id, by)
        if running is not None:
            judging = running.content
            review = self._reviews.read(by.actor, case_id)
            judging.view.look_at(name, with_corrections(judging.computed, review))

    def dress(
        self,
        case_id: str,
        by: Reviewer,
        layer: Layer | None = None,
        is_before: bool | None = None,
        has_pins: bool | None = None,
    ) -> None:
        """Change what the clinician's view shows; None leaves a thing as it is."""
        running = self.running(case_id, by)
        if running is None:
            return
        judging = running.content
        if layer in judging.view.layers:
            judging.layer = layer
        judging.is_before = judging.is_before if is_before is None else is_before
        judging.has_pins = judging.has_pins if has_pins is None else has_pins
        self._show(case_id, by, judging)

    def nudge(self, case: Case, by: Reviewer, name: AreaName | LandmarkName, left_mm: float, up_mm: float) -> Position:
        """Where an area or landmark lies, so far along the skin from where it is now. In the file's coordinates."""
        running = self.running(case.id, by)
        if running is None:
            computed = outcome_from_bytes(self._files.read(case.id, "outcome.npz"))
        else:
            computed = running.content.computed
        if computed.scan is None:
            raise StateConflict("There is no scan to move along.")
        walker = walker_on(computed.scan) if running is None else running.content.walker
        review = self._reviews.read(by.actor, case.id)
        shown = with_landmarks(with_corrections(computed, review), review)
        places: dict[str, np.ndarray] = {key: area.position for key, area in shown.areas.items()}
        places |= {key: mark.position for key, mark in shown.landmarks.items()}
        if name not in places:
            raise StateConflict("This place is not known on this body.")
        far = [float(np.clip(value, -MOST_MM, MOST_MM)) for value in (left_mm, up_mm)]
        return _in_file(computed, walker.walk(places[name], *far))

    def _living(self, subjects: set[str]) -> Collection[str]:
        return self._snapshots.of(subjects)

    def _build(self, case: Case, by: Reviewer, server: LiveServer, data: bytes, sides: Sides) -> Judging:
        computed = outcome_from_bytes(data)
        if computed.scan is None:
            raise StateConflict("There is no scan to show.")

        def area_moved(name: AreaName, place: np.ndarray) -> None:
            with suppress(StateConflict, CaseNotFound):  # the picture then shows what counts
                self._reviews.move(by, case.id, judging.version, name, _in_file(computed, place))
            self._show(case.id, by, judging)

        def landmark_moved(name: LandmarkName, place: np.ndarray) -> None:
            with suppress(StateConflict, CaseNotFound):
                self._reviews.move_landmark(by, case.id, judging.version, name, _in_file(computed, place))
            self._show(case.id, by, judging)

        view = ReviewView(server, computed, area_moved, landmark_moved, case.age_years, sides)
        judging = Judging(view, computed, walker_on(computed.scan), hashlib.sha256(data).hexdigest(), sides)
        self._show(case.id, by, judging)
        return judging

    def _show(self, case_id: str, by: Reviewer, judging: Judging) -> None:
        with judging.lock:
            review = self._reviews.read(by.actor, case_id)
            now = with_landmarks(with_corrections(judging.computed, review), review)
            judging.view.show(Shown(now, judging.layer, judging.is_before, judging.has_pins))
            judging.version = review.version


def with_landmarks(outcome: Outcome, review: Review) -> Outcome:
    """The outcome with the landmarks where clinicians put them, for showing: places are found anew by a run only."""
    if outcome.scan is None:
        return outcome
    moved = {
        name: replace(
            outcome.landmarks[name], position=outcome.scan.body_from_file.apply(np.array(one.position)), source="given"
        )
        for name, one in review.landmarks.items()
        if name in outcome.landmarks
    }
    return replace(outcome, landmarks={**outcome.landmarks, **moved})


def _in_file(outcome: Outcome, place: np.ndarray) -> Position:
    if outcome.scan is None:
        raise StateConflict("There is no scan.")
    x, y, z = (float(value) for value in outcome.scan.body_from_file.inverse().apply(place))
    return x, y, z
