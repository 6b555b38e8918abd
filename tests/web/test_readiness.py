"""Ready means: written, read and deleted, just now."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
import sqlalchemy as sa

from lubdub.cases.models_desk import AttemptRow
from lubdub.web.readiness import KEPT_S, WORKER_SEEN, Readiness, kept_by_all
from tests.cases.conftest import Room, room

__all__ = ["room"]


def test_ready_is_what_works_from_end_to_end(room: Room) -> None:
    room.desk.beat("worker-0", "cholmod", {})
    found = Readiness(room.database, room.vault, room.desk).look()
    assert found == {
        "ready": True,
        "checks": {"database": True, "store": True, "key": True, "worker": True},
        "solver": "cholmod",
        "sandbox": {},
    }
    with room.database.reading() as session:
        assert session.scalar(sa.select(sa.func.count()).select_from(AttemptRow)) == 0, "nothing is left behind"


def test_each_part_that_does_not_work_is_named(room: Room, monkeypatch: pytest.MonkeyPatch) -> None:
    found = Readiness(room.database, room.vault, room.desk).look()
    assert found["checks"] == {"database": True, "store": True, "key": True, "worker": False}
    shutil.rmtree(room.folder / "files")
    Path(room.folder / "files").write_text("in the way")
    found = Readiness(room.database, room.vault, room.desk).look()
    assert (found["ready"], found["checks"]["store"]) == (False, False)
    with room.database.writing() as session:
        session.execute(sa.text("DROP TABLE attempts"))
    assert not Readiness(room.database, room.vault, room.desk).look()["checks"]["database"]


def test_however_often_somebody_asks_it_is_looked_at_now_and_then(room: Room) -> None:
    moment = 100.0
    readiness = Readiness(room.database, room.vault, room.desk, lambda: moment)
    assert not readiness.look()["checks"]["worker"]
    room.desk.beat("worker-0", "cholmod", {})
    assert not readiness.look()["checks"]["worker"]
    moment += KEPT_S
    assert readiness.look()["checks"]["worker"]


def test_a_limit_holds_when_every_living_worker_keeps_it(room: Room) -> None:
    assert kept_by_all(room.desk.seen_within(WORKER_SEEN)) == {}
    room.desk.beat("worker-0", "cholmod", {"memory_mb": 4096, "no_network": True, "other_files_hidden": True})
    room.desk.beat("worker-1", "cholmod", {"memory_mb": 4096, "no_network": True, "other_files_hidden": False})
    kept = kept_by_all(room.desk.seen_within(WORKER_SEEN))
    assert kept == {"memory_mb": 4096, "no_network": True, "other_files_hidden": False}
