"""REST: a scan sent in pieces that may stop and go on, by the tus protocol 1.0.0 (https://tus.io/protocols)."""

from __future__ import annotations

import base64
import binascii
from email.utils import format_datetime
from typing import Annotated, get_args

from fastapi import APIRouter, Depends, Header, Path, Request, Response
from starlette.concurrency import run_in_threadpool
from starlette.requests import ClientDisconnect

from lubdub.cases.files import Sealed
from lubdub.cases.uploads import Upload, Uploads
from lubdub.cases.values import Actor
from lubdub.web.actions import UnitName
from lubdub.web.api.cases import REFUSED_SCAN, USUAL
from lubdub.web.deps import BEARER, ActionsDep, QuotasDep, ReaderDep, SettingsDep, StoreDep, UploadsDep, WriterDep
from lubdub.web.limits import MEGABYTE
from lubdub.web.problems import Problem
from lubdub.web.schemas import problems

VERSION = "1.0.0"
PIECE = "application/offset+octet-stream"
PATIENT = {"Cache-Control": "no-store", "Tus-Resumable": VERSION}


def _speaks(
    tus_resumable: Annotated[str, Header(alias="Tus-Resumable", description="The protocol's version: 1.0.0.")] = "",
) -> None:
    if tus_resumable != VERSION:
        raise Problem("tus-version", f"Send the header Tus-Resumable: {VERSION}.", {"Tus-Version": VERSION})


router = APIRouter(tags=["uploads"], dependencies=[Depends(BEARER)], responses=USUAL | problems("too-large"))
SPOKEN = [Depends(_speaks)]
UploadId = Annotated[str, Path(max_length=64, description="The upload's id, from the Location it was given.")]
UploadLength = Annotated[int, Header(alias="Upload-Length", ge=1, description="The scan's size in bytes.")]
UploadOffset = Annotated[int, Header(alias="Upload-Offset", ge=0, description="Where this piece begins.")]
UploadMetadata = Annotated[
    str,
    Header(
        alias="Upload-Metadata",
        max_length=1000,
        description="`case` and, when known, `unit` (m, cm or mm), each followed by its value in Base64.",
    ),
]


@router.options("/uploads", status_code=204)
def read_upload_options(settings: SettingsDep) -> Response:
    """Which version and which extensions of tus are spoken here, and how large a scan may be."""
    told = {
        "Tus-Resumable": VERSION,
        "Tus-Version": VERSION,
        "Tus-Extension": "creation,expiration,termination",
        "Tus-Max-Size": str(settings.max_upload_mb * MEGABYTE),
    }
    return Response(status_code=204, headers=told)


@router.post(
    "/uploads",
    status_code=201,
    dependencies=SPOKEN,
    responses=problems("case-not-found", "state-conflict", "tus-version", "upload-quota"),
)
def begin_upload(
    actor: WriterDep,
    store: StoreDep,
    uploads: UploadsDep,
    settings: SettingsDep,
    quotas: QuotasDep,
    length: UploadLength,
    metadata: UploadMetadata,
) -> Response:
    """Begin an upload for a case. An unfinished one of the same case is dropped."""
    if length > settings.max_upload_mb * MEGABYTE:
        raise Problem("too-large", f"At most {settings.max_upload_mb} MB are taken in here.")
    said = parsed(metadata)
    if "case" not in said:
        raise Problem("bad-request", "Upload-Metadata must name the case.")
    unit = said.get("unit")
    if unit is not None and unit not in get_args(UnitName):
        raise Problem("bad-request", "The unit in Upload-Metadata must be m, cm or mm.")
    store.expect_scan(actor, said["case"])
    quotas.charge(actor, length)
    upload = uploads.begin(actor, said["case"], length, unit)
    return Response(status_code=201, headers={"Location": f"/api/v1/uploads/{upload.id}", **_standing(upload)})


@router.head("/uploads/{upload_id}", dependencies=SPOKEN, responses=problems("upload-not-found", "tus-version"))
def read_upload(upload_id: UploadId, actor: ReaderDep, uploads: UploadsDep) -> Response:
    """How much of the scan is here."""
    upload = uploads.get(actor, upload_id)
    return Response(headers={"Upload-Length": str(upload.length), **_standing(upload)})


@router.patch(
    "/uploads/{upload_id}",
    status_code=204,
    dependencies=SPOKEN,
    responses=problems("upload-not-found", "wrong-offset", "wrong-media-type", "tus-version", "state-conflict")
    | problems(*REFUSED_SCAN),
    openapi_extra={
        "requestBody": {"required": True, "content": {PIECE: {"schema": {"type": "string", "format": "binary"}}}}
    },
)
async def continue_upload(
    upload_id: UploadId,
    request: Request,
    actor: WriterDep,
    actions: ActionsDep,
    uploads: UploadsDep,
    offset: UploadOffset,
) -> Response:
    """The next piece. When the network breaks, what has arrived stays; with the last byte the scan is examined."""
    if request.headers.get("content-type") != PIECE:
        raise Problem("wrong-media-type", f"Send the piece as {PIECE}.")
    upload = await run_in_threadpool(uploads.get, actor, upload_id)
    if offset != upload.offset:
        raise Problem("wrong-offset", f"The upload stands at {upload.offset}.", _standing(upload))
    if not upload.is_whole:
        upload = await _take_in(request, actor, uploads, upload)
    if upload.is_whole:
        await actions.join_upload(actor, upload)
    return Response(status_code=204, headers=_standing(upload))


@router.delete(
    "/uploads/{upload_id}",
    status_code=204,
    dependencies=SPOKEN,
    responses=problems("upload-not-found", "tus-version"),
)
def stop_upload(upload_id: UploadId, actor: WriterDep, uploads: UploadsDep) -> Response:
    """Give the upload up; what has arrived is removed."""
    uploads.end(actor, upload_id)
    return Response(status_code=204, headers=PATIENT)


def parsed(metadata: str) -> dict[str, str]:
    """Upload-Metadata as a mapping: `key base64, key base64`. Raises Problem `bad-request`."""
    said = {}
    for pair in filter(None, (one.strip() for one in metadata.split(","))):
        key, _, value = pair.partition(" ")
        try:
            said[key] = base64.b64decode(value, validate=True).decode()
        except (binascii.Error, UnicodeDecodeError) as error:
            raise Problem("bad-request", "A value in Upload-Metadata is not Base64.") from error
    return said


async def _take_in(request: Request, actor: Actor, uploads: Uploads, upload: Upload) -> Upload:
    """Write the body as one more piece. A caller who is gone leaves what came so far."""
    writer = await run_in_threadpool(uploads.writer, upload)
    room = upload.length - upload.offset
    try:
        try:
            async for chunk in request.stream():
                if writer.size + len(chunk) > room:
                    raise Problem("too-large", f"Only {room} more bytes were promised.")
                await run_in_threadpool(writer.write, chunk)
                if request.app.state.is_stopping():
                    break  # told how far it came, the caller goes on elsewhere
        except ClientDisconnect:
            if not writer.size:
                raise
        piece: Sealed | None = await run_in_threadpool(writer.finish) if writer.size else None
    except BaseException:
        await run_in_threadpool(writer.abort)
        raise
    if piece is None:
        await run_in_threadpool(writer.abort)
        return upload
    return await run_in_threadpool(uploads.keep, actor, upload, piece)


def _standing(upload: Upload) -> dict[str, str]:
    expires = format_datetime(upload.expires_at, usegmt=True)
    return {"Upload-Offset": str(upload.offset), "Upload-Expires": expires, **PATIENT}
