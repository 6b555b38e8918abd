"""What the person who runs the service does by command: portal keys. All raise CannotOpen."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from lubdub.cases.opening import open_database
from lubdub.cases.people import SCOPES, People
from lubdub.cases.values import PortalKey


def create_key(database_url: str, name: str, scopes: Sequence[str] = SCOPES) -> tuple[PortalKey, str]:
    """A key for the portal called name, and its token, which is shown this once. Raises ValueError."""
    with _people(database_url) as people:
        return people.create_key(name, scopes)


def list_keys(database_url: str) -> list[PortalKey]:
    """All keys, oldest first."""
    with _people(database_url) as people:
        return people.list_keys()


def revoke_key(database_url: str, key_id: str) -> bool:
    """End a key. False when there is no such living key."""
    with _people(database_url) as people:
        return people.revoke_key(key_id)


@contextmanager
def _people(database_url: str) -> Iterator[People]:
    database = open_database(database_url)
    try:
        yield People(database)
    finally:
        database.close()
