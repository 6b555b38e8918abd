"""A case in FHIR R4: strangers' validators accept it, references lead somewhere, nothing is final before its time."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime
from typing import Any

import pytest

from lubdub.report.fhir import FhirCase, Signature, fhir_bundle
from lubdub.report.fhir_codes import SNOMED, Codes
from lubdub.results import AREA_NAMES
from tests.strangers import fhir_faults

OPENED, DONE = datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC), datetime(2026, 1, 2, 3, 9, 5, 678, tzinfo=UTC)
PLAIN, WITH_SNOMED = (Codes("https://lubdub.example/fhir", has) for has in (False, True))
RESULT: dict[str, Any] = {
    "verdict": "show_with_care",
    "reasons": [{"code": "sitting", "message": "The person sat.", "advice": "Lie down."}],
    "areas": {
        name: {"position": [0.1 * n, 0.2, 0.3], "normal": [0, 0, 1], "radius_mm": 9.0, "instruction": f"Go {n} cm."}
        for n, name in enumerate(AREA_NAMES, 1)
    },
    "landmarks": {"suprasternal_notch": {"position": [0.1, 0.26, 0.3], "source": "given", "uncertainty_mm": 6.0}},
    "unit": {"name": "m", "mm_per_unit": 1000.0, "source": "found"},
    "references": [{"id": "boy-06", "chamfer_mm": 3.0, "weight": 1.0}],
    "quality": {"surface_residual_mm": 1.4, "landmark_residual_mm": None, "coverage": 0.93, "spread_mm": 4.0},
    "method": {"version": "0.1.0", "solver": "cholmod", "parameters_sha256": "ab", "references_sha256": "cd"},
}
CASE = FhirCase(
    id="c0ffee",
    status="done",
    external_id="A-7",
    sex="female",
    is_sample=False,
    created_at=OPENED,
    updated_at=DONE,
    address="https://lubdub.example/api/v1/cases/c0ffee",
    version="0.1.0",
    result=RESULT,
    consent={"version": "3", "language": "en", "given_at": OPENED.isoformat(), "child": "agreed"},
)
SIGNED = replace(CASE, status="in_review", signed=Signature("Dr. Park", DONE))
REFUSED = replace(CASE, status="refused", result=None, reason={"code": "x", "message": "Mirrored.", "advice": "Again."})


def bundle(case: FhirCase, codes: Codes = PLAIN) -> dict[str, Any]:
    return dict(json.loads(fhir_bundle(case, codes)))


def of_kind(told: dict[str, Any], kind: str) -> list[dict[str, Any]]:
    return [entry["resource"] for entry in told["entry"] if entry["resource"]["resourceType"] == kind]


@pytest.mark.parametrize(
    ("case", "codes"),
    [
        (CASE, PLAIN),
        (SIGNED, WITH_SNOMED),
        (REFUSED, PLAIN),
        (replace(CASE, status="checking", result=None, consent=None, external_id=None, is_sample=True), PLAIN),
    ],
    ids=["done", "signed", "refused", "at work"],
)
def test_validators_of_strangers_accept_the_bundle(case: FhirCase, codes: Codes) -> None:
    assert fhir_faults(bundle(case, codes)) == []


def test_the_code_systems_and_the_map_are_valid_too() -> None:
    for resource in (*PLAIN.code_systems().values(), WITH_SNOMED.concept_map()):
        assert fhir_faults(resource) == []
    codes = PLAIN.code_systems()["listening-area"]["concept"]
    assert [concept["code"] for concept in codes] == list(AREA_NAMES)


def without_patient(told: dict[str, Any]) -> None:
    del of_kind(told, "BodyStructure")[0]["patient"]


def with_a_made_up_status(told: dict[str, Any]) -> None:
    of_kind(told, "Task")[0]["status"] = "nonsense"


def with_a_member_of_r5(told: dict[str, Any]) -> None:
    of_kind(told, "BodyStructure")[0]["includedStructure"] = [{"structure": {"text": "skin"}}]


def without_policy(told: dict[str, Any]) -> None:
    del of_kind(told, "Consent")[0]["policyRule"]


@pytest.mark.parametrize("spoil", [without_patient, with_a_made_up_status, with_a_member_of_r5, without_policy])
def test_the_validators_notice_what_is_wrong(spoil: Callable[[dict[str, Any]], None]) -> None:
    told = bundle(CASE)
    spoil(told)
    assert fhir_faults(told)


def test_the_bundle_holds_what_a_result_needs() -> None:
    told = bundle(CASE)
    kinds = [entry["resource"]["resourceType"] for entry in told["entry"]]
    assert {kind: kinds.count(kind) for kind in kinds} == {
        "Patient": 1,
        "Task": 1,
        "Consent": 1,
        "BodyStructure": 4,
        "Observation": 5,
        "DiagnosticReport": 1,
        "DocumentReference": 1,
        "Provenance": 1,
    }
    sites = [site["location"]["coding"][0]["code"] for site in of_kind(told, "BodyStructure")]
    assert sites == list(AREA_NAMES)
    place = of_kind(told, "Observation")[0]["component"]
    numbers = {one["code"]["coding"][0]["code"]: one["valueQuantity"] for one in place}
    assert (numbers["x"]["value"], numbers["x"]["code"]) == (0.1, "m")
    assert (numbers["distance-suprasternal-notch"]["value"], numbers["radius"]["value"]) == (60.0, 9.0)
    assert "distance-xiphisternum" not in numbers


def test_every_reference_leads_to_a_resource_of_the_bundle() -> None:
    told = bundle(SIGNED)
    addresses = {entry["fullUrl"] for entry in told["entry"]}
    assert len(addresses) == len(told["entry"])

    def references(value: Any) -> list[str]:
        if isinstance(value, dict):
            own = [value["reference"]] if isinstance(value.get("reference"), str) else []
            return own + [found for inner in value.values() for found in references(inner)]
        return [found for inner in value for found in references(inner)] if isinstance(value, list) else []

    assert references(told)
    assert set(references(told)) <= addresses


def test_nothing_is_final_before_somebody_signed() -> None:
    for case, status in ((CASE, "preliminary"), (SIGNED, "final")):
        told = bundle(case)
        assert {one["status"] for kind in ("Observation", "DiagnosticReport") for one in of_kind(told, kind)} == {
            status
        }
        assert of_kind(told, "DocumentReference")[0]["docStatus"] == status
    assert "not confirmed" in of_kind(bundle(CASE), "DiagnosticReport")[0]["conclusion"]
    assert "Confirmed by Dr. Park" in of_kind(bundle(SIGNED), "DiagnosticReport")[0]["conclusion"]


def test_a_refused_case_shows_no_place_and_says_why() -> None:
    told = bundle(REFUSED)
    assert {entry["resource"]["resourceType"] for entry in told["entry"]} == {"Patient", "Task", "Consent"}
    task = of_kind(told, "Task")[0]
    assert (task["status"], task["statusReason"]["text"]) == ("rejected", "Mirrored. Again.")


def test_snomed_stands_beside_our_codes_only_where_it_is_wanted() -> None:
    assert SNOMED not in json.dumps(bundle(CASE))
    told = json.dumps(bundle(CASE, WITH_SNOMED))
    assert SNOMED in told
    for valve in ("34202007", "39057004", "46030003", "91134007"):
        assert valve not in told


def test_made_up_cases_are_called_test_data() -> None:
    told = bundle(replace(CASE, is_sample=True))
    for resource in (told, *(entry["resource"] for entry in told["entry"])):
        assert resource["meta"]["tag"][0]["code"] == "HTEST"
    assert "HTEST" not in json.dumps(bundle(CASE))


def test_the_same_case_is_the_same_bundle_and_another_case_shares_no_id() -> None:
    assert fhir_bundle(CASE, PLAIN) == fhir_bundle(copy.deepcopy(CASE), PLAIN)
    mine, theirs = ({entry["fullUrl"] for entry in bundle(one)["entry"]} for one in (CASE, replace(CASE, id="decaf")))
    assert not mine & theirs
