"""The interface is what its OpenAPI document says: made-up calls get no undeclared answer and no fault of ours."""

from __future__ import annotations

import json
from typing import Any

import httpx
import hypothesis
import pytest
import schemathesis
from hypothesis import HealthCheck
from schemathesis.checks import not_a_server_error

from lubdub.cases.people import SCOPES
from lubdub.web.openapi import openapi_json
from tests.web.service import Portal, Service

schemathesis.serializer.alias("application/offset+octet-stream", "application/octet-stream")

UNANSWERABLE = "/api/v1/cases/{case_id}/events"
"""A stream that stays open as long as its case lives."""

ANSWERS_AS_OAUTH_DOES = "/api/v1/oauth/token"

CHECKS = [
    not_a_server_error,
    schemathesis.checks.status_code_conformance,
    schemathesis.checks.content_type_conformance,
    schemathesis.checks.response_schema_conformance,
]


def operations() -> list[Any]:
    schema = schemathesis.openapi.from_dict(json.loads(openapi_json()))
    found = [result.ok() for result in schema.get_all_operations()]
    return [operation for operation in found if operation.path not in (UNANSWERABLE, "/readyz")]


@pytest.fixture(scope="module")
def fuzzer(service: Service) -> Portal:
    """A portal that may do everything."""
    return service.portal("fuzzer", SCOPES)


@pytest.mark.parametrize("operation", operations(), ids=lambda operation: operation.label)
def test_made_up_calls_get_declared_answers(operation: Any, service: Service, fuzzer: Portal) -> None:
    headers = {"Authorization": fuzzer.http.headers["authorization"]}

    @hypothesis.settings(max_examples=8, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
    @hypothesis.given(case=operation.as_strategy())
    def calls(case: Any) -> None:
        response = case.call(base_url=service.settings.address, headers=headers)
        case.validate_response(response, checks=CHECKS)

    calls()


def test_the_documentation_page_lists_every_call_and_loads_nothing_from_elsewhere(service: Service) -> None:
    page = httpx.get(f"{service.settings.address}/api/docs").text
    document = json.loads(openapi_json())
    for path in document["paths"]:
        assert f"<code>{path}</code>" in page
    loaded = page.split("<h2>")[0]
    assert "http" not in loaded.replace(service.settings.address, "")
    assert "<script" not in page


def test_the_page_about_many_machines_names_what_stays_with_one_process(service: Service) -> None:
    page = httpx.get(f"{service.settings.address}/api/docs/scaling").text
    for path in ("/view/CASE/", "/cases/CASE/points", "/desk/view/CASE/", "/desk/cases/CASE"):
        assert path in page
    assert "<script" not in page


def test_the_served_document_is_the_printed_one(service: Service) -> None:
    served = httpx.get(f"{service.settings.address}/api/v1/openapi.json").json()
    assert served == json.loads(openapi_json())


def test_every_call_under_the_interface_says_who_may_make_it_and_how_it_fails() -> None:
    for path, methods in json.loads(openapi_json())["paths"].items():
        for operation in methods.values():
            if path.startswith("/api/") and path != ANSWERS_AS_OAUTH_DOES:
                assert operation["security"]
                assert {"401", "403", "404", "422", "429"} <= set(operation["responses"])
                assert operation["description"]


def test_every_call_needs_the_scope_that_the_document_says(service: Service) -> None:
    document = json.loads(openapi_json())
    flow = document["components"]["securitySchemes"]["OAuth2"]["flows"]["clientCredentials"]
    assert set(flow["scopes"]) == set(SCOPES)
    without = {scope: service.portal("clinic", tuple(set(SCOPES) - {scope})).http for scope in SCOPES}
    asked = 0
    for path, methods in document["paths"].items():
        for method, operation in methods.items():
            for scope in (scope for way in operation.get("security", []) for scope in way.get("OAuth2", [])):
                plain = path.replace("{", "").replace("}", "")
                refused = without[scope].request(method, plain, headers={"Tus-Resumable": "1.0.0"})
                assert (method, path, refused.status_code) == (method, path, 403)
                asked += 1
    assert asked > 35
