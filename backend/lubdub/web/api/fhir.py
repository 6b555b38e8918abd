"""REST: a case in the words of FHIR R4, and what our own codes in it mean."""

from __future__ import annotations

import json
from collections.abc import Mapping
from datetime import datetime
from typing import Annotated, Any

from fastapi import APIRouter, Depends, Path
from fastapi.responses import Response

from lubdub import __version__
from lubdub.cases.states import HAS_RESULT
from lubdub.cases.values import Case
from lubdub.report.fhir import FhirCase, Signature, fhir_bundle
from lubdub.report.fhir_codes import Codes
from lubdub.settings import Settings
from lubdub.web.api.cases import USUAL, CaseId
from lubdub.web.api.results import result_of
from lubdub.web.conditional import UNCHANGED, ConditionalRoute
from lubdub.web.deps import BEARER, FilesDep, ReaderDep, ReviewsDep, SettingsDep, StoreDep
from lubdub.web.problems import Problem

MEDIA_TYPE = "application/fhir+json"
RESOURCE: dict[int | str, dict[str, Any]] = {
    200: {"content": {MEDIA_TYPE: {"schema": {"type": "object"}}}, "description": "A resource of FHIR R4."}
}

router = APIRouter(tags=["fhir"], dependencies=[Depends(BEARER)], responses=USUAL, route_class=ConditionalRoute)
public = APIRouter(include_in_schema=False)

CodeSystemName = Annotated[str, Path(max_length=64)]


@router.get("/cases/{case_id}/fhir", response_class=Response, responses=RESOURCE | UNCHANGED)
def read_bundle(
    case_id: CaseId,
    actor: ReaderDep,
    store: StoreDep,
    files: FilesDep,
    reviews: ReviewsDep,
    settings: SettingsDep,
) -> Response:
    """The case as a bundle: `Task`, `Consent` where it is known, and once there is a result four `BodyStructure`s,
    their `Observation`s, `DiagnosticReport`, `DocumentReference` and `Provenance`; preliminary until it is signed."""
    case = store.note_reading(actor, case_id, "fhir.read")
    result = result_of(case, actor, files, reviews) if case.status in HAS_RESULT else None
    return Response(fhir_bundle(_told(case, settings, result), codes_of(settings)), media_type=MEDIA_TYPE)


@public.get("/fhir/CodeSystem/{name}")
def read_code_system(name: CodeSystemName, settings: SettingsDep) -> Response:
    """What our codes mean; for everybody."""
    known = codes_of(settings).code_systems()
    if name not in known:
        raise Problem("page-not-found", "There is no such code system.")
    return Response(json.dumps(known[name]), media_type=MEDIA_TYPE)


@public.get("/fhir/ConceptMap/listening-area-to-snomed")
def read_concept_map(settings: SettingsDep) -> Response:
    """How our four codes relate to SNOMED CT, where this service gives SNOMED CT codings at all."""
    if not settings.snomed:
        raise Problem("page-not-found", "This service gives no SNOMED CT codings.")
    return Response(json.dumps(codes_of(settings).concept_map()), media_type=MEDIA_TYPE)


def codes_of(settings: Settings) -> Codes:
    """The codings this service gives."""
    return Codes(settings.fhir_names.rstrip("/"), settings.snomed)


def _told(case: Case, settings: Settings, result: Mapping[str, Any] | None) -> FhirCase:
    return FhirCase(
        id=case.id,
        status=case.status,
        external_id=case.external_id,
        sex=case.sex,
        is_sample=case.person == "sample",
        created_at=case.created_at,
        updated_at=case.updated_at,
        address=f"{settings.address}/api/v1/cases/{case.id}",
        version=__version__,
        reason=case.reason,
        result=None if result is None else _as_signed(result),
        consent=case.consent,
        signed=_signature(result),
    )


def _signature(result: Mapping[str, Any] | None) -> Signature | None:
    review = (result or {}).get("review")
    return None if review is None else Signature(review["by"], datetime.fromisoformat(review["at"]))


def _as_signed(result: Mapping[str, Any]) -> Mapping[str, Any]:
    """The result with the clinician's places in place of the computed ones, where they were moved."""
    moved = (result.get("review") or {}).get("areas", {})
    said = ("position", "normal", "instruction")
    areas = {
        name: {**area, **{word: moved[name][word] for word in said if name in moved}}
        for name, area in result.get("areas", {}).items()
    }
    return {**result, "areas": areas}
