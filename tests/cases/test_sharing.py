"""The separate yes to keeping a shape, on every database."""

from __future__ import annotations

from datetime import UTC, datetime

import pytest

from lubdub.cases.errors import CaseNotFound, StateConflict
from lubdub.cases.models import AuditRow
from lubdub.cases.sharing import Sharing, SharingYes
from tests.cases.conftest import Room, girl_of_six
from tests.cases.test_review_desk import look_at_all, sent


def signed(room: Room) -> str:
    case, by = sent(room)
    room.reviews.sign(by, case, look_at_all(room, case, by).version)
    return case


def test_only_a_signed_case_with_a_separate_yes_is_shared(room: Room) -> None:
    sharing, actor = Sharing(room.database), room.portal()
    waiting, _ = sent(room, actor)
    with pytest.raises(StateConflict, match="signed"):
        sharing.agree(actor, waiting, "en")
    with pytest.raises(StateConflict, match="signed"):
        sharing.shared_case(waiting)
    case = signed(room)
    with pytest.raises(StateConflict, match="not agreed"):
        sharing.shared_case(case)
    assert sharing.agree(actor, case, "en").is_shared
    assert sharing.shared_case(case).id == case


def test_a_yes_taken_back_or_deleted_stands_no_more(room: Room) -> None:
    sharing, actor = Sharing(room.database), room.portal()
    first, second = signed(room), signed(room)
    for case in (first, second):
        sharing.agree(actor, case, "en")
        assert sharing.still_shared(case)
    assert not sharing.take_back(actor, first).is_shared
    room.privacy.delete(actor, second)
    assert not sharing.still_shared(first)
    assert not sharing.still_shared(second)
    assert not sharing.still_shared("never was")


def test_a_yes_that_a_portal_holds_is_kept_with_its_words_and_counts_once_a_clinician_has_signed(room: Room) -> None:
    sharing, portal = Sharing(room.database), room.portal()
    case, by = sent(room, portal)
    assert sharing.read(portal, case) is None
    yes = SharingYes("portal words, 2", "es", datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC))
    sharing.keep(portal, case, yes)
    assert sharing.read(portal, case) == yes
    with pytest.raises(StateConflict, match="signed"):
        sharing.shared_case(case)
    room.reviews.sign(by, case, look_at_all(room, case, by).version)
    assert sharing.shared_case(case).id == case
    sharing.take_back(portal, case)
    assert sharing.read(portal, case) is None
    with room.database.reading() as session:
        actions = [line.action for line in session.query(AuditRow).filter_by(case_id=case)]
    assert actions.count("sharing.agree") == actions.count("sharing.take_back") == 1


def test_nobody_agrees_for_a_made_up_body(room: Room) -> None:
    portal = room.portal()
    case, _ = room.store.create(portal, girl_of_six(person="sample"))
    with pytest.raises(StateConflict, match="made-up"):
        Sharing(room.database).keep(portal, case.id, SharingYes("1", "en", datetime(2026, 1, 2, tzinfo=UTC)))


def test_nobody_agrees_for_another(room: Room) -> None:
    case = signed(room)
    for stranger in (room.portal("elsewhere"), room.family()):
        with pytest.raises(CaseNotFound):
            Sharing(room.database).agree(stranger, case, "en")
        with pytest.raises(CaseNotFound):
            Sharing(room.database).keep(stranger, case, SharingYes("1", "en", datetime(2026, 1, 2, tzinfo=UTC)))
