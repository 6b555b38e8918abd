"""Opening the room: database and vault together, or one sentence that says what is in the way."""

from __future__ import annotations

from pathlib import Path

from obstore.exceptions import BaseError as StoreError
from sqlalchemy.exc import SQLAlchemyError

from lubdub.cases.database import Database, DatabaseTooNew
from lubdub.cases.files import FileVault
from lubdub.cases.master_key import MasterKeyUnusable, NamesMasterKey


class CannotOpen(Exception):
    """The service cannot start. The text is one sentence for the person who runs it."""


def open_database(database_url: str) -> Database:
    """The database, made or upgraded when needed. Raises CannotOpen."""
    try:
        return Database(database_url)
    except DatabaseTooNew as error:
        raise CannotOpen(
            f"The database was upgraded by a newer Lubdub (to {error}). Use that version, or restore a backup made by "
            "this one."
        ) from error
    except SQLAlchemyError as error:
        raise CannotOpen("The database cannot be opened. Is it running, and is LUBDUB_DATABASE_URL right?") from error
    except OSError as error:
        raise _not_writable(error) from error


def open_cases(database_url: str, store_url: str, master_key: NamesMasterKey | Path) -> tuple[Database, FileVault]:
    """The database and the vault. Raises CannotOpen."""
    database = open_database(database_url)
    try:
        return database, FileVault(database, store_url, master_key)
    except MasterKeyUnusable as error:
        raise CannotOpen(str(error)) from error
    except (StoreError, ValueError) as error:
        raise CannotOpen("The store of files cannot be opened. Is LUBDUB_STORE_URL right?") from error
    except OSError as error:
        raise _not_writable(error) from error


def _not_writable(error: OSError) -> CannotOpen:
    return CannotOpen(f"The data folder cannot be used ({error.strerror}). Choose another one with LUBDUB_DATA_DIR.")
