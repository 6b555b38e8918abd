"""The pages for security officers and operations teams say what is so."""

from __future__ import annotations

from prometheus_client import REGISTRY

from lubdub.web.handbook import asvs
from tests.web.service import Service


def page(service: Service, name: str) -> str:
    answer = service.browser().get(f"/api/docs/{name}")
    assert answer.status_code == 200
    assert "<script" not in answer.text
    return answer.text


def test_the_security_page_says_what_is_protected_and_what_is_not(service: Service) -> None:
    text = page(service, "security")
    for heading in ("What is protected", "Against whom", "Ways in", "What is not protected"):
        assert f"<h2>{heading}" in text
    assert f"{service.settings.requests_per_minute} a minute" in text
    table = asvs()
    for kind in ("shown", "open", "absent"):
        for item in table[kind]:
            assert f"<td>v5.0.0-{item}</td>" in text


def test_the_operation_page_names_every_number_and_every_check(service: Service) -> None:
    text = page(service, "operation")
    ours = {family.name for family in REGISTRY.collect() if family.name.startswith("lubdub_")}
    assert len(ours) > 10
    assert {name for name in ours if name not in text} == set()
    checks = service.browser().get("/readyz").json()["checks"]
    assert all(f"<code>{check}</code>" in text for check in checks)


def test_the_pages_are_found_from_the_documentation(service: Service) -> None:
    text = service.browser().get("/api/docs").text
    assert 'href="/api/docs/security"' in text
    assert 'href="/api/docs/operation"' in text
