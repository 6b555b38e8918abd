"""Uploads in pieces: what is here stays sealed, in order, and goes when it should."""

from __future__ import annotations

from datetime import timedelta

import pytest
import sqlalchemy as sa

from lubdub.cases import uploads as uploads_room
from lubdub.cases.errors import CaseNotFound, UploadNotFound, WrongOffset
from lubdub.cases.models import UploadPartRow, UploadRow
from lubdub.cases.uploads import Upload, Uploads
from lubdub.cases.values import Actor
from tests.cases.conftest import Room, girl_of_six

SCAN = bytes(range(256)) * 9000


def add(uploads: Uploads, actor: Actor, upload: Upload, piece: bytes) -> Upload:
    writer = uploads.writer(upload)
    writer.write(piece)
    return uploads.keep(actor, upload, writer.finish())


def family(room: Room) -> Actor:
    return room.people.open_session(1.0).actor


def test_pieces_become_the_scan_in_the_order_they_came(room: Room) -> None:
    actor, uploads = family(room), Uploads(room.database, room.vault)
    case, _ = room.store.create(actor, girl_of_six())
    upload = uploads.begin(actor, case.id, len(SCAN), "mm")
    for start, end in ((0, 1), (1, 1_500_000), (1_500_000, len(SCAN))):
        assert uploads.get(actor, upload.id).offset == start
        upload = add(uploads, actor, upload, SCAN[start:end])
    assert upload.is_whole
    room.store.receive_scan(actor, case.id, uploads.join(upload), upload.unit)
    uploads.end(actor, upload.id)
    assert room.vault.read(case.id, "scan") == SCAN
    with room.database.reading() as session:
        assert session.scalars(sa.select(UploadPartRow)).all() == []


def test_a_piece_that_came_twice_counts_once(room: Room) -> None:
    actor, uploads = family(room), Uploads(room.database, room.vault)
    case, _ = room.store.create(actor, girl_of_six())
    upload = uploads.begin(actor, case.id, 10, None)
    assert add(uploads, actor, upload, b"12345").offset == 5
    with pytest.raises(WrongOffset):
        add(uploads, actor, upload, b"12345")
    assert uploads.get(actor, upload.id).offset == 5


def test_nobody_else_sees_an_upload(room: Room) -> None:
    actor, other, uploads = family(room), family(room), Uploads(room.database, room.vault)
    case, _ = room.store.create(actor, girl_of_six())
    upload = uploads.begin(actor, case.id, 10, None)
    with pytest.raises(CaseNotFound):
        uploads.get(other, upload.id)
    with pytest.raises(CaseNotFound):
        uploads.begin(other, case.id, 10, None)


def test_a_second_upload_of_a_case_replaces_the_first(room: Room) -> None:
    actor, uploads = family(room), Uploads(room.database, room.vault)
    case, _ = room.store.create(actor, girl_of_six())
    first = add(uploads, actor, uploads.begin(actor, case.id, 10, None), b"123")
    uploads.begin(actor, case.id, 10, None)
    with pytest.raises(UploadNotFound):
        uploads.get(actor, first.id)


def test_an_abandoned_upload_is_purged_with_its_bytes(room: Room, monkeypatch: pytest.MonkeyPatch) -> None:
    actor, uploads = family(room), Uploads(room.database, room.vault)
    case, _ = room.store.create(actor, girl_of_six())
    monkeypatch.setattr(uploads_room, "KEPT", timedelta(seconds=-1))
    writer = uploads.writer(uploads.begin(actor, case.id, 10, None))
    writer.write(b"123")
    piece = writer.finish()
    with room.database.writing() as session:
        upload_id = session.scalars(sa.select(UploadRow.id)).one()
        session.add(UploadPartRow(upload_id=upload_id, start=0, object_key=piece.object_key, size=3))
    with pytest.raises(UploadNotFound):
        uploads.get(actor, upload_id)
    room.privacy.purge(retention_days=7)
    with room.database.reading() as session:
        assert session.scalars(sa.select(UploadRow)).all() == []
    with pytest.raises(Exception, match="missing"):
        list(room.vault.stream_object(case.id, "part of scan", piece.object_key))


def test_deleting_a_case_takes_its_upload_along(room: Room) -> None:
    actor, uploads = family(room), Uploads(room.database, room.vault)
    case, _ = room.store.create(actor, girl_of_six())
    upload = add(uploads, actor, uploads.begin(actor, case.id, 10, None), b"123")
    room.privacy.delete(actor, case.id)
    with pytest.raises(UploadNotFound):
        uploads.get(actor, upload.id)
