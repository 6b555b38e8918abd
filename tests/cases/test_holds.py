"""The legal hold: a held case is neither deleted nor purged, whoever asks; and it stands in the trail why."""

from __future__ import annotations

import pytest
import sqlalchemy as sa

from lubdub.cases.errors import CaseHeld, CaseNotFound, StateConflict
from lubdub.cases.holds import LONGEST_REASON, Holds
from lubdub.cases.models import AuditRow, CaseRow
from lubdub.cases.values import SYSTEM, Actor
from tests.cases.conftest import Room, girl_of_six
from tests.cases.test_store import with_scan


def lead(portal: Actor) -> Actor:
    return Actor("clinician", "lead", portal.tenant_id)


def age(room: Room, case_id: str) -> None:
    with room.database.writing() as session:
        row = session.get_one(CaseRow, case_id)
        row.created_at = row.created_at.replace(year=2000)


def test_a_held_case_is_neither_deleted_nor_purged_until_the_hold_is_lifted(room: Room) -> None:
    portal, holds = room.portal(), Holds(room.database)
    case = with_scan(room, portal)
    hold = holds.place(lead(portal), case.id, "a  question\nof the court")
    assert (hold.by, hold.reason) == ("clinician:lead", "a question of the court")
    assert holds.list_all(portal) == [hold] == [holds.get(portal, case.id)]
    age(room, case.id)
    for actor in (portal, lead(portal), SYSTEM):
        with pytest.raises(CaseHeld):
            room.privacy.delete(actor, case.id)
    assert room.privacy.purge(30.0) == []
    assert room.vault.read(case.id, "scan")
    assert room.store.get(portal, case.id).is_held
    holds.lift(lead(portal), case.id, "settled")
    assert [receipt.id for receipt in room.privacy.purge(30.0)] == [case.id]
    with room.database.reading() as session:
        lines = session.execute(sa.select(AuditRow.actor, AuditRow.action, AuditRow.detail)).all()
    assert ("clinician:lead", "case.hold", "a question of the court") in lines
    assert ("clinician:lead", "case.release", "settled") in lines


def test_a_hold_is_for_cases_of_ones_own_and_needs_a_reason(room: Room) -> None:
    portal, holds = room.portal(), Holds(room.database)
    case, _ = room.store.create(portal, girl_of_six())
    with pytest.raises(CaseNotFound):
        holds.place(lead(room.portal("another clinic")), case.id, "curious")
    for reason in ("", "  \n", "x" * (LONGEST_REASON + 1)):
        with pytest.raises(ValueError, match="Say why"):
            holds.place(portal, case.id, reason)
    with pytest.raises(StateConflict, match="not under a legal hold"):
        holds.lift(portal, case.id, "why not")
    holds.place(portal, case.id, "for now")
    with pytest.raises(StateConflict, match="already"):
        holds.place(portal, case.id, "again")
    assert holds.list_all(room.portal("a third clinic")) == []
