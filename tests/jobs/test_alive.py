"""The health check of a worker's container."""

from __future__ import annotations

from datetime import timedelta
from pathlib import Path

import pytest
import sqlalchemy as sa

from lubdub.cases.models import WorkerRow
from lubdub.cases.opening import open_cases
from lubdub.cases.work import WorkDesk
from lubdub.jobs.alive import SEEN, why_not
from lubdub.settings import Settings


@pytest.fixture
def settings(tmp_path: Path) -> Settings:
    return Settings(data_dir=tmp_path / "data")


def test_without_a_worker_it_says_so(settings: Settings) -> None:
    assert why_not(settings) == "No worker was seen for 30 seconds."


def test_a_worker_that_was_just_seen_is_well_and_one_that_was_not_is_not(settings: Settings) -> None:
    database, vault = open_cases(settings.database, settings.store, settings.master_key_source)
    WorkDesk(database, vault).beat("worker-0", "cholmod", {})
    assert why_not(settings) is None
    with database.writing() as session:
        row = session.get(WorkerRow, "worker-0")
        assert row is not None
        session.execute(sa.update(WorkerRow).values(seen_at=row.seen_at - SEEN - timedelta(seconds=1)))
    assert why_not(settings) == "No worker was seen for 30 seconds."
    database.close()


def test_a_database_that_does_not_answer_is_said_in_one_sentence(settings: Settings) -> None:
    away = settings.model_copy(update={"database_url": "postgresql://nobody@127.0.0.1:1/nothing"})
    assert "database cannot be opened" in str(why_not(away))
