"""The separate yes to keeping a shape, on every database."""

from __future__ import annotations

import pytest

from lubdub.cases.errors import CaseNotFound, StateConflict
from lubdub.cases.sharing import Sharing
from tests.cases.conftest import Room
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


def test_nobody_agrees_for_another(room: Room) -> None:
    case = signed(room)
    for stranger in (room.portal("elsewhere"), room.family()):
        with pytest.raises(CaseNotFound):
            Sharing(room.database).agree(stranger, case, "en")
