"""The clinicians' list, on every database."""

from __future__ import annotations

from lubdub.cases.review import Decision
from lubdub.cases.values import Actor
from lubdub.cases.worklist import Worklist
from tests.cases.conftest import Room, girl_of_six
from tests.cases.test_review import with_result
from tests.cases.test_review_desk import sent


def listed(room: Room, actor: Actor, *said: str) -> list[str]:
    return [entry.case.id for entry in Worklist(room.database).entries(actor, *said)]  # type: ignore[arg-type]


def test_what_waits_longest_comes_first_and_before_everything_else(room: Room) -> None:
    portal = room.portal()
    done = with_result(room, portal).id
    (first, by), (second, _) = sent(room, portal), sent(room, portal)
    assert listed(room, by.actor) == [first, second]
    assert listed(room, by.actor, "all") == [first, second, done]
    room.reviews.give_back(by, first, 0, Decision("blurred"))
    assert listed(room, by.actor) == [second]
    assert listed(room, by.actor, "decided") == [first]
    assert listed(room, by.actor, "all") == [second, first, done]
    assert Worklist(room.database).counts(by.actor) == {"waiting": 1, "decided": 1, "under_way": 1, "all": 3}


def test_a_case_is_found_by_the_portals_id_or_the_beginning_of_ours(room: Room) -> None:
    portal = room.portal()
    named, _ = room.store.create(portal, girl_of_six(external_id="KH-2026-117"))
    other, _ = room.store.create(portal, girl_of_six(external_id="KH-2026%118"))
    assert listed(room, portal, "all", " kh-2026-1 ") == [named.id]
    assert listed(room, portal, "all", "%") == [other.id]
    assert listed(room, portal, "all", other.id[:8]) == [other.id]
    assert listed(room, portal, "waiting", "KH") == []


def test_nobody_is_listed_the_cases_of_another_organisation(room: Room) -> None:
    case, by = sent(room)
    stranger = room.clinician(room.portal("elsewhere"))
    assert listed(room, stranger.actor, "all") == []
    assert listed(room, stranger.actor, "all", case[:8]) == []
    assert Worklist(room.database).counts(stranger.actor)["all"] == 0
    assert Worklist(room.database).counts(by.actor)["all"] == 1


def test_the_lists_state_changes_with_every_change(room: Room) -> None:
    portal = room.portal()
    worklist, seen = Worklist(room.database), []
    by = room.clinician(portal)
    seen.append(worklist.state(by.actor))
    case, _ = sent(room, portal)
    seen.append(worklist.state(by.actor))
    assert worklist.state(by.actor) == seen[-1]
    room.reviews.give_back(by, case, 0, Decision("blurred"))
    seen.append(worklist.state(by.actor))
    room.privacy.delete(portal, case)
    seen.append(worklist.state(by.actor))
    assert len(set(seen[1:])) == 3
    assert seen[0] == seen[-1], "nothing is left of it"
