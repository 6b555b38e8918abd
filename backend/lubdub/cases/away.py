"""The database or the store does not work for now: unreachable, full, or read-only. It passes; nothing is lost."""

from __future__ import annotations

from obstore.exceptions import BaseError as StoreError
from sqlalchemy.exc import DBAPIError, InterfaceError, OperationalError
from sqlalchemy.exc import TimeoutError as PoolTimeout

from lubdub.cases.errors import FileNotFound, SealBroken


def is_away(error: BaseException) -> bool:
    """Whether the same call may work later, when whoever runs the machine has put it right."""
    if isinstance(error, FileNotFound | SealBroken | FileNotFoundError):
        return False
    if isinstance(error, DBAPIError) and error.connection_invalidated:
        return True
    return isinstance(error, OperationalError | InterfaceError | PoolTimeout | StoreError | OSError)
