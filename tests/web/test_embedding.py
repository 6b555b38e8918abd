"""A case in a portal's frame: a link that works once, a session that sees one case, and only the portal's pages."""

from __future__ import annotations

import json
import os
import re

import httpx
import pytest

from lubdub.cases import admin
from lubdub.web.framing import is_origin
from lubdub.web.languages import NAMES
from lubdub.web.schemas import CaseIn
from lubdub.web.schemas_embed import MESSAGE, EmbedIn
from tests.web.api.test_rest import problem
from tests.web.service import PATIENT, Portal, Service
from tests.web.test_portal import ALL, speaking

ORIGIN = "https://portal.example"
IN_A_FRAME = {"Sec-Fetch-Dest": "iframe", "Sec-Fetch-Site": "cross-site"}


@pytest.fixture
def framer(service: Service) -> Portal:
    """A portal whose page may frame its cases."""
    made = service.portal(f"clinic {os.urandom(4).hex()}", ALL)
    assert made.call("PUT", "/embedding", 200, json={"origins": [ORIGIN]}).json() == {"origins": [ORIGIN]}
    return made


def link(portal: Portal, case: str, shows: str = "journey") -> str:
    return str(portal.call("POST", f"/cases/{case}/embed", 201, json={"shows": shows}).json()["url"])


class Frame:
    """A browser's frame in the portal's page, after its link was opened."""

    def __init__(self, service: Service, address: str) -> None:
        self.http = httpx.Client(base_url=service.settings.address, headers=IN_A_FRAME, timeout=30)
        self.entered = self.http.get(address)
        self.cookie = self.entered.headers["set-cookie"]
        self.http.headers["Cookie"] = self.cookie.split(";")[0]

    def get(self, path: str) -> httpx.Response:
        return self.http.get(path)

    def page(self, path: str) -> httpx.Response:
        """Where the path leads in the end."""
        answer = self.get(path)
        while answer.is_redirect:
            answer = self.get(answer.headers["location"])
        return answer


def test_a_journey_goes_on_in_the_portals_frame(service: Service, framer: Portal) -> None:
    case = framer.open_case()
    frame = Frame(service, link(framer, case))
    assert (frame.entered.status_code, frame.entered.headers["location"]) == (303, f"/cases/{case}")
    for word in ("SameSite=None", "Secure", "Partitioned", "HttpOnly", "lubdub-embedded="):
        assert word in frame.cookie
    page = frame.page(f"/cases/{case}")
    assert page.status_code == 200
    assert f"frame-ancestors 'self' {ORIGIN}" in page.headers["content-security-policy"]
    assert "x-frame-options" not in page.headers
    told = page.text.partition('name="lubdub-embedded" content="')[2].partition('">')[0].replace("&#34;", '"')
    assert json.loads(told) == {"origins": [ORIGIN], "case": case, "status": "awaiting_scan"}
    links = set(re.findall(r'<a [^>]*href="(/[^"]*)"', page.text))
    assert links
    assert {path for path in links if not path.startswith(f"/cases/{case}")} == set()


def test_a_link_works_once_and_only_in_a_frame(service: Service, framer: Portal) -> None:
    case = framer.open_case()
    address = link(framer, case)
    outside = service.browser().get(address)
    assert outside.status_code == 404
    assert httpx.get(address, headers=IN_A_FRAME).status_code == 303
    assert httpx.get(address, headers=IN_A_FRAME).status_code == 404
    older, newer = link(framer, case), link(framer, case)
    assert httpx.get(older, headers=IN_A_FRAME).status_code == 404
    assert httpx.get(newer, headers=IN_A_FRAME).status_code == 303


def test_a_spent_link_says_so_in_the_portals_frame_and_in_no_other(service: Service, framer: Portal) -> None:
    address = link(framer, framer.open_case())
    httpx.get(address, headers=IN_A_FRAME)
    spent = httpx.get(f"{address}?language=es", headers=IN_A_FRAME)
    assert spent.status_code == 404
    assert f"frame-ancestors 'self' {ORIGIN};" in spent.headers["content-security-policy"] + ";"
    assert "x-frame-options" not in spent.headers
    assert "set-cookie" not in spent.headers
    assert '<html lang="es"' in spent.text
    assert re.search("<(a|form|button) (?!class=.nhsuk-skip)", spent.text) is None, "nothing to press but to go on"
    case = framer.open_case()
    older, _newer = link(framer, case), link(framer, case)
    assert ORIGIN in httpx.get(older, headers=IN_A_FRAME).headers["content-security-policy"]
    unknown = httpx.get(f"{service.settings.address}/embed/none", headers=IN_A_FRAME)
    assert unknown.status_code == 404
    assert unknown.headers["x-frame-options"] == "SAMEORIGIN"
    assert ORIGIN not in unknown.headers["content-security-policy"]


def test_the_portal_chooses_the_language_of_its_frame(service: Service, framer: Portal) -> None:
    case = framer.open_case()
    asked = {"shows": "journey", "language": "ja"}
    address = framer.call("POST", f"/cases/{case}/embed", 201, json=asked).json()["url"]
    frame = Frame(service, address)
    cookies = [one.split(";")[0] for one in frame.entered.headers.get_list("set-cookie")]
    frame.http.headers["Cookie"] = "; ".join(cookies)
    assert '<html lang="ja"' in frame.page(f"/cases/{case}").text
    problem(framer.call("POST", f"/cases/{case}/embed", 422, json=asked | {"language": "xx"}), "invalid-input")
    offered = EmbedIn.model_json_schema()["properties"]["language"]["anyOf"][0]["enum"]
    assert set(offered) == set(NAMES)


def test_a_newer_journey_takes_the_case_from_the_older_one(service: Service, framer: Portal) -> None:
    case = framer.open_case()
    first = Frame(service, link(framer, case))
    assert first.page(f"/cases/{case}").status_code == 200
    second = Frame(service, link(framer, case))
    assert first.get(f"/cases/{case}").status_code == 404
    assert second.get(f"/cases/{case}").status_code == 303


def test_a_frame_sees_its_own_case_and_nothing_else(service: Service, framer: Portal, portal: Portal) -> None:
    mine, sibling, strangers = framer.open_case(), framer.open_case(), portal.open_case()
    frame = Frame(service, link(framer, mine))
    for path in ("/", "/ask/who", f"/cases/{sibling}", f"/cases/{strangers}", f"/api/v1/cases/{sibling}"):
        assert frame.get(path).status_code == 404, path
    listed = frame.get("/api/v1/cases").json()["items"]
    assert [case["id"] for case in listed] == [mine]
    problem(frame.get("/api/v1/keys"), "not-signed-in")
    assert frame.get(f"/cases/{mine}").status_code == 303


def test_only_the_cases_own_portal_makes_links(service: Service, framer: Portal, portal: Portal) -> None:
    case = framer.open_case()
    problem(portal.call("POST", f"/cases/{case}/embed", 404, json={"shows": "journey"}), "case-not-found")
    own = portal.open_case()
    unprepared = portal.call("POST", f"/cases/{own}/embed", 409, json={"shows": "journey"})
    problem(unprepared, "state-conflict")
    problem(framer.call("POST", f"/cases/{case}/embed", 409, json={"shows": "result"}), "state-conflict")
    problem(service.browser().post(f"/api/v1/cases/{case}/embed", json={"shows": "journey"}), "not-signed-in")


def test_other_answers_name_no_portal(service: Service) -> None:
    page = service.browser().get("/")
    assert "frame-ancestors 'self'" in page.headers["content-security-policy"]
    assert "https" not in page.headers["content-security-policy"]
    assert page.headers["x-frame-options"] == "SAMEORIGIN"
    assert "lubdub-embedded" not in page.text


def test_origins_are_plain_and_can_be_taken_back(framer: Portal) -> None:
    for origin in ("*", "https://portal.example/", "portal.example", "javascript:x", "https://a.example; script-src *"):
        problem(framer.call("PUT", "/embedding", 422, json={"origins": [origin]}), "invalid-input")
    assert framer.call("GET", "/embedding", 200).json() == {"origins": [ORIGIN]}
    framer.call("PUT", "/embedding", 200, json={"origins": []})
    problem(framer.call("POST", f"/cases/{framer.open_case()}/embed", 409, json={"shows": "journey"}), "state-conflict")


def test_http_is_an_origin_for_trying_out_on_this_machine_alone() -> None:
    assert is_origin("http://localhost:5000", allow_http=True)
    assert not is_origin("http://localhost:5000", allow_http=False)
    assert is_origin("https://portal.example:8443", allow_http=False)


def test_pages_in_a_frame_speak_to_parents_of_children_alone() -> None:
    for years, person in ((6, "child"), (40, "other")):
        assert CaseIn.model_validate({"patient": PATIENT | {"age_years": years}}).to_value().person == person


def test_a_sandboxs_frame_takes_samples_alone(service: Service) -> None:
    _, token = admin.create_key(service.settings.database, "clinic", ALL, is_sandbox=True)
    sandbox = speaking(service, token)
    sandbox.call("PUT", "/embedding", 200, json={"origins": [ORIGIN]})
    case = sandbox.open_case()
    frame = Frame(service, link(sandbox, case))
    page = frame.page(f"/cases/{case}/scan").text
    form = page.partition('name="csrf_token" value="')[2].partition('"')[0]
    own = {"X-CSRF-Token": form, "Sec-Fetch-Site": "same-origin"}
    problem(frame.http.put(f"/api/v1/cases/{case}/scan", content=b"a body", headers=own), "sandbox-takes-samples")


def test_the_messages_schema_is_public_and_strict(service: Service) -> None:
    schema = service.browser().get("/api/embed-messages.schema.json").json()
    assert set(schema["$defs"]) == {"StateMessage", "SizeMessage"}
    good = {"source": "lubdub", "version": 1, "type": "state", "case": "x", "status": "done"}
    assert MESSAGE.validate_python(good).case == "x"
    with pytest.raises(ValueError, match="status"):
        MESSAGE.validate_python(good | {"status": "cured"})
