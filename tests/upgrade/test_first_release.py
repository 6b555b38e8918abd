"""A service of the first release, upgraded: no case is lost, and each goes on from where it was.

`first_release.tar.gz` is the data folder of that release, written by its own program: one case in every state it
knew, one of them computed from the demo child, with `known.json` saying which is which.
"""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import tarfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import httpx
import pytest
import sqlalchemy as sa

from lubdub.cases import audit
from lubdub.cases.backup_rows import reflected
from lubdub.cases.database import Database
from lubdub.cases.files import FileVault
from lubdub.cases.opening import CannotOpen, open_database
from lubdub.cases.people import People
from lubdub.cases.privacy import Privacy
from lubdub.cases.store import CaseStore
from lubdub.settings import Settings
from tests.databases import fresh_database, kinds
from tests.web.service import ROOT, Portal, Service, free_port

FIRST = Path(__file__).with_name("first_release.tar.gz")
DIES_WHILE_UPGRADING = """
import os, signal
from alembic import op
from lubdub.cases.database import Database
add = op.add_column
def add_and_die(*words, **more):
    add(*words, **more)
    if words[0] == "cases" and words[1].name == "sharing":
        os.kill(os.getpid(), signal.SIGKILL)
op.add_column = add_and_die
Database({url!r})
"""
"""Killed far into the upgrade, after a change of the tables, before anything is committed."""


@dataclass(frozen=True)
class Old:
    """The first release's data. cases: state -> id of the case that was in it."""

    folder: Path
    url: str
    cases: dict[str, str]
    token: str
    family: str
    receipt: str


@pytest.fixture(params=kinds())
def old(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Old]:
    folder = tmp_path / "data"
    with tarfile.open(FIRST) as packed:
        packed.extractall(folder, filter="fully_trusted")  # with the key's mode, which must be 0600
    known = json.loads((folder / "known.json").read_text())
    here = f"sqlite:///{folder / 'lubdub.sqlite'}"
    with fresh_database(request.param, tmp_path) as other:
        url = here if request.param == "sqlite" else other
        if url != here:
            copy_rows(here, url)
        yield Old(folder, url, **known)


def copy_rows(source: str, target: str) -> None:
    """The same rows in the first release's tables on PostgreSQL."""
    copy = Database(target, "0001")
    engine = sa.create_engine(source)
    with engine.connect() as rows, copy.engine.begin() as connection:
        tables = reflected(connection)
        connection.execute(sa.delete(tables.tables["tenants"]))
        for table in (table for table in tables.sorted_tables if table.name != "alembic_version"):
            for row in rows.execute(sa.select(reflected(rows).tables[table.name])):
                connection.execute(sa.insert(table).values(row._asdict()))
    engine.dispose()
    copy.close()


def statuses(database: Database) -> dict[str, str]:
    with database.reading() as session:
        return {row.id: row.status for row in session.execute(sa.text("SELECT id, status FROM cases"))}


def test_every_case_is_kept_as_it_was(old: Old) -> None:
    database = Database(old.url)
    vault = FileVault(database, (old.folder / "files").as_uri(), old.folder / "master.key")
    assert statuses(database) == {case: status for status, case in old.cases.items()}
    portal = People(database).key_of(old.token)
    assert portal is not None
    store = CaseStore(database, vault)
    for status in set(old.cases) - {"deleted", "awaiting_landmarks"}:
        assert store.get(portal.actor, old.cases[status]).age_years == 6.0
    assert store.get(portal.actor, old.cases["awaiting_scan"]).external_id == "patient-17"
    family = People(database).session_of(old.family)
    assert family is not None
    assert store.get(family.actor, old.cases["awaiting_landmarks"]).is_checked
    assert vault.read(old.cases["queued"], "scan") == b"a small scan"
    receipt = Privacy(database, vault).receipt(portal.actor, old.cases["deleted"])
    assert receipt is not None
    assert receipt.sha256 == old.receipt
    assert audit.first_broken_line(database) is None
    database.close()


def test_an_upgrade_that_is_killed_leaves_everything_as_it_was_and_can_be_made_again(old: Old) -> None:
    program = DIES_WHILE_UPGRADING.format(url=old.url)
    died = subprocess.run(
        [sys.executable, "-c", program], cwd=ROOT / "backend", capture_output=True, text=True, check=False
    )
    assert died.returncode == -signal.SIGKILL, died.stderr
    engine = sa.create_engine(old.url.replace("postgresql:", "postgresql+psycopg:"))
    with engine.connect() as connection:
        assert connection.scalar(sa.text("SELECT version_num FROM alembic_version")) == "0001"
        assert "sharing" not in reflected(connection).tables["cases"].c
    engine.dispose()
    database = Database(old.url)
    assert statuses(database) == {case: status for status, case in old.cases.items()}
    database.close()


def test_an_older_program_refuses_a_newer_database_in_one_sentence(old: Old) -> None:
    database = Database(old.url)
    with database.writing() as session:
        session.execute(sa.text("UPDATE alembic_version SET version_num = '9999'"))
    database.close()
    with pytest.raises(CannotOpen, match=r"^The database was upgraded by a newer Lubdub \(to 9999\)\. Use that"):
        open_database(old.url)


def test_every_case_goes_on_in_the_new_service(old: Old) -> None:
    settings = Settings(
        data_dir=old.folder, port=free_port(), database_url="" if old.url.startswith("sqlite") else old.url
    )
    service = Service(settings)
    try:
        service.start_web()
        headers = {"Authorization": f"Bearer {old.token}"}
        portal = Portal(httpx.Client(base_url=settings.address, headers=headers, timeout=60))
        done = old.cases["done"]
        result = portal.call("GET", f"/cases/{done}/result", 200).json()
        assert set(result["areas"]) == {"aortic", "pulmonary", "tricuspid", "mitral"}
        assert portal.call("GET", f"/cases/{done}/sheet.pdf", 200).content.startswith(b"%PDF")
        assert len(portal.call("GET", f"/cases/{done}/view.html", 200).content) > 100_000
        service.start_worker()
        portal.wait(old.cases["checking"], "awaiting_landmarks")
        for status in ("queued", "running"):
            portal.wait(old.cases[status], "done")
        portal.send(old.cases["awaiting_scan"], b"quick")
        portal.wait(old.cases["awaiting_scan"], "awaiting_landmarks")
        for status in ("failed", "done"):
            portal.call("PUT", f"/cases/{old.cases[status]}/landmarks", 202, json={})
            portal.wait(old.cases[status], "done")
        portal.call("DELETE", f"/cases/{done}", 200)
        assert portal.call("DELETE", f"/cases/{old.cases['deleted']}", 200).json()["sha256"] == old.receipt
        assert portal.state(old.cases["refused"])["status"] == "refused"
    finally:
        service.stop()
