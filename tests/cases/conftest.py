"""An open case store on every kind of database there is."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from lubdub.cases.database import Database
from lubdub.cases.files import FileVault
from lubdub.cases.people import People
from lubdub.cases.privacy import Privacy
from lubdub.cases.review import Reviews
from lubdub.cases.reviewing import Reviewer
from lubdub.cases.staff import Staff, Times, open_staff
from lubdub.cases.store import CaseStore
from lubdub.cases.values import Actor, NewCase
from lubdub.cases.work import WorkDesk
from tests.databases import fresh_database, kinds


@dataclass(frozen=True)
class Room:
    """Everything in the room `cases`, on one database."""

    url: str
    folder: Path
    database: Database
    vault: FileVault
    store: CaseStore
    desk: WorkDesk
    privacy: Privacy
    people: People
    reviews: Reviews
    staff: Staff

    def portal(self, name: str = "clinic") -> Actor:
        """Somebody with a key."""
        key, _ = self.people.create_key(name, ["cases:read", "cases:write"])
        return Actor("key", key.id, key.tenant_id)

    def clinician(self, portal: Actor, name: str = "Dr. Mori") -> Reviewer:
        """Somebody at the desk of a portal's organisation."""
        return Reviewer(Actor("clinician", name.lower(), portal.tenant_id), name)

    def family(self) -> Actor:
        """Somebody with a browser."""
        return self.people.open_session(1.0).actor


@pytest.fixture(params=kinds())
def room(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Room]:
    with fresh_database(request.param, tmp_path) as url:
        database = Database(url)
        vault = FileVault(database, (tmp_path / "files").as_uri(), tmp_path / "master.key")
        yield Room(
            url=url,
            folder=tmp_path,
            database=database,
            vault=vault,
            store=CaseStore(database, vault),
            desk=WorkDesk(database, vault),
            privacy=Privacy(database, vault),
            people=People(database),
            reviews=Reviews(database, vault),
            staff=open_staff(database, vault, Times()),
        )
        database.close()


def girl_of_six(**changes: object) -> NewCase:
    """A usual case."""
    said = {"age_years": 6.0, "sex": "female", "posture": "supine", "answers": {}} | changes
    return NewCase(**said)  # type: ignore[arg-type]
