"""Links into a portal's page: signed, and turned away without asking the database when they are not ours."""

from __future__ import annotations

import re

import pytest

from lubdub.cases.database import Database
from lubdub.cases.embedding import Embedding
from lubdub.cases.errors import FrameLinkSpent
from lubdub.cases.files import FileVault
from tests.cases.conftest import Room, girl_of_six


class NoDatabase:
    """Whoever asks it fails."""

    def writing(self) -> None:
        raise AssertionError("the database was asked")


def offered(room: Room) -> tuple[Embedding, str]:
    embedding, portal = Embedding(room.database, room.vault), room.portal()
    embedding.set_origins(portal, ["https://portal.example"])
    case, _ = room.store.create(portal, girl_of_six())
    return embedding, embedding.offer(portal, case.id, "journey").token


def test_a_link_works_once(room: Room) -> None:
    embedding, token = offered(room)
    assert embedding.take(token).session is not None
    with pytest.raises(FrameLinkSpent):
        embedding.take(token)


@pytest.mark.parametrize("part", [0, 1, 2, 3], ids=["organisation", "end", "secret", "signature"])
def test_a_token_changed_anywhere_never_reaches_the_database(room: Room, part: int) -> None:
    _, token = offered(room)
    parts = token.split(".")
    parts[part] = re.sub("^.", "1" if parts[part][0] == "0" else "0", parts[part])
    nowhere = Embedding(NoDatabase(), room.vault)  # type: ignore[arg-type]
    for forged in (".".join(parts), token[:-1], "", "....", "made-up", "\u00e9.1.2.3"):
        with pytest.raises(FrameLinkSpent):
            nowhere.take(forged)


def test_a_token_of_another_service_never_reaches_the_database(room: Room) -> None:
    _, token = offered(room)
    database = Database(f"sqlite:///{room.folder / 'other.sqlite'}")
    other = FileVault(database, (room.folder / "others").as_uri(), room.folder / "other.key")
    with pytest.raises(FrameLinkSpent) as spent:
        Embedding(NoDatabase(), other).take(token)  # type: ignore[arg-type]
    assert spent.value.origins == ()


def test_a_token_that_is_too_old_opens_nothing_and_says_whose_page_it_was_made_for(
    room: Room, monkeypatch: pytest.MonkeyPatch
) -> None:
    embedding, token = offered(room)
    until = int(token.split(".")[1])

    class Later:
        @staticmethod
        def timestamp() -> float:
            return float(until)

    monkeypatch.setattr("lubdub.cases.embedding.now", Later)
    with pytest.raises(FrameLinkSpent) as spent:
        embedding.take(token)
    assert spent.value.origins == ("https://portal.example",)
