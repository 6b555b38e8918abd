"""The pages for security officers and operations teams say what is so."""

from __future__ import annotations

from prometheus_client import REGISTRY

from lubdub.scans.limits import LIMITS
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


def test_the_security_page_says_who_may_write_what_call_by_call(service: Service) -> None:
    text = page(service, "security")
    document = service.browser().get("/api/v1/openapi.json").json()
    changing = [
        f"{method.upper()} {path}"
        for path, methods in document["paths"].items()
        for method in methods
        if method not in ("get", "head", "options")
    ]
    assert len(changing) > 20
    assert [call for call in changing if f"<td><code>{call}</code></td>" not in text] == []
    row = text.split("<td><code>PATCH /api/v1/webhooks/{webhook_id}</code></td>")[1].split("</tr>")[0]
    assert row == "<td>webhooks:manage</td><td>url, statuses, enabled</td>"
    assert "patient.age_years" in text


def test_the_security_page_says_how_keys_live_and_how_soon_libraries_are_mended(service: Service) -> None:
    text = page(service, "security")
    keys = text.split('<h2 id="ciphers">')[1].split("</table>")[0]
    assert "replace it once a year" in keys
    assert keys.count("<tr>") > 10
    assert "mended within a week" in text


def test_the_documentation_says_what_a_file_may_be_and_how_large(service: Service) -> None:
    text = service.browser().get("/api/docs").text
    row = text.split('<tr id="files">')[1].split("</tr>")[0]
    limits = {
        f"{LIMITS.file_bytes // 1_000_000} MB",
        f"{LIMITS.vertices:,} points",
        f"{LIMITS.faces:,} faces",
        f"{LIMITS.zip_entries} files",
        f"{LIMITS.zip_ratio:.0f} times",
        f"{LIMITS.picture_pixels:,} points",
    }
    assert {said for said in limits if said not in " ".join(row.split())} == set()
    assert f"{service.settings.max_upload_mb} MB" in text


def test_the_page_about_many_machines_says_what_is_heavy_and_when_to_stop(service: Service) -> None:
    text = page(service, "scaling").split("<h2>What to scale by</h2>")[1].split("</table>")[0]
    for what in ("worker", "web", "view", "1 GB for its largest job", "at most 200", "target 10 s"):
        assert what in text


def test_the_pages_are_found_from_the_documentation(service: Service) -> None:
    text = service.browser().get("/api/docs").text
    assert 'href="/api/docs/security"' in text
    assert 'href="/api/docs/operation"' in text
