"""Whom an organisation's own login means: found by the address once, and by the login's own name from then on."""

from __future__ import annotations

from dataclasses import replace

import pytest
import sqlalchemy as sa

from lubdub.cases.desk_values import Vouched
from lubdub.cases.errors import SignInRefused
from lubdub.cases.models_desk import ClinicianRow
from tests.cases.conftest import Room
from tests.cases.test_staff import Person, colleague, first

ISSUER = "https://login.example"


def test_the_address_leads_to_the_account_once_and_the_subject_ever_after(room: Room) -> None:
    ada = first(room).clinician
    known = Vouched(ISSUER, "7", ada.email.upper())
    assert room.staff.logins.find(known) == ada
    assert room.staff.logins.find(replace(known, email="")) == ada
    assert room.staff.logins.find(replace(known, email="ada@married.example")) == ada


@pytest.mark.parametrize(
    "other", [Vouched(ISSUER, "8", "ada@heart.example"), Vouched("https://evil.example", "7", "ada@heart.example")]
)
def test_who_gets_the_address_later_or_says_the_same_elsewhere_is_somebody_else(room: Room, other: Vouched) -> None:
    room.staff.logins.find(Vouched(ISSUER, "7", first(room).clinician.email))
    with pytest.raises(SignInRefused):
        room.staff.logins.find(other)


def test_a_stranger_without_a_vouched_address_and_who_is_shut_out_find_nothing(room: Room) -> None:
    ada = first(room).clinician
    bo = colleague(room, ada, "lead", "bo@heart.example").clinician
    with pytest.raises(SignInRefused):
        room.staff.logins.find(Vouched(ISSUER, "7", ""))
    room.staff.logins.find(Vouched(ISSUER, "7", bo.email))
    room.staff.clinicians.disable(ada.actor, bo.id)
    with pytest.raises(SignInRefused):
        room.staff.logins.find(Vouched(ISSUER, "7", bo.email))


def test_new_ways_to_sign_in_end_the_old_login_and_the_subject_is_kept_as_a_hash(room: Room) -> None:
    ada = first(room).clinician
    bo = colleague(room, ada, "lead", "bo@heart.example").clinician
    room.staff.logins.find(Vouched(ISSUER, "subject-of-bo", bo.email))
    with room.database.reading() as session:
        assert "subject-of-bo" not in str([vars(row) for row in session.scalars(sa.select(ClinicianRow))])
    Person(room, room.staff.invitations.offer_renewal(ada.actor, bo.id).token, bo.email)
    with pytest.raises(SignInRefused):
        room.staff.logins.find(Vouched(ISSUER, "subject-of-bo", ""))
    assert room.staff.logins.find(Vouched(ISSUER, "new", bo.email)) == bo
