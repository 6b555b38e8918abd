"""Scans that arrive in pieces and may stop on the way: what is here stays, sealed, until the rest comes."""

from __future__ import annotations

import secrets
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta

import sqlalchemy as sa
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session

from lubdub.cases.clock import now
from lubdub.cases.database import Database
from lubdub.cases.errors import CaseNotFound, UploadNotFound, WrongOffset
from lubdub.cases.files import FileVault, Sealed, SealedWriter
from lubdub.cases.models import UploadPartRow, UploadRow
from lubdub.cases.rows import find
from lubdub.cases.values import Actor

KEPT = timedelta(hours=24)
"""How long an upload waits for its next piece; each piece gives it the whole time again."""


@dataclass(frozen=True)
class Upload:
    """A scan on its way in. length, offset: bytes promised and bytes here; unit: m, cm, mm, or None to find it."""

    id: str
    case_id: str
    length: int
    offset: int
    unit: str | None
    expires_at: datetime

    @property
    def is_whole(self) -> bool:
        """Whether all of it is here."""
        return self.offset == self.length


class Uploads:
    """Uploads as their case's owner sees them; for everybody else they are not there (UploadNotFound)."""

    def __init__(self, database: Database, vault: FileVault) -> None:
        """Over an open database and the vault that seals."""
        self._database = database
        self._vault = vault

    def begin(self, actor: Actor, case_id: str, length: int, unit: str | None) -> Upload:
        """A new upload for the case; an unfinished one it had is dropped. Raises CaseNotFound."""
        row = UploadRow(id=secrets.token_hex(16), case_id=case_id, length=length, unit=unit, expires_at=now() + KEPT)
        with self._database.writing() as session:
            find(session, actor, case_id, to_change=True)
            dropped = drop_uploads(session, UploadRow.case_id == case_id)
            session.add(row)
            session.flush()
            begun = _value(session, row)
        self._vault.discard(case_id, [object_key for _, object_key in dropped])
        return begun

    def get(self, actor: Actor, upload_id: str) -> Upload:
        """How far it has come."""
        with self._database.reading() as session:
            return _value(session, _find(session, actor, upload_id))

    def writer(self, upload: Upload) -> SealedWriter:
        """For the next piece; hand what was written to `keep`."""
        return self._vault.writer(upload.case_id, "part of scan")

    def keep(self, actor: Actor, upload: Upload, piece: Sealed) -> Upload:
        """Put a written piece at the end. Raises WrongOffset when another piece was quicker; this one is dropped."""
        try:
            with self._database.writing() as session:
                row = _find(session, actor, upload.id)
                if _value(session, row).offset != upload.offset:
                    raise WrongOffset(upload.id)
                session.add(
                    UploadPartRow(upload_id=row.id, start=upload.offset, object_key=piece.object_key, size=piece.size)
                )
                row.expires_at = now() + KEPT
                session.flush()
                return _value(session, row)
        except IntegrityError as error:
            self._vault.discard(upload.case_id, [piece.object_key])
            raise WrongOffset(upload.id) from error
        except (CaseNotFound, UploadNotFound, WrongOffset):
            self._vault.discard(upload.case_id, [piece.object_key])
            raise

    def join(self, upload: Upload) -> Sealed:
        """The whole scan as one sealed file, ready to be attached; the pieces stay until `end`."""
        with self._database.reading() as session:
            pieces = _pieces(session, upload.id)
        writer = self._vault.writer(upload.case_id, "scan")
        try:
            for object_key in pieces:
                for chunk in self._vault.stream_object(upload.case_id, "part of scan", object_key):
                    writer.write(chunk)
            return writer.finish()
        except BaseException:
            writer.abort()
            raise

    def end(self, actor: Actor, upload_id: str) -> None:
        """Forget the upload and its pieces."""
        with self._database.writing() as session:
            row = _find(session, actor, upload_id)
            dropped = drop_uploads(session, UploadRow.id == row.id)
        self._discard(dropped)

    def forget_abandoned(self) -> None:
        """Drop every upload that waited too long."""
        with self._database.writing() as session:
            dropped = drop_uploads(session, UploadRow.expires_at < now())
        self._discard(dropped)

    def _discard(self, dropped: Sequence[tuple[str, str]]) -> None:
        for case_id, object_key in dropped:
            self._vault.discard(case_id, [object_key])


def drop_uploads(session: Session, which: sa.ColumnElement[bool]) -> list[tuple[str, str]]:
    """Forget these uploads inside the caller's transaction; returns (case, object) of every piece."""
    pieces = sa.select(UploadRow.case_id, UploadPartRow.object_key).join(
        UploadPartRow, UploadPartRow.upload_id == UploadRow.id
    )
    dropped = [(case_id, object_key) for case_id, object_key in session.execute(pieces.where(which))]
    ended = sa.select(UploadRow.id).where(which)
    session.execute(sa.delete(UploadPartRow).where(UploadPartRow.upload_id.in_(ended)))
    session.execute(sa.delete(UploadRow).where(which))
    return dropped


def _find(session: Session, actor: Actor, upload_id: str) -> UploadRow:
    row = session.get(UploadRow, upload_id)
    if row is None or row.expires_at < now():
        raise UploadNotFound(upload_id)
    find(session, actor, row.case_id)
    return row


def _pieces(session: Session, upload_id: str) -> list[str]:
    query = sa.select(UploadPartRow.object_key).where(UploadPartRow.upload_id == upload_id)
    return list(session.scalars(query.order_by(UploadPartRow.start)))


def _value(session: Session, row: UploadRow) -> Upload:
    here = session.scalar(
        sa.select(sa.func.coalesce(sa.func.sum(UploadPartRow.size), 0)).where(UploadPartRow.upload_id == row.id)
    )
    return Upload(row.id, row.case_id, row.length, int(here or 0), row.unit, row.expires_at)
