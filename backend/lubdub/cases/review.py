"""A clinician's review of a result: each act one transaction, one row that is never changed, one audit line."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import Session

from lubdub.cases import audit
from lubdub.cases.clock import now
from lubdub.cases.database import Database
from lubdub.cases.errors import ReviewMoved, StateConflict
from lubdub.cases.files import OF_CHECK, OF_SCAN, FileVault, detach
from lubdub.cases.models import CaseRow
from lubdub.cases.models_review import ReviewStepRow
from lubdub.cases.review_reasons import RETURN_REASONS, UNUSABLE_REASONS
from lubdub.cases.reviewing import Deed, Position, Review, Reviewer, ReviewStep, review_of
from lubdub.cases.rows import Step, find, has_file, marks_of, new_job, take, to_value
from lubdub.cases.sealed_values import opened, sealed
from lubdub.cases.states import Status
from lubdub.cases.values import Actor, Case, Job
from lubdub.results import AREA_NAMES, LANDMARK_NAMES, AreaName, LandmarkName, Reason

LONGEST_NOTE = 600
CAN_RUN_AGAIN: tuple[Status, ...] = ("in_review", "refused")


@dataclass(frozen=True)
class Decision:
    """What ends a review without a signature. code: of the reasons' list; note: in the clinician's own words."""

    code: str
    note: str = ""


class Reviews:
    """The reviews. A call names the version it saw: raises ReviewMoved when somebody went on meanwhile,
    StateConflict when the case is not in review, CaseNotFound for cases of others."""

    def __init__(self, database: Database, vault: FileVault) -> None:
        """Over an open database and vault."""
        self._database = database
        self._vault = vault

    def read(self, actor: Actor, case_id: str) -> Review:
        """How the review of the case's present result stands."""
        with self._database.reading() as session:
            row = find(session, actor, case_id)
            return review_of(_steps(session, case_id), row.job_id)

    def look(self, by: Reviewer, case_id: str, version: int, area: AreaName) -> Review:
        """The clinician looked at an area."""
        return self._act(by, case_id, version, "look", {"area": _known(area, AREA_NAMES)})

    def move(self, by: Reviewer, case_id: str, version: int, area: AreaName, position: Position) -> Review:
        """The clinician put an area elsewhere. position: on the skin, in the file's coordinates and unit."""
        said = {"area": _known(area, AREA_NAMES), "position": [float(value) for value in position]}
        return self._act(by, case_id, version, "move", said)

    def move_landmark(self, by: Reviewer, case_id: str, version: int, name: LandmarkName, position: Position) -> Review:
        """The clinician put a landmark elsewhere; it counts from the next run on. position: as for areas."""
        said = {"landmark": _known(name, LANDMARK_NAMES), "position": [float(value) for value in position]}
        return self._act(by, case_id, version, "move", said)

    def undo(self, by: Reviewer, case_id: str, version: int) -> Review:
        """Take the last move back, whoever made it. Both stay in the record."""
        with self._database.writing() as session:
            row = self._open(session, by, case_id, version)
            last = review_of(_steps(session, case_id), row.job_id).last_move
            if last is None:
                raise StateConflict("There is no move to take back.")
            return self._note(session, row, by, "undo", dict(last))

    def sign(self, by: Reviewer, case_id: str, version: int) -> Case:
        """End the review with a signature. Raises StateConflict while an area was neither looked at nor moved."""
        with self._database.writing() as session:
            row = self._open(session, by, case_id, version)
            review = review_of(_steps(session, case_id), row.job_id)
            if review.landmarks:
                raise StateConflict("Landmarks were moved: run again, or undo, before you sign.")
            unseen = review.unseen_by(by.actor)
            if unseen:
                raise StateConflict(f"Look at every area before you sign: {', '.join(unseen)} still to come.")
            self._add(session, row, by, "sign", {})
            take(self._database, session, row, by.actor, Step("reviewed", "review.sign", fraction=1.0))
            return to_value(session, row)

    def give_back(self, by: Reviewer, case_id: str, version: int, decision: Decision) -> Case:
        """Return the case to the family, which can then scan or mark again. Raises ValueError for no such reason."""
        return self._decline(by, case_id, version, decision, "return", "returned", RETURN_REASONS)

    def mark_unusable(self, by: Reviewer, case_id: str, version: int, decision: Decision) -> Case:
        """No places of this case may be used. Raises ValueError for no such reason."""
        return self._decline(by, case_id, version, decision, "unusable", "unusable", UNUSABLE_REASONS)

    def run_again(self, by: Reviewer, case_id: str, version: int) -> tuple[Case, Job]:
        """Ask for a new run with the moved landmarks; its result comes back to the review.

        The landmarks before stay in the record. Raises StateConflict when none was moved.
        """
        with self._database.writing() as session:
            row = self._open(session, by, case_id, version, CAN_RUN_AGAIN)
            if not has_file(session, case_id, "examination.npz"):
                raise StateConflict("The scan was not examined yet.")
            moved = review_of(_steps(session, case_id), row.job_id).landmarks
            if not moved:
                raise StateConflict("Move a landmark first: with the same ones a run finds the same places.")
            before = marks_of(session, row) or {}
            placed: dict[str, Any] = dict(before)
            placed |= {name: list(one.position) for name, one in moved.items()}
            self._add(session, row, by, "landmarks", {"landmarks": placed, "before": before})
            dropped = detach(session, case_id, but=OF_SCAN + OF_CHECK)
            row.landmarks = sealed(session, case_id, placed)
            job = new_job(session, row, "locate")
            take(self._database, session, row, by.actor, Step("queued", "review.landmarks"))
            case = to_value(session, row)
        self._vault.discard(case_id, dropped)
        return case, job

    def _act(self, by: Reviewer, case_id: str, version: int, deed: Deed, said: dict[str, Any]) -> Review:
        with self._database.writing() as session:
            return self._note(session, self._open(session, by, case_id, version), by, deed, said)

    def _note(self, session: Session, row: CaseRow, by: Reviewer, deed: Deed, said: dict[str, Any]) -> Review:
        """Add a step that leaves the case in review, and its audit line; how the review stands then."""
        self._add(session, row, by, deed, said)
        about = said.get("area") or said.get("landmark") or ""
        audit.append(self._database, session, by.actor, f"review.{deed}", row.id, now(), about)
        return review_of(_steps(session, row.id), row.job_id)

    def _decline(
        self,
        by: Reviewer,
        case_id: str,
        version: int,
        decision: Decision,
        deed: Deed,
        status: Status,
        reasons: Mapping[str, Reason],
    ) -> Case:
        if decision.code not in reasons:
            raise ValueError(f"There is no such reason: choose one of {', '.join(reasons)}.")
        note = " ".join(decision.note.split())[:LONGEST_NOTE]
        with self._database.writing() as session:
            row = self._open(session, by, case_id, version)
            self._add(session, row, by, deed, {"reason": decision.code, "note": note})
            step = Step(status, f"review.{deed}", fraction=1.0, reason=reasons[decision.code].to_json())
            take(self._database, session, row, by.actor, step)
            return to_value(session, row)

    def _open(
        self,
        session: Session,
        by: Reviewer,
        case_id: str,
        version: int,
        states: tuple[Status, ...] = ("in_review",),
    ) -> CaseRow:
        """The case's row, locked, if the review goes on and is as the caller saw it."""
        row = find(session, by.actor, case_id, to_change=True)
        if row.status not in states or not row.is_sent:
            raise StateConflict(f"This case is not in review: it is {row.status.replace('_', ' ')}.")
        if version != _version(session, case_id):
            raise ReviewMoved("Somebody else went on with this review. Look at it as it is now, and do it again.")
        return row

    def _add(self, session: Session, row: CaseRow, by: Reviewer, deed: Deed, said: dict[str, Any]) -> None:
        session.add(
            ReviewStepRow(
                case_id=row.id,
                number=_version(session, row.id) + 1,
                run=row.job_id or "",
                deed=deed,
                by=by.actor.name,
                by_name=by.name,
                at=now(),
                said=sealed(session, row.id, said),
            )
        )
        session.flush()


def _version(session: Session, case_id: str) -> int:
    query = sa.select(sa.func.max(ReviewStepRow.number)).where(ReviewStepRow.case_id == case_id)
    return session.scalar(query) or 0


def _steps(session: Session, case_id: str) -> list[ReviewStep]:
    query = sa.select(ReviewStepRow).where(ReviewStepRow.case_id == case_id).order_by(ReviewStepRow.number)
    return [
        ReviewStep(
            row.number,
            row.run,
            row.deed,  # type: ignore[arg-type]
            row.by,
            row.by_name,
            row.at,
            opened(session, case_id, row.said),
        )
        for row in session.scalars(query)
    ]


def _known(name: str, names: tuple[str, ...]) -> str:
    if name not in names:
        raise ValueError(f"There is no place called {name!r}.")
    return name
