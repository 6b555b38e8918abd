"""REST: made-up bodies, for trying out. A sandbox's cases take no others."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Depends, Path, Response

from lubdub.web.deps import BEARER, ReaderDep
from lubdub.web.pages.samples import all_samples
from lubdub.web.problems import Problem
from lubdub.web.schemas import SampleOut, SamplesOut, problems

USUAL = problems("not-signed-in", "scope-missing", "cross-site", "sample-not-found", "invalid-input")

router = APIRouter(
    tags=["samples"],
    dependencies=[Depends(BEARER)],
    responses=USUAL | problems("too-many-requests", "bad-request"),
)

SampleName = Annotated[str, Path(max_length=64, description="The sample's name, from the list of samples.")]


@router.get("/samples")
def list_samples(actor: ReaderDep) -> SamplesOut:
    """Made-up bodies: who each of them is, and where its landmarks are, in the coordinates of its file."""
    return SamplesOut(items=[SampleOut.of(one) for one in all_samples()])


@router.get(
    "/samples/{name}/scan",
    response_class=Response,
    responses={
        200: {
            "content": {"application/octet-stream": {"schema": {"type": "string", "format": "binary"}}},
            "description": "The scan's file.",
        }
    },
)
def read_sample(name: SampleName, actor: ReaderDep) -> Response:
    """A made-up body's scan, to be sent like a real one."""
    for one in all_samples():
        if one.name == name:
            return Response(one.scan.read_bytes(), media_type="application/octet-stream")
    raise Problem("sample-not-found", "There is no sample of this name.")
