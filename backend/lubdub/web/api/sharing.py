"""REST: a family's separate yes to keeping the bare shape as a reference body, as a portal holds it."""

from __future__ import annotations

from fastapi import APIRouter, Depends

from lubdub.web.api.cases import USUAL, CaseId
from lubdub.web.conditional import UNCHANGED, ConditionalRoute
from lubdub.web.deps import BEARER, PortalReaderDep, PortalWriterDep, ServicesDep
from lubdub.web.schemas import SharingIn, SharingOut, problems

router = APIRouter(tags=["cases"], dependencies=[Depends(BEARER)], responses=USUAL, route_class=ConditionalRoute)
PATH = "/cases/{case_id}/sharing"


@router.get(PATH, responses=UNCHANGED)
def read_sharing(case_id: CaseId, actor: PortalReaderDep, held: ServicesDep) -> SharingOut:
    """Whether the family has agreed, to which words, and when."""
    return SharingOut.of(held.sharing.read(actor, case_id))


@router.put(PATH, responses=problems("state-conflict", "too-large"))
def agree_to_sharing(case_id: CaseId, said: SharingIn, actor: PortalWriterDep, held: ServicesDep) -> SharingOut:
    """Keep the family's yes, in place of one sent before. It is another than the yes to the scan, and never needed
    for a result; it may come at any time, and counts once a clinician has signed."""
    return SharingOut.of(held.sharing.keep(actor, case_id, said.to_value()))


@router.delete(PATH)
def take_sharing_back(case_id: CaseId, actor: PortalWriterDep, held: ServicesDep) -> SharingOut:
    """The family takes it back: a body made of the case is removed within the hour."""
    held.sharing.take_back(actor, case_id)
    return SharingOut.of(None)
