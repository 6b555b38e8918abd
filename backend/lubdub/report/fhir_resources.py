"""The resources of a case's FHIR bundle, one function each, as plain JSON values."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from lubdub.report.fhir_codes import Codes
from lubdub.results import AreaName

if TYPE_CHECKING:
    from lubdub.report.fhir import FhirCase

UCUM = "http://unitsofmeasure.org"
SITE_EXTENSION = "http://hl7.org/fhir/StructureDefinition/bodySite"
"""HL7's own extension: the BodyStructure an Observation is about."""
TASK_STATUS = {
    "awaiting_scan": "requested",
    "checking": "in-progress",
    "awaiting_landmarks": "on-hold",
    "queued": "in-progress",
    "running": "in-progress",
    "refused": "rejected",
    "returned": "rejected",
    "unusable": "rejected",
    "failed": "failed",
}
"""Every other state has a result: completed."""
QUALITY = {
    "surface_residual_mm": ("surface-residual", "mm", "mm", 1.0),
    "landmark_residual_mm": ("landmark-residual", "mm", "mm", 1.0),
    "coverage": ("coverage", "%", "%", 100.0),
    "spread_mm": ("spread", "mm", "mm", 1.0),
}
"""A number of the result: our code, unit, UCUM code, factor."""
BONES = {"suprasternal_notch": "distance-suprasternal-notch", "xiphisternum": "distance-xiphisternum"}


class BundleParts:
    """The resources of one case."""

    def __init__(self, case: FhirCase, codes: Codes) -> None:
        """Of this case, in these codes."""
        self._case = case
        self._codes = codes
        self._result: Mapping[str, Any] = case.result or {}
        self._status = "preliminary" if case.signed is None else "final"
        self._subject = {"reference": case.full_url("patient")}

    def patient(self) -> dict[str, Any]:
        """Nobody's name: the sex that was said, and the case's own numbers to find the patient by."""
        sex = {} if self._case.sex is None else {"gender": self._case.sex}
        return {"resourceType": "Patient", "identifier": self._identifiers(), **sex}

    def task(self) -> dict[str, Any]:
        """What was asked, and how far it is."""
        case = self._case
        said: dict[str, Any] = {
            "resourceType": "Task",
            "identifier": self._identifiers(),
            "status": TASK_STATUS.get(case.status, "completed"),
            "businessStatus": {"text": case.status},
            "intent": "order",
            "code": self._codes.measure("locate-areas"),
            "for": self._subject,
            "authoredOn": case.created_at.isoformat(),
            "lastModified": case.updated_at.isoformat(),
            "reasonCode": self._codes.auscultation(),
        }
        if case.reason is not None:
            said["statusReason"] = {"text": f"{case.reason['message']} {case.reason['advice']}"}
        if case.has_areas:
            report = {"reference": case.full_url("report")}
            said["output"] = [{"type": self._codes.measure("placement-report"), "valueReference": report}]
        return said

    def site(self, area: AreaName) -> dict[str, Any]:
        """The place on this patient, in words a finger can follow."""
        return {
            "resourceType": "BodyStructure",
            "active": True,
            "location": self._codes.area(area),
            "description": self._result["areas"][area]["instruction"],
            "patient": self._subject,
        }

    def place(self, area: AreaName) -> dict[str, Any]:
        """The same place in numbers: coordinates, region, and straight distances to the bones a finger can feel."""
        found = self._result["areas"][area]
        unit = self._result["unit"]
        components = [
            self._component(axis, value, unit["name"], unit["name"])
            for axis, value in zip("xyz", found["position"], strict=True)
        ]
        components.append(self._component("radius", found["radius_mm"], "mm", "mm"))
        for bone, code in BONES.items():
            if mark := self._result["landmarks"].get(bone):
                distance = math.dist(found["position"], mark["position"]) * unit["mm_per_unit"]
                components.append(self._component(code, round(distance, 1), "mm", "mm"))
        site = {"url": SITE_EXTENSION, "valueReference": {"reference": self._case.full_url(f"site-{area}")}}
        return self._observation("listening-area", components) | {
            "bodySite": self._codes.area(area),
            "extension": [site],
        }

    def quality(self) -> dict[str, Any]:
        """How well the fit went; what a method does not measure is left out."""
        measured = self._result["quality"]
        components = [
            self._component(code, round(measured[name] * factor, 2), unit, ucum)
            for name, (code, unit, ucum, factor) in QUALITY.items()
            if measured.get(name) is not None
        ]
        return self._observation("fit-quality", components)

    def report(self) -> dict[str, Any]:
        """The summary, with the sheet to print."""
        case = self._case
        names = [*(f"place-{area}" for area in self._result["areas"]), "quality"]
        said: dict[str, Any] = {
            "resourceType": "DiagnosticReport",
            "identifier": self._identifiers(),
            "status": self._status,
            "code": self._codes.measure("placement-report"),
            "subject": self._subject,
            "effectiveDateTime": case.updated_at.isoformat(),
            "issued": case.updated_at.isoformat(),
            "result": [{"reference": case.full_url(name)} for name in names],
            "conclusion": self._conclusion(),
            "presentedForm": [self._attachment("sheet.pdf", "application/pdf", "The four places, to print")],
        }
        if case.signed is not None:
            said["resultsInterpreter"] = [{"display": case.signed.who}]
        return said

    def document(self) -> dict[str, Any]:
        """Where the map and the surface are to be had."""
        files = (
            ("sheet.pdf", "application/pdf", "The four places, to print"),
            ("view.html", "text/html", "The body in 3D with the four places"),
            ("scan.ply", "application/octet-stream", "The cleaned skin as PLY"),
        )
        return {
            "resourceType": "DocumentReference",
            "identifier": self._identifiers(),
            "status": "current",
            "docStatus": self._status,
            "type": self._codes.measure("placement-report"),
            "subject": self._subject,
            "date": self._case.updated_at.isoformat(),
            "content": [{"attachment": self._attachment(*file)} for file in files],
        }

    def provenance(self) -> dict[str, Any]:
        """Which program with which references made this, and who signed it: all that a repeat needs."""
        case = self._case
        targets = [*(f"site-{area}" for area in self._result["areas"]), "report", "document"]
        agents = [{"type": _coded("assembler", "Assembler"), "who": {"display": f"Lubdub {case.version}"}}]
        if case.signed is not None:
            agents.append({"type": _coded("verifier", "Verifier"), "who": {"display": case.signed.who}})
        method = [f"{name}: {value}" for name, value in self._result["method"].items()]
        references = [f"reference body: {one['id']}" for one in self._result["references"]]
        return {
            "resourceType": "Provenance",
            "target": [{"reference": case.full_url(name)} for name in targets],
            "recorded": (case.updated_at if case.signed is None else case.signed.at).isoformat(),
            "agent": agents,
            "entity": [{"role": "source", "what": {"display": words}} for words in (*method, *references)],
        }

    def consent(self, consent: Mapping[str, str | None]) -> dict[str, Any]:
        """The yes to taking and keeping the scan."""
        words = f"The words agreed to: version {consent['version']}, read in {consent['language']}."
        child = {"agreed": " The child agreed.", "too_young": " The child was too young to be asked."}
        return {
            "resourceType": "Consent",
            "status": "active",
            "scope": _from("http://terminology.hl7.org/CodeSystem/consentscope", "treatment", "Treatment"),
            "category": [_from("http://loinc.org", "59284-0", "Consent Document")],
            "patient": self._subject,
            "dateTime": consent["given_at"],
            "policyRule": {"text": words + child.get(consent.get("child") or "", "")},
        }

    def _conclusion(self) -> str:
        areas = self._result["areas"]
        told = [f"{name.capitalize()}: {found['instruction']}" for name, found in areas.items()]
        cares = [f"{reason['message']} {reason['advice']}" for reason in self._result["reasons"]]
        signed = self._case.signed
        word = (
            "Estimated from a scan; not confirmed by a clinician."
            if signed is None
            else f"Confirmed by {signed.who} on {signed.at:%Y-%m-%d}."
        )
        return "\n".join([word, *cares, *told])

    def _observation(self, code: str, components: list[dict[str, Any]]) -> dict[str, Any]:
        category = "http://terminology.hl7.org/CodeSystem/observation-category"
        return {
            "resourceType": "Observation",
            "status": self._status,
            "category": [_from(category, "exam", "Exam")],
            "code": self._codes.measure(code),
            "subject": self._subject,
            "effectiveDateTime": self._case.updated_at.isoformat(),
            "component": components,
        }

    def _component(self, code: str, value: float, unit: str, ucum: str) -> dict[str, Any]:
        quantity = {"value": value, "unit": unit, "system": UCUM, "code": ucum}
        return {"code": self._codes.measure(code), "valueQuantity": quantity}

    def _attachment(self, name: str, media_type: str, title: str) -> dict[str, Any]:
        return {"contentType": media_type, "url": f"{self._case.address}/{name}", "title": title}

    def _identifiers(self) -> list[dict[str, Any]]:
        own = {"system": f"{self._codes.base}/case", "value": self._case.id}
        if self._case.external_id is None:
            return [own]
        return [own, {"system": f"{self._codes.base}/external-id", "value": self._case.external_id}]


def _from(system: str, code: str, display: str) -> dict[str, Any]:
    return {"coding": [{"system": system, "code": code, "display": display}]}


def _coded(code: str, display: str) -> dict[str, Any]:
    return _from("http://terminology.hl7.org/CodeSystem/provenance-participant-type", code, display)
