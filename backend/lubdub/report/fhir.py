"""A case as a FHIR R4 bundle: what was asked, the four places on this body, how good they are, and who vouches."""

from __future__ import annotations

import uuid
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from fhir.resources.R4B.bundle import Bundle

from lubdub.report.fhir_codes import Codes
from lubdub.report.fhir_resources import BundleParts

NAMESPACE = uuid.UUID("5b0a3f53-6f6e-4a0e-9a55-1f5f2f6c8d11")
"""Resources of one case always have the same ids: what was imported once is recognised."""
TEST_DATA = {
    "system": "http://terminology.hl7.org/CodeSystem/v3-ActReason",
    "code": "HTEST",
    "display": "test health data",
}


@dataclass(frozen=True)
class Signature:
    """A clinician's word that the places are right. who: as shown to others."""

    who: str
    at: datetime


@dataclass(frozen=True)
class FhirCase:
    """What a bundle says of a case.

    status: as REST says it; result: the document of `result_json`, None before the end; reason: why nothing is shown;
    address: of the case in REST; consent: version, language, given_at and child, None when others keep it.
    """

    id: str
    status: str
    external_id: str | None
    sex: str | None
    is_sample: bool
    created_at: datetime
    updated_at: datetime
    address: str
    version: str
    reason: Mapping[str, str] | None = None
    result: Mapping[str, Any] | None = None
    consent: Mapping[str, str | None] | None = None
    signed: Signature | None = None

    @property
    def has_areas(self) -> bool:
        """Whether four places are shown."""
        return bool(self.result and self.result.get("areas"))

    def full_url(self, name: str) -> str:
        """The address, within the bundle, of its resource of this name."""
        return f"urn:uuid:{uuid.uuid5(NAMESPACE, f'{self.id}/{name}')}"


def fhir_bundle(case: FhirCase, codes: Codes) -> str:
    """The bundle as JSON text, checked against the model of R4B, whose resources used here are those of R4.

    Nothing is final before a clinician has signed. Raises ValueError when it would not be valid.
    """
    parts = BundleParts(case, codes)
    resources: dict[str, dict[str, Any]] = {"patient": parts.patient(), "task": parts.task()}
    if case.consent is not None:
        resources["consent"] = parts.consent(case.consent)
    if case.result is not None and case.has_areas:
        for name in case.result["areas"]:
            resources[f"site-{name}"] = parts.site(name)
            resources[f"place-{name}"] = parts.place(name)
        resources["quality"] = parts.quality()
        resources["report"] = parts.report()
        resources["document"] = parts.document()
        resources["provenance"] = parts.provenance()
    entries = [
        {"fullUrl": case.full_url(name), "resource": _identified(case, name, one)} for name, one in resources.items()
    ]
    bundle = {
        "resourceType": "Bundle",
        "type": "collection",
        "timestamp": case.updated_at.isoformat(),
        "identifier": {"system": "urn:ietf:rfc:3986", "value": case.full_url("bundle")},
        "entry": entries,
    }
    return Bundle.model_validate(_marked(case, bundle)).model_dump_json()


def _identified(case: FhirCase, name: str, resource: dict[str, Any]) -> dict[str, Any]:
    return _marked(case, resource | {"id": case.full_url(name).removeprefix("urn:uuid:")})


def _marked(case: FhirCase, resource: dict[str, Any]) -> dict[str, Any]:
    """The resource, called test data when its case is made up."""
    return resource | {"meta": {"tag": [TEST_DATA]}} if case.is_sample else resource
