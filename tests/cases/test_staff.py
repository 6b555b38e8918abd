"""The people at the desk: how accounts come to be, how they sign in, what they may, and when it is over."""

from __future__ import annotations

import time
from datetime import timedelta

import pytest
import sqlalchemy as sa

from lubdub.cases import audit, credentials, invitations
from lubdub.cases.attempts import Attempts, Limit
from lubdub.cases.clock import now
from lubdub.cases.credentials import code_at, new_recovery_codes, new_secret
from lubdub.cases.desk_sessions import DeskSessions
from lubdub.cases.desk_values import Clinician, Joining, Role
from lubdub.cases.errors import CaseNotFound, EmailTaken, LinkSpent, NotAllowed, SignInRefused, TooManyTries
from lubdub.cases.models_desk import AttemptRow, ClinicianRow, ClinicianSessionRow, InvitationRow, RecoveryCodeRow
from lubdub.cases.values import Actor
from tests.cases.conftest import Room, girl_of_six
from tests.cases.test_review import with_result

PASSWORD = "three plain words"
HERE = "192.0.2.1"


class Person:
    """Somebody with an account, who knows the password and has the code app."""

    def __init__(self, room: Room, token: str, email: str, organisation: str = "Heart House") -> None:
        self.secret, self.codes = new_secret(), new_recovery_codes()
        equip = room.staff.credentials.equipped(PASSWORD, self.secret, self.codes)
        self.clinician = room.staff.invitations.accept(token, Joining("Ada", email, organisation), equip)
        self.room = room

    def sign_in(self, password: str = PASSWORD, code: str | None = None, email: str | None = None) -> str:
        shown = code_at(self.secret, time.time()) if code is None else code
        return self.room.staff.credentials.sign_in(email or self.clinician.email, password, shown, HERE)[1]


def first(room: Room, email: str = "ada@heart.example") -> Person:
    offered = room.staff.invitations.offer_first()
    assert offered is not None
    return Person(room, offered.token, email)


def colleague(room: Room, of: Clinician, role: Role, email: str) -> Person:
    return Person(room, room.staff.invitations.offer(of.actor, role).token, email)


def test_the_first_link_makes_one_administrator_and_then_there_is_no_other(room: Room) -> None:
    assert not room.staff.clinicians.is_anybody_here()
    older = room.staff.invitations.offer_first()
    assert older is not None
    ada = first(room).clinician
    assert (ada.role, ada.organisation) == ("administrator", "Heart House")
    assert room.staff.clinicians.is_anybody_here()
    assert room.staff.invitations.offer_first() is None
    with pytest.raises(LinkSpent):
        Person(room, older.token, "eve@heart.example")
    room.staff.clinicians.list_all()


def test_a_link_works_once_and_not_for_ever(room: Room, monkeypatch: pytest.MonkeyPatch) -> None:
    ada = first(room).clinician
    offered = room.staff.invitations.offer(ada.actor, "clinician")
    found = room.staff.invitations.look(offered.token)
    assert found is not None
    assert (found.organisation, found.role, found.is_first) == ("Heart House", "clinician", False)
    Person(room, offered.token, "bo@heart.example")
    with pytest.raises(LinkSpent):
        Person(room, offered.token, "cy@heart.example")
    monkeypatch.setattr(invitations, "LASTS", timedelta(seconds=-1))
    assert room.staff.invitations.look(room.staff.invitations.offer(ada.actor, "lead").token) is None


def test_a_link_can_be_taken_back_by_its_own_organisation_alone(room: Room) -> None:
    ada = first(room).clinician
    offered = room.staff.invitations.offer(ada.actor, "lead")
    assert [one.id for one in room.staff.invitations.list_open(ada.tenant_id)] == [offered.id]
    assert not room.staff.invitations.revoke(room.portal("elsewhere"), offered.id)
    assert room.staff.invitations.revoke(ada.actor, offered.id)
    assert room.staff.invitations.look(offered.token) is None


def test_an_account_that_cannot_be_made_leaves_the_link_open(room: Room) -> None:
    ada = first(room).clinician
    offered = room.staff.invitations.offer(ada.actor, "clinician")
    with pytest.raises(EmailTaken):
        Person(room, offered.token, "ADA@heart.example ")
    assert room.staff.invitations.look(offered.token) is not None
    assert len(room.staff.clinicians.list_all()) == 1


def test_no_secret_of_a_link_session_password_or_code_is_stored(room: Room) -> None:
    offered = room.staff.invitations.offer_first()
    assert offered is not None
    with room.database.reading() as session:
        link = session.scalars(sa.select(InvitationRow)).one()
    assert offered.token not in str(vars(link))
    ada = Person(room, offered.token, "ada@heart.example")
    opened = room.staff.sessions.open(ada.clinician, "password", "Firefox")
    with room.database.reading() as session:
        rows = [
            vars(row)
            for kind in (ClinicianRow, ClinicianSessionRow, RecoveryCodeRow)
            for row in session.scalars(sa.select(kind))
        ]
    stored = str(rows)
    assert stored.count("$argon2id$") == 1
    for secret in (PASSWORD, ada.secret, opened.token, *ada.codes):
        assert secret not in stored


def test_password_and_code_open_only_together_and_a_code_only_once(room: Room) -> None:
    ada = first(room)
    code = code_at(ada.secret, time.time())
    for password, shown in (("another password", code), (PASSWORD, "000000"), (PASSWORD, ""), ("", code)):
        with pytest.raises(SignInRefused):
            ada.sign_in(password, shown)
    assert ada.sign_in(code=code) == "password"
    with pytest.raises(SignInRefused):
        ada.sign_in(code=code)
    with pytest.raises(SignInRefused):
        ada.sign_in(code=code_at(ada.secret, time.time() - 300))


@pytest.mark.parametrize("other", [PASSWORD.upper(), f"{PASSWORD} ", PASSWORD[:-1], PASSWORD * 20])
def test_a_password_counts_to_the_last_sign(room: Room, other: str) -> None:
    ada = first(room)
    assert not room.staff.credentials.knows_password(ada.clinician, other)
    assert room.staff.credentials.knows_password(ada.clinician, PASSWORD)


def test_a_password_does_not_grow_old(room: Room) -> None:
    ada = first(room)
    with room.database.writing() as session:
        session.execute(sa.update(ClinicianRow).values(created_at=now() - timedelta(days=3650)))
    assert ada.sign_in() == "password"


def test_a_spare_code_stands_in_once(room: Room) -> None:
    ada = first(room)
    assert ada.sign_in(code=ada.codes[3].lower()) == "recovery"
    with pytest.raises(SignInRefused):
        ada.sign_in(code=ada.codes[3])
    assert ada.sign_in(code=ada.codes[4]) == "recovery"


def test_guessing_is_stopped_for_the_account_and_success_forgets_the_mistakes(room: Room) -> None:
    ada = first(room)
    for _ in range(credentials.OF_ACCOUNT.tries - 1):
        with pytest.raises(SignInRefused):
            ada.sign_in("wrong")
    ada.sign_in()
    for _ in range(credentials.OF_ACCOUNT.tries):
        with pytest.raises(SignInRefused):
            ada.sign_in("wrong")
    with pytest.raises(TooManyTries):
        ada.sign_in(code=ada.codes[0])


def test_an_address_that_tries_many_accounts_is_stopped_too(room: Room, monkeypatch: pytest.MonkeyPatch) -> None:
    ada = first(room)
    monkeypatch.setattr(credentials, "OF_ADDRESS", Limit(3, timedelta(minutes=15)))
    for number in range(3):
        with pytest.raises(SignInRefused):
            ada.sign_in(email=f"nobody{number}@heart.example")
    with pytest.raises(TooManyTries) as stopped:
        ada.sign_in()
    assert 0 < stopped.value.seconds <= 900


def test_tries_are_counted_anew_when_their_time_is_over(room: Room) -> None:
    attempts, limit = Attempts(room.database), Limit(1, timedelta(hours=1))
    attempts.count("door", limit)
    with pytest.raises(TooManyTries):
        attempts.count("door", limit)
    attempts.count("door", Limit(1, timedelta(0)))
    with room.database.reading() as session:
        assert "door" not in str(vars(session.scalars(sa.select(AttemptRow)).one()))


def test_a_session_ends_when_idle_when_old_when_revoked_and_with_the_account(room: Room) -> None:
    ada = first(room).clinician
    bo = colleague(room, ada, "clinician", "bo@heart.example").clinician
    sessions = room.staff.sessions
    one, two = sessions.open(bo, "password", "Firefox"), sessions.open(bo, "passkey", "Safari")
    found = sessions.session_of(one.token)
    assert found is not None
    assert found.clinician == bo
    assert [open_one.device for open_one in sessions.list_living(bo)] == ["Safari", "Firefox"]
    for limits in ((timedelta(0), timedelta(hours=1)), (timedelta(hours=1), timedelta(0))):
        short = DeskSessions(room.database, *limits)
        assert short.session_of(short.open(bo, "password", "").token) is None
    assert not sessions.end(ada, one.id)
    assert sessions.end(bo, one.id)
    assert sessions.session_of(one.token) is None
    sessions.end_others(bo, two.id)
    assert [open_one.id for open_one in sessions.list_living(bo)] == [two.id]
    room.staff.clinicians.disable(ada.actor, bo.id)
    assert sessions.session_of(two.token) is None
    with pytest.raises(SignInRefused):
        room.staff.credentials.sign_in(bo.email, PASSWORD, "000000", HERE)


def test_an_organisation_keeps_an_administrator_and_minds_its_own_people(room: Room) -> None:
    ada = first(room).clinician
    clinicians = room.staff.clinicians
    for forbidden in (
        lambda: clinicians.disable(ada.actor, ada.id),
        lambda: clinicians.change_role(ada.actor, ada.id, "lead"),
    ):
        with pytest.raises(NotAllowed):
            forbidden()
    bo = colleague(room, ada, "clinician", "bo@heart.example").clinician
    clinicians.change_role(ada.actor, bo.id, "administrator")
    clinicians.change_role(ada.actor, ada.id, "clinician")
    assert {one.email: one.role for one in clinicians.list_all(ada.tenant_id)} == {
        "ada@heart.example": "clinician",
        "bo@heart.example": "administrator",
    }
    with pytest.raises(NotAllowed):
        clinicians.disable(room.portal("elsewhere"), ada.id)
    clinicians.disable(bo.actor, ada.id)
    clinicians.enable(bo.actor, ada.id)


def test_clinicians_see_their_organisations_cases_and_no_others(room: Room) -> None:
    ada = first(room).clinician
    own, others = room.portal("Heart House"), room.portal("elsewhere")
    assert own.tenant_id == ada.tenant_id
    case, foreign = room.store.create(own, girl_of_six())[0], room.store.create(others, girl_of_six())[0]
    assert [one.id for one in room.store.list_cases(ada.actor)] == [case.id]
    assert room.store.get(ada.actor, case.id).id == case.id
    with pytest.raises(CaseNotFound):
        room.store.get(ada.actor, foreign.id)


def test_every_step_stands_in_the_unbroken_audit_trail(room: Room) -> None:
    ada = first(room)
    with pytest.raises(SignInRefused):
        ada.sign_in("wrong")
    opened = room.staff.sessions.open(ada.clinician, "password", "Firefox")
    room.staff.sessions.end(ada.clinician, opened.id)
    room.staff.invitations.offer(ada.clinician.actor, "lead")
    with room.database.reading() as session:
        lines = [
            (row.actor, row.action)
            for row in session.scalars(sa.select(audit.AuditRow).order_by(audit.AuditRow.sequence))
        ]
    me = f"clinician:{ada.clinician.id}"
    assert lines == [
        ("system:lubdub", "desk.first_link"),
        (me, "clinician.join"),
        (me, "sign_in.refused"),
        (me, "sign_in"),
        (me, "sign_out"),
        (me, "clinician.invite"),
    ]
    assert audit.first_broken_line(room.database) is None


def test_what_families_send_is_seen_by_the_clinicians_that_take_families_until_it_is_taken_back(room: Room) -> None:
    ada, family, elsewhere = (
        first(room).clinician.actor,
        room.family(),
        Actor("clinician", "x", room.portal("e").tenant_id),
    )
    case = with_result(room, family)
    assert not room.store.has(ada, case.id)
    room.store.send_for_review(family, case.id)
    assert room.store.has(ada, case.id)
    assert not room.store.has(elsewhere, case.id)
    assert not room.store.has(room.portal("Heart House"), case.id)
    room.store.take_back(family, case.id)
    assert not room.store.has(ada, case.id)
