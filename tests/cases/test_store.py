"""A case's life as people and portals see it, on every database."""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor

import pytest
import sqlalchemy as sa

from lubdub.cases.audit import first_broken_line
from lubdub.cases.database import Database
from lubdub.cases.errors import CaseNotFound, FileNotFound, IdempotencyMismatch, StateConflict
from lubdub.cases.models import AuditRow, IdempotencyRow
from lubdub.cases.screening import STOP_REASONS
from lubdub.cases.store import Asked, Repeatable
from lubdub.cases.values import Actor, Case
from lubdub.cases.work import Handed
from tests.cases.conftest import Room, girl_of_six

CHECKED = Handed("awaiting_landmarks", {"examination.npz": b"npz", "examination.json": b"{}", "scan.ply": b"ply"})
DONE = Handed("done", {"result.json": b"{}", "outcome.npz": b"npz"})


def with_scan(room: Room, actor: Actor) -> Case:
    case, _ = room.store.create(actor, girl_of_six())
    case, job = room.store.receive_scan(actor, case.id, room.vault.seal(case.id, "scan", b"skin"), None)
    assert room.desk.hand_in(job, CHECKED)
    return room.store.get(actor, case.id)


def test_a_case_goes_its_way_from_scan_to_result(room: Room) -> None:
    actor = room.portal()
    case, is_new = room.store.create(actor, girl_of_six(external_id="A-7"))
    assert (case.status, is_new, case.external_id) == ("awaiting_scan", True, "A-7")
    case, check = room.store.receive_scan(actor, case.id, room.vault.seal(case.id, "scan", b"skin"), "mm")
    assert (case.status, case.unit, case.has_scan) == ("checking", "mm", True)
    assert room.desk.hand_in(check, CHECKED)
    assert room.store.get(actor, case.id).status == "awaiting_landmarks"
    placed = Asked({"navel": [1.0, 2.0, 3.0]}, method="rule")
    case, locate = room.store.place_landmarks(actor, case.id, placed)
    assert (case.status, case.landmarks, case.method) == ("queued", {"navel": [1.0, 2.0, 3.0]}, "rule")
    taken = room.desk.take_up(locate)
    assert taken is not None
    assert taken.status == "running"
    room.desk.tell(locate, "fit", 0.5)
    assert room.desk.hand_in(locate, DONE)
    assert room.store.get(actor, case.id).status == "done"
    told = [(event.sequence, event.kind, event.data["status"]) for event in room.store.events_after(actor, case.id, 0)]
    assert told == [
        (1, "status", "awaiting_scan"),
        (2, "status", "checking"),
        (3, "status", "awaiting_landmarks"),
        (4, "status", "queued"),
        (5, "status", "running"),
        (6, "progress", "running"),
        (7, "status", "done"),
    ]
    assert [event.sequence for event in room.store.events_after(actor, case.id, 5)] == [6, 7]


@pytest.mark.parametrize("question", sorted(STOP_REASONS))
def test_a_stop_question_answered_yes_refuses_before_any_scan(room: Room, question: str) -> None:
    actor = room.family()
    case, _ = room.store.create(actor, girl_of_six(answers={question: "yes"}))
    assert case.status == "refused"
    assert case.reason is not None
    assert case.reason["code"] == question
    with pytest.raises(StateConflict):
        room.store.expect_scan(actor, case.id)


def test_unsure_answers_do_not_stop_a_case(room: Room) -> None:
    case, _ = room.store.create(room.family(), girl_of_six(answers=dict.fromkeys(STOP_REASONS, "unsure")))
    assert case.status == "awaiting_scan"


def test_other_tenants_and_other_sessions_find_no_case(room: Room) -> None:
    owner, same_clinic = room.portal("a"), room.portal("a")
    theirs, _ = room.store.create(owner, girl_of_six())
    mother, stranger = room.family(), room.family()
    hers, _ = room.store.create(mother, girl_of_six())
    assert room.store.get(same_clinic, theirs.id).id == theirs.id
    assert [case.id for case in room.store.list_cases(mother)] == [hers.id]
    for actor, case in ((room.portal("b"), theirs), (mother, theirs), (stranger, hers), (owner, hers)):
        with pytest.raises(CaseNotFound):
            room.store.get(actor, case.id)
        with pytest.raises(CaseNotFound):
            room.store.cancel(actor, case.id)
        with pytest.raises(CaseNotFound):
            room.privacy.delete(actor, case.id)


def test_an_idempotency_key_opens_one_case_and_minds_its_body(room: Room) -> None:
    actor = room.portal()
    first, is_new = room.store.create(actor, girl_of_six(), Repeatable("k", "body"))
    again, is_new_again = room.store.create(actor, girl_of_six(), Repeatable("k", "body"))
    assert (first.id, is_new, is_new_again) == (again.id, True, False)
    with pytest.raises(IdempotencyMismatch):
        room.store.create(actor, girl_of_six(), Repeatable("k", "other body"))
    other, _ = room.store.create(room.portal("b"), girl_of_six(), Repeatable("k", "body"))
    assert other.id != first.id


def test_the_same_call_made_many_times_at_once_opens_one_case(room: Room) -> None:
    actor, start = room.portal(), threading.Barrier(6)

    def call(_: int) -> str:
        start.wait()
        return room.store.create(actor, girl_of_six(), Repeatable("k", "body"))[0].id

    with ThreadPoolExecutor(6) as pool:
        opened = set(pool.map(call, range(6)))
    assert len(opened) == 1
    assert len(room.store.list_cases(actor)) == 1


def test_an_idempotency_key_is_forgotten_after_a_day(room: Room) -> None:
    actor = room.portal()
    first, _ = room.store.create(actor, girl_of_six(), Repeatable("k", "body"))
    with room.database.writing() as session:
        row = session.get(IdempotencyRow, (actor.name, "k"))
        assert row is not None
        row.created_at = row.created_at.replace(year=2000)
    later, is_new = room.store.create(actor, girl_of_six(), Repeatable("k", "other body"))
    assert is_new
    assert later.id != first.id


def test_landmarks_are_not_taken_before_the_scan_was_examined(room: Room) -> None:
    actor = room.portal()
    case, _ = room.store.create(actor, girl_of_six())
    with pytest.raises(StateConflict, match="awaiting scan"):
        room.store.place_landmarks(actor, case.id, Asked({}))


@pytest.mark.parametrize(("at_work", "after"), [("checking", "awaiting_scan"), ("queued", "awaiting_landmarks")])
def test_cancel_steps_back_and_makes_the_job_worthless(room: Room, at_work: str, after: str) -> None:
    actor = room.portal()
    case = with_scan(room, actor)
    if at_work == "checking":
        case, job = room.store.check_again(actor, case.id, "cm")
    else:
        case, job = room.store.place_landmarks(actor, case.id, Asked({}))
    assert case.status == at_work
    case, stopped = room.store.cancel(actor, case.id)
    assert (case.status, stopped) == (after, job)
    assert not room.desk.is_current(job)
    assert room.desk.take_up(job) is None
    assert not room.desk.hand_in(job, DONE)
    assert room.store.get(actor, case.id).status == after
    with pytest.raises(StateConflict):
        room.store.cancel(actor, case.id)


def test_a_result_is_handed_in_once(room: Room) -> None:
    actor = room.portal()
    case = with_scan(room, actor)
    _, job = room.store.place_landmarks(actor, case.id, Asked({}))
    assert room.desk.hand_in(job, DONE)
    assert not room.desk.hand_in(job, Handed("failed"))
    assert room.store.get(actor, case.id).status == "done"


def test_a_new_scan_drops_all_that_came_from_the_old_one(room: Room) -> None:
    actor = room.portal()
    case = with_scan(room, actor)
    _, job = room.store.place_landmarks(actor, case.id, Asked({"navel": [0.0, 0.0, 0.0]}))
    room.desk.hand_in(job, DONE)
    case, _ = room.store.receive_scan(actor, case.id, room.vault.seal(case.id, "scan", b"new skin"), None)
    assert (case.status, case.landmarks, case.is_checked) == ("checking", None, False)
    assert room.vault.read(case.id, "scan") == b"new skin"
    objects = [path for path in (room.folder / "files" / case.id).rglob("*") if path.is_file()]
    assert len(objects) == 1


def test_a_new_run_or_check_drops_the_result_of_the_old_one_at_once(room: Room) -> None:
    actor = room.portal()
    case = with_scan(room, actor)
    _, first = room.store.place_landmarks(actor, case.id, Asked({}))
    room.desk.hand_in(first, DONE)
    room.vault.put(case.id, "view.html", b"old view")
    _, second = room.store.place_landmarks(actor, case.id, Asked({}))
    for artefact in ("result.json", "outcome.npz", "view.html"):
        with pytest.raises(FileNotFound):
            room.vault.read(case.id, artefact)
    room.desk.hand_in(second, Handed("refused", reason={"code": "x", "message": "y", "advice": "z"}))
    room.store.check_again(actor, case.id, "cm")
    with pytest.raises(FileNotFound):
        room.vault.read(case.id, "examination.npz")
    assert room.vault.read(case.id, "scan") == b"skin"


def test_what_was_derived_from_a_replaced_file_is_not_kept(room: Room) -> None:
    actor = room.portal()
    case = with_scan(room, actor)

    def draw(source: bytes) -> bytes:
        room.vault.put(case.id, "outcome.npz", b"newer")
        return b"view of " + source

    room.vault.put(case.id, "outcome.npz", b"older")
    assert room.vault.derive(case.id, "view.html", "outcome.npz", draw) == b"view of older"
    with pytest.raises(FileNotFound):
        room.vault.read(case.id, "view.html")
    assert room.vault.derive(case.id, "view.html", "outcome.npz", bytes.upper) == b"NEWER"
    assert room.vault.read(case.id, "view.html") == b"NEWER"


def test_waiting_jobs_are_found_again_after_a_crash(room: Room) -> None:
    actor = room.portal()
    case = with_scan(room, actor)
    _, job = room.store.place_landmarks(actor, case.id, Asked({}))
    assert room.desk.waiting() == [job]
    room.desk.take_up(job)
    assert room.desk.waiting() == [job]
    room.desk.hand_in(job, DONE)
    assert room.desk.waiting() == []


def test_every_change_has_one_line_in_a_chain_nobody_can_bend(room: Room) -> None:
    actor = room.portal()
    case = with_scan(room, actor)
    room.privacy.delete(actor, case.id)
    with room.database.reading() as session:
        lines = session.scalars(
            sa.select(AuditRow).where(AuditRow.case_id == case.id).order_by(AuditRow.sequence)
        ).all()
    assert [line.action for line in lines] == ["case.create", "scan.receive", "job.check", "case.delete"]
    assert first_broken_line(room.database) is None
    for change in ("UPDATE audit SET actor = 'nobody'", "DELETE FROM audit"):
        with pytest.raises(sa.exc.DatabaseError, match="append only"), room.database.writing() as session:
            session.execute(sa.text(change))


def test_looking_at_a_body_is_written_down(room: Room) -> None:
    actor = room.portal()
    case, _ = room.store.create(actor, girl_of_six())
    room.store.note_reading(actor, case.id, "view.read")
    with pytest.raises(CaseNotFound):
        room.store.note_reading(room.portal("b"), case.id, "view.read")
    with room.database.reading() as session:
        lines = session.scalars(sa.select(AuditRow).where(AuditRow.action == "view.read")).all()
    assert [(line.actor, line.case_id) for line in lines] == [(actor.name, case.id)]


def test_a_bent_line_is_found(room: Room) -> None:
    room.store.create(room.portal(), girl_of_six())
    with room.database.writing() as session:
        session.add(
            AuditRow(
                sequence=3,
                at=room.people.list_keys()[0].created_at,
                actor="nobody",
                action="case.read",
                case_id=None,
                detail="",
                previous_sha256="0" * 64,
                sha256="0" * 64,
            )
        )
    assert first_broken_line(room.database) == 3


def test_many_writers_at_once_lose_nothing(room: Room) -> None:
    actor = room.portal()
    failures: list[Exception] = []

    def open_some() -> None:
        database = Database(room.url)
        try:
            store = type(room.store)(database, room.vault)
            for _ in range(5):
                store.create(actor, girl_of_six())
        except Exception as error:
            failures.append(error)
        finally:
            database.close()

    threads = [threading.Thread(target=open_some) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert failures == []
    assert len(room.store.list_cases(actor)) == 20
    assert first_broken_line(room.database) is None


def test_the_tables_are_what_the_models_say(room: Room) -> None:
    from alembic.autogenerate import compare_metadata
    from alembic.migration import MigrationContext

    from lubdub.cases.models import Base

    with room.database.engine.connect() as connection:
        differences = compare_metadata(MigrationContext.configure(connection), Base.metadata)
    assert differences == []
