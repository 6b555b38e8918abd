"""The keyring: the one file that opens all backups of a service, and of which only the newest may exist.

A backup holds no keys. The keys of the cases that still live are here, sealed under the master key, and so are the
receipts of those that were deleted. Every backup replaces the file; with the key of a deleted case gone from it, that
case cannot be read in any backup, however old. So it is kept apart from the backups, and never in several versions.
"""

from __future__ import annotations

import base64
import json
import os
import secrets
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import sqlalchemy as sa

from lubdub.cases.clock import now
from lubdub.cases.database import Database
from lubdub.cases.errors import SealBroken
from lubdub.cases.key_chain import NOTES, KeyChain, unwrapped
from lubdub.cases.models import CaseKeyRow, CaseRow

FORMAT = 1


class KeyringUnusable(Exception):
    """The text is one sentence for the person who runs the service."""


@dataclass(frozen=True)
class Keyring:
    """All keys are sealed under a master key. backups: id of a backup -> its key; deletions: case -> its receipt."""

    notes: bytes
    backups: dict[str, bytes] = field(default_factory=dict)
    cases: dict[str, bytes] = field(default_factory=dict)
    deletions: dict[str, dict[str, str]] = field(default_factory=dict)

    def to_bytes(self) -> bytes:
        """As it is kept."""
        said: dict[str, Any] = {"format": FORMAT, "written_at": now().isoformat(), "deletions": self.deletions}
        said["notes"] = base64.b64encode(self.notes).decode()
        for name, keys in (("backups", self.backups), ("cases", self.cases)):
            said[name] = {about: base64.b64encode(key).decode() for about, key in keys.items()}
        return json.dumps(said).encode()

    @classmethod
    def read(cls, path: Path) -> Keyring:
        """What `write` wrote. Raises KeyringUnusable."""
        try:
            said = json.loads(path.read_bytes())
            if said["format"] != FORMAT:
                raise KeyringUnusable(f"The keyring {path.name} was written by another version of Lubdub.")
            keys = {
                name: {about: base64.b64decode(key) for about, key in said[name].items()}
                for name in ("backups", "cases")
            }
            return cls(base64.b64decode(said["notes"]), keys["backups"], keys["cases"], said["deletions"])
        except FileNotFoundError as error:
            raise KeyringUnusable(
                f"There is no keyring {path}. A backup opens only with it: name the newest one with --keyring FILE."
            ) from error
        except OSError as error:
            raise KeyringUnusable(f"The keyring {path.name} cannot be read ({error.strerror}).") from error
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            raise KeyringUnusable(f"{path.name} is no keyring, or it is damaged.") from error

    def write(self, path: Path) -> None:
        """Put it in place of the one before, whole or not at all."""
        draft = path.with_name(f".{path.name}.{secrets.token_hex(4)}")
        descriptor = os.open(draft, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
        try:
            with os.fdopen(descriptor, "wb") as file:
                file.write(self.to_bytes())
                file.flush()
                os.fsync(file.fileno())
            os.replace(draft, path)
        except BaseException:
            draft.unlink(missing_ok=True)
            raise


def renewed(database: Database, keys: KeyChain, path: Path) -> Keyring:
    """The keyring as it must be now: older backups' keys out of the one at path, cases as they are.

    Everything is sealed under the current master key. Raises KeyringUnusable.
    """
    backups = {}
    if path.exists():
        before = Keyring.read(path)
        try:
            backups = {about: keys.wrap(keys.unwrap(key, about), about) for about, key in before.backups.items()}
        except SealBroken as error:
            raise KeyringUnusable(
                f"The keyring {path.name} belongs to another service. Name another file with --keyring FILE."
            ) from error
    with database.reading() as session:
        sealed = session.execute(sa.select(CaseKeyRow.case_id, CaseKeyRow.wrapped_key)).all()
        gone = session.execute(
            sa.select(CaseRow.id, CaseRow.tenant_id, CaseRow.created_at, CaseRow.deleted_at, CaseRow.receipt_sha256)
            .where(CaseRow.deleted_at.is_not(None))
            .order_by(CaseRow.deleted_at)
        ).all()
    cases = {case_id: keys.wrap(keys.unwrap(wrapped, case_id), case_id) for case_id, wrapped in sealed}
    deletions = {
        row.id: {
            "tenant_id": row.tenant_id,
            "created_at": row.created_at.isoformat(),
            "deleted_at": row.deleted_at.isoformat(),
            "receipt_sha256": row.receipt_sha256 or "",
        }
        for row in gone
    }
    return Keyring(keys.wrap(keys.notes, NOTES), backups, cases, deletions)


def opened_backup(keyring: Keyring, masters: tuple[bytes, ...], backup_id: str) -> bytes:
    """A backup's key. Raises KeyringUnusable."""
    if backup_id not in keyring.backups:
        raise KeyringUnusable("This keyring is older than the backup, or another service's: use the newest one.")
    try:
        return unwrapped(masters, keyring.backups[backup_id], backup_id)
    except SealBroken as error:
        raise KeyringUnusable(
            "The master key does not open this keyring. Put the service's own master key in its place."
        ) from error
