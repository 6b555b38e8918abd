"""Families that are asked for a scan: one link, one browser, the right birthday, and the case goes to who asked."""

from __future__ import annotations

from datetime import date, timedelta

import pytest
import sqlalchemy as sa

from lubdub.cases.errors import CaseNotFound, LinkSpent, NotAllowed, WrongBirthDate
from lubdub.cases.family_invitations import MOST_TRIES, FamilyInvitations
from lubdub.cases.links import Links
from lubdub.cases.models_desk import FamilyInvitationRow
from lubdub.cases.values import FAMILIES, Actor
from tests.cases.conftest import Room, girl_of_six

BORN = date(2020, 5, 17)


def clinician(room: Room, organisation: str = "Heart House") -> Actor:
    return Actor("clinician", "ada", room.portal(organisation).tenant_id)


def test_the_case_of_an_invited_family_belongs_to_who_asked_and_to_the_family(room: Room) -> None:
    ada, family = clinician(room), room.family()
    code = room.staff.families.offer(ada, "A-17").token
    assert room.staff.families.take(family, code.lower(), None).organisation == "Heart House"
    waiting = room.staff.families.waiting_for(family)
    assert waiting is not None
    case = room.store.create(family, girl_of_six())[0]
    assert (case.tenant_id, case.external_id) == (ada.tenant_id, "A-17")
    assert room.store.get(ada, case.id).id == case.id
    assert room.store.get(family, case.id).id == case.id
    assert room.staff.families.waiting_for(family) is None
    (listed,) = room.staff.families.list_all(ada)
    assert (listed.case_id, listed.case_status) == (case.id, "awaiting_scan")
    assert room.store.create(family, girl_of_six())[0].tenant_id == FAMILIES


def test_a_made_up_sample_goes_to_nobody(room: Room) -> None:
    ada, family = clinician(room), room.family()
    room.staff.families.take(family, room.staff.families.offer(ada).token, None)
    assert room.store.create(family, girl_of_six(person="sample"))[0].tenant_id == FAMILIES
    assert room.staff.families.waiting_for(family) is not None


def test_a_link_works_once_for_a_time_and_until_it_is_taken_back(room: Room) -> None:
    ada, families = clinician(room), room.staff.families
    code = families.offer(ada).token
    families.take(room.family(), code, None)
    revoked = families.offer(ada)
    families.revoke(ada, revoked.id)
    late = FamilyInvitations(room.database, room.vault, timedelta(0)).offer(ada)
    for dead in (code, revoked.token, late.token, "ABCD-EFGH-JKMN-PQRS"):
        assert families.look(dead) is None
        with pytest.raises(LinkSpent):
            families.take(room.family(), dead, None)


def test_too_many_wrong_dates_of_birth_shut_the_link_until_it_is_sent_anew(room: Room) -> None:
    ada, families = clinician(room), room.staff.families
    offered = families.offer(ada, None, BORN)
    for left in reversed(range(MOST_TRIES)):
        with pytest.raises(WrongBirthDate) as wrong:
            families.take(room.family(), offered.token, date(2020, 5, 18) if left else None)
        assert wrong.value.left == left
    with pytest.raises(LinkSpent):
        families.take(room.family(), offered.token, BORN)
    assert families.get(ada, offered.id).is_locked
    again = families.offer_again(ada, offered.id)
    assert families.take(room.family(), again.token, BORN).taken_at is not None


def test_a_new_link_brings_the_case_to_another_browser_and_ends_the_old_link(room: Room) -> None:
    ada, phone, tablet = clinician(room), room.family(), room.family()
    families = room.staff.families
    offered = families.offer(ada)
    families.take(phone, offered.token, None)
    case = room.store.create(phone, girl_of_six())[0]
    first, second = families.offer_again(ada, offered.id), families.offer_again(ada, offered.id)
    with pytest.raises(LinkSpent):
        families.take(tablet, first.token, None)
    assert families.take(tablet, second.token, None).case_id == case.id
    assert room.store.get(tablet, case.id).id == case.id
    with pytest.raises(CaseNotFound):
        room.store.get(phone, case.id)


def test_an_invited_familys_case_moves_between_its_devices_too(room: Room) -> None:
    ada, phone, tablet = clinician(room), room.family(), room.family()
    room.staff.families.take(phone, room.staff.families.offer(ada).token, None)
    case = room.store.create(phone, girl_of_six())[0]
    links = Links(room.database)
    assert links.take(tablet, links.offer(phone, case.id).code).tenant_id == ada.tenant_id


def test_organisations_do_not_see_each_others_families(room: Room) -> None:
    ada, other, families = clinician(room), clinician(room, "Elsewhere"), room.staff.families
    offered = families.offer(ada)
    assert families.list_all(other) == []
    for forbidden in (families.get, families.revoke, families.offer_again):
        with pytest.raises(NotAllowed):
            forbidden(other, offered.id)


def test_neither_code_nor_date_of_birth_can_be_read_from_the_database_and_deletion_takes_all(room: Room) -> None:
    ada, family, families = clinician(room), room.family(), room.staff.families
    offered = families.offer(ada, "A-17", BORN)
    with room.database.reading() as session:
        stored = str(vars(session.scalars(sa.select(FamilyInvitationRow)).one()))
    for secret in (offered.token, offered.token.replace("-", ""), "2020", "0517"):
        assert secret not in stored
    families.take(family, offered.token, BORN)
    room.privacy.delete(family, room.store.create(family, girl_of_six())[0].id)
    assert families.list_all(ada) == []


def test_links_that_ran_out_leave_the_list_in_the_end(room: Room, monkeypatch: pytest.MonkeyPatch) -> None:
    ada = clinician(room)
    FamilyInvitations(room.database, room.vault, timedelta(days=-6)).offer(ada)
    FamilyInvitations(room.database, room.vault, timedelta(days=-8)).offer(ada)
    room.privacy.purge(30)
    assert len(room.staff.families.list_all(ada)) == 1
