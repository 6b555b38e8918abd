"""The audit trail at the desk: leads read and take out their organisation's lines; nothing clinical is in them."""

from __future__ import annotations

import ast
import csv
import io
import re
from collections.abc import Iterator
from pathlib import Path
from typing import get_args

import pytest
import sqlalchemy as sa

from lubdub.cases.database import Database
from lubdub.cases.models import AuditRow
from lubdub.cases.reviewing import Deed
from lubdub.cases.staff import Times, open_staff
from lubdub.cases.states import JobKind
from lubdub.cases.trail import Trail
from lubdub.cases.values import Actor
from lubdub.web.desk.audit_words import action_words
from tests.cases.conftest import Room, girl_of_six, room
from tests.web.service import ROOT, Service
from tests.web.staff import Desk, signed_in

__all__ = ["room"]  # the fixture


WRITERS = {"append", "_note", "Step", "note_reading", "delete"}
"""Functions whose arguments name what was done."""


def codes_in(file: Path) -> Iterator[str]:
    """The actions that are written down by the code of a file; those put together at run time are not among them."""
    for call in ast.walk(ast.parse(file.read_text())):
        if isinstance(call, ast.Call) and getattr(call.func, "attr", getattr(call.func, "id", "")) in WRITERS:
            for said in call.args:
                if isinstance(said, ast.Constant) and re.fullmatch(r"[a-z_]+\.[a-z_]+|sign_(in|out)", str(said.value)):
                    yield str(said.value)


@pytest.fixture
def lead(service: Service) -> Desk:
    return signed_in(service, "lead", "Audit House")


def test_a_lead_reads_who_did_what_to_the_organisations_cases(service: Service, lead: Desk) -> None:
    portal = service.portal("Audit House")
    case, foreign = portal.open_case(), service.portal("Elsewhere").open_case()
    lead.get(f"/desk/cases/{case}", 200)
    page = lead.get("/desk/audit")
    assert "<td>Opened a case</td>" in page
    assert case[:6] in page
    assert "Audit House" in page
    assert foreign[:6] not in page
    portal.call("DELETE", f"/cases/{case}", 200)
    assert "<td>Deleted a case with all" in lead.get(f"/desk/audit?case={case[:8]}")
    assert "Opened a case" not in lead.get("/desk/audit?case=zzzz")


def test_every_action_that_is_written_has_its_words() -> None:
    written = (
        {"case.delete"} | {f"review.{deed}" for deed in get_args(Deed)} | {f"job.{kind}" for kind in get_args(JobKind)}
    )
    for file in (ROOT / "backend" / "lubdub").rglob("*.py"):
        if file.name != "desk_audit_words.py":
            written |= set(codes_in(file))
    assert written == set(action_words(str))


def test_the_trail_is_taken_out_as_table_and_as_json_and_that_is_a_line_too(service: Service, lead: Desk) -> None:
    case = service.portal("Audit House").open_case()
    rows = list(csv.DictReader(io.StringIO(lead.get("/desk/audit.csv"))))
    assert {"case.create", "clinician.join"} <= {row["action"] for row in rows}
    assert rows[-1]["action"] == "audit.export"
    document = lead.http.get("/desk/audit.json").json()
    assert document["first_broken_line"] is None
    assert [line["sha256"] for line in document["lines"]][: len(rows)] == [row["sha256"] for row in rows]
    assert case in {line["case_id"] for line in document["lines"]}
    assert "unbroken" in lead.get("/desk/audit?check=true")


def test_nothing_clinical_and_no_name_leaves_with_the_trail(service: Service, lead: Desk) -> None:
    portal = service.portal("Audit House")
    portal.done(b"quick")
    for line in csv.DictReader(io.StringIO(lead.get("/desk/audit.csv"))):
        assert re.fullmatch(r"(system|key|clinician|family):[a-z0-9]+", line["actor"])
        assert re.fullmatch(r"[a-z_.]+", line["action"])
        assert re.fullmatch(r"[a-z_]*|[0-9a-f]{16}( [a-z0-9]+)?", line["detail"])


def test_old_lines_are_a_page_away(room: Room) -> None:
    key = room.portal("Heart House")
    for _ in range(5):
        room.store.create(key, girl_of_six())
    trail = Trail(room.database)
    newest = trail.page(key, limit=2)
    assert [line.sequence for line in trail.page(key, newest[-1].sequence, limit=2)] == [
        newest[0].sequence - 2,
        newest[0].sequence - 3,
    ]
    assert trail.page(Actor("clinician", "x", room.portal("Elsewhere").tenant_id), limit=9)[0].action == "key.create"


def test_what_the_system_did_about_its_people_is_seen_by_the_organisation_alone(room: Room) -> None:
    staff = open_staff(room.database, room.vault, Times())
    key, other = room.portal("Heart House"), room.portal("Elsewhere")
    assert [line.detail for line in staff.trail.page(key)] == [key.id]
    assert [line.detail for line in staff.trail.page(other)] == [other.id]


def test_a_changed_line_is_found(tmp_path: Path) -> None:
    database = Database(f"sqlite:///{tmp_path / 'cases.sqlite'}")
    trail, actor = Trail(database), Actor("clinician", "x", "t")
    for _ in range(3):
        list(trail.export(actor))
    assert trail.first_broken_line() is None
    with database.writing() as session:
        session.execute(sa.text("DROP TRIGGER audit_no_update"))
        session.execute(sa.update(AuditRow).where(AuditRow.sequence == 2).values(actor="clinician:y"))
    assert trail.first_broken_line() == 2
    database.close()
