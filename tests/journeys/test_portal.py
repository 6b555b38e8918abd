"""A portal's developer: the documentation's programs run as they stand, generated clients work, a portal frames us."""

from __future__ import annotations

import importlib
import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest
from playwright.sync_api import Browser, expect

from lubdub.cases import admin
from lubdub.cases.people import SCOPES
from lubdub.results import AREA_NAMES
from lubdub.web.openapi import openapi_json
from lubdub.web.pages.samples import all_samples
from tests.journeys.example_portal import ExamplePortal, example_portal
from tests.journeys.steps import WORK_MS, leads_on, soon
from tests.snippets import snippet
from tests.strangers import fhir_faults, python_client
from tests.web.service import Service, eventually, free_port


@pytest.fixture(scope="module")
def sandbox(product: Service) -> dict[str, str]:
    """A sandbox key, as the documentation's programs find it."""
    key, token = admin.create_key(product.settings.database, "docs", SCOPES, is_sandbox=True)
    return os.environ | {"LUBDUB_KEY": token, "LUBDUB_KEY_ID": key.id}


def run(product: Service, name: str, environment: dict[str, str], folder: Path) -> str:
    """Run a program of the documentation in an empty folder; what it printed."""
    program = [sys.executable, "-"] if name.endswith(".py") else ["sh", "-e"]
    text = snippet(product.settings.address, name)
    done = subprocess.run(program, input=text, cwd=folder, env=environment, capture_output=True, text=True, timeout=280)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_curl_on_the_page_goes_from_key_to_result(
    product: Service, sandbox: dict[str, str], tmp_path: Path
) -> None:
    run(product, "journey.sh", sandbox, tmp_path)
    result = json.loads((tmp_path / "result.json").read_text())
    assert set(result["areas"]) == set(AREA_NAMES)
    assert (tmp_path / "sheet.pdf").read_bytes().startswith(b"%PDF")
    assert fhir_faults(json.loads((tmp_path / "fhir.json").read_text())) == []


def test_the_python_on_the_page_goes_from_key_to_result(
    product: Service, sandbox: dict[str, str], tmp_path: Path
) -> None:
    said = run(product, "journey.py", sandbox, tmp_path)
    assert [line.split()[0] for line in said.splitlines()] == list(AREA_NAMES)


def test_the_token_on_the_page_can_read_and_not_write(
    product: Service, sandbox: dict[str, str], tmp_path: Path
) -> None:
    token = json.loads(run(product, "token.sh", sandbox, tmp_path))["access_token"]
    headers = {"Authorization": f"Bearer {token}"}
    api = f"{product.settings.address}/api/v1"
    assert httpx.get(f"{api}/cases", headers=headers).status_code == 200
    assert httpx.post(f"{api}/cases", headers=headers, json={}).status_code == 403


@pytest.fixture(scope="module")
def generated(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """The client that `openapi-python-client` makes of our document, imported."""
    folder = tmp_path_factory.mktemp("generated")
    (folder / "openapi.json").write_text(openapi_json())
    python_client(folder / "openapi.json", folder)
    sys.path.insert(0, str(folder))
    yield importlib.import_module("lubdub_client")
    sys.path.remove(str(folder))


def test_a_generated_client_drives_a_case_from_creation_to_fhir(
    product: Service, sandbox: dict[str, str], generated: Any
) -> None:
    def api(name: str) -> Any:
        return importlib.import_module(f"lubdub_client.api.{name}")

    models = importlib.import_module("lubdub_client.models")
    types = importlib.import_module("lubdub_client.types")
    client = generated.AuthenticatedClient(product.settings.address, sandbox["LUBDUB_KEY"], timeout=60)
    sample = next(one for one in all_samples() if one.name == "phone-child")
    listed = api("samples.list_samples").sync(client=client)
    told = next(one for one in listed.items if one.name == sample.name)
    case = api("cases.open_case").sync(client=client, body=models.CaseIn(patient=told.patient))
    assert case.sandbox is True

    def status() -> str:
        return str(api("cases.read_case").sync(case.id, client=client).status)

    with sample.scan.open("rb") as scan:
        api("cases.send_scan").sync(case.id, client=client, body=types.File(payload=scan))
    eventually(lambda: status() == "awaiting_landmarks", 120)
    api("cases.place_landmarks").sync(case.id, client=client, body=told.landmarks)
    eventually(lambda: status() == "done", 120)
    result = api("results.read_result").sync(case.id, client=client)
    assert set(result.areas.to_dict()) == set(AREA_NAMES)
    bundle = api("fhir.read_bundle").sync(case.id, client=client)
    assert fhir_faults(bundle.to_dict()) == []


@pytest.fixture
def portal(product: Service) -> Iterator[ExamplePortal]:
    frame = snippet(product.settings.address, "embed.html")
    _, token = admin.create_key(product.settings.database, "portal", SCOPES, is_sandbox=True)
    with example_portal(product.settings.address, token, frame) as running:
        yield running


@pytest.mark.browser
def test_a_portal_shows_the_whole_journey_in_its_page(portal: ExamplePortal, browser: Browser) -> None:
    # High enough for the whole frame: a press right after a page around a frame has scrolled may miss the frame.
    page = browser.new_page(viewport={"width": 1280, "height": 2400})
    broken: list[str] = []
    page.on("pageerror", lambda error: broken.append(str(error)))
    page.goto(portal.address)
    with leads_on(page):
        page.get_by_role("button", name="New visit").click()
    case = page.url.rsplit("/", 1)[1]
    inside, state = page.frame_locator("#lubdub"), page.locator("#state")
    expect(state).to_have_text("awaiting_scan")
    inside.get_by_role("button", name="A file I already have").click()
    inside.get_by_role("button", name="Continue").click()
    sample = next(one for one in all_samples() if one.name == "phone-child")
    inside.locator("#scan").set_input_files(sample.scan)
    inside.get_by_role("button", name="Send the scan").click()
    expect(state).to_have_text("awaiting_landmarks", timeout=WORK_MS)
    assert broken == []
    inside.get_by_label("Yes, about right").check()
    inside.get_by_label("Yes, that is the left side").check()
    inside.get_by_role("button", name="Continue").click()
    portal.lubdub.put(f"/cases/{case}/landmarks", json=dict(sample.landmarks)).raise_for_status()
    eventually(lambda: any(one["type"] == "case.done" for one in portal.told), 120)
    assert {one["data"]["id"] for one in portal.told} == {case}

    page.goto(f"{portal.address}/visits/{case}/result")
    expect(state).to_have_text("done")
    expect(inside.get_by_role("heading", name="Listen in this order")).to_be_visible()
    page.wait_for_function("document.getElementById('lubdub').clientHeight > 400")
    bundle = portal.lubdub.get(f"/cases/{case}/fhir").json()
    assert bundle["meta"]["tag"][0]["code"] == "HTEST"
    page.close()


@pytest.mark.browser
def test_a_page_of_somebody_else_cannot_frame_the_case(portal: ExamplePortal, browser: Browser) -> None:
    case = portal.open_visit()
    link = portal.lubdub.post(f"/cases/{case}/embed", json={"shows": "journey"}).json()["url"]
    portal.lubdub.put("/embedding", json={"origins": ["https://other.example"]}).raise_for_status()
    page = browser.new_page()
    page.goto(portal.address)
    page.set_content(portal.frame.replace("LINK", link))
    page.wait_for_load_state("networkidle")
    expect(page.locator("#state")).to_have_text("")
    soon(page, lambda: page.frames[-1].url.startswith("chrome-error:"), "the browser's refusal in the frame")
    page.close()


def test_the_webhook_receiver_on_the_page_believes_us_alone(product: Service, tmp_path: Path) -> None:
    _, token = admin.create_key(product.settings.database, "hooked", SCOPES, is_sandbox=True)
    port = free_port()
    hook = f"http://127.0.0.1:{port}/"
    headers = {"Authorization": f"Bearer {token}"}
    with httpx.Client(base_url=f"{product.settings.address}/api/v1", headers=headers, timeout=60) as lubdub:
        made = lubdub.post("/webhooks", json={"url": hook}).json()
        program = tmp_path / "webhook.py"
        program.write_text(snippet(product.settings.address, "webhook.py"))
        environment = os.environ | {"WEBHOOK_SECRET": made["secret"], "PORT": str(port)}
        log = tmp_path / "log"
        with log.open("w") as out:
            receiver = subprocess.Popen([sys.executable, program], env=environment, stdout=out, stderr=out)
        try:
            lubdub.post(f"/webhooks/{made['id']}/test").raise_for_status()
            eventually(lambda: "webhook.test {}" in log.read_text())
            forged = {"webhook-id": "msg_1", "webhook-timestamp": "1", "webhook-signature": "v1,AAAA"}
            assert httpx.post(hook, content=b"{}", headers=forged).status_code == 401
        finally:
            receiver.kill()
            receiver.wait()
