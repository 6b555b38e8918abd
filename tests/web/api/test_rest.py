"""The whole journey by REST against the running service, and everything that may go wrong on the way."""

from __future__ import annotations

import json
import os
import socket

import httpx
import pytest

from lubdub.web.problems import PROBLEMS
from tests.web.service import NO_STOPS, PATIENT, Portal, Service, eventually

NOTCH = {"suprasternal_notch": [0.0, 0.1, 0.2], "nipple_left": [0.1, 0.0, 0.2]}


def problem(response: httpx.Response, kind: str) -> dict[str, object]:
    """The problem document, which must be whole and of this kind."""
    assert response.headers["content-type"] == "application/problem+json"
    document = dict(response.json())
    assert document["type"] == f"/problems/{kind}"
    assert document["title"] == PROBLEMS[kind].title
    assert document["status"] == response.status_code == PROBLEMS[kind].status
    assert document["detail"]
    return document


def test_the_whole_journey_by_rest(portal: Portal) -> None:
    opened = portal.call("POST", "/cases", 201, json={"patient": PATIENT, "answers": NO_STOPS, "external_id": "A-7"})
    case = opened.json()["id"]
    assert opened.headers["location"] == f"/api/v1/cases/{case}"
    assert opened.json()["status"] == "awaiting_scan"
    assert portal.send(case, b"quick").json()["status"] == "checking"
    portal.wait(case, "awaiting_landmarks")
    assert portal.call("GET", f"/cases/{case}/scan", 200).json() == {"coverage": 1}
    queued = portal.call("PUT", f"/cases/{case}/landmarks?unit=m&method=rule", 202, json=NOTCH)
    assert queued.json()["status"] == "queued"
    assert portal.wait(case, "done", "failed")["status"] == "done"
    asked = portal.call("GET", f"/cases/{case}/result", 200).json()["asked"]
    assert asked["landmarks"] == NOTCH
    assert (asked["age_years"], asked["unit"], asked["method"]) == (6, "m", "rule")
    assert portal.call("GET", f"/cases/{case}/scan.ply", 200).content == b"ply"
    receipt = portal.call("DELETE", f"/cases/{case}", 200).json()
    assert receipt["id"] == case
    assert len(receipt["sha256"]) == 64
    assert portal.call("DELETE", f"/cases/{case}", 200).json() == receipt
    for path in ("", "/scan", "/result", "/events", "/view.html", "/scan.ply"):
        problem(portal.call("GET", f"/cases/{case}{path}", 404), "case-not-found")


def test_the_suggested_landmarks_can_be_confirmed(portal: Portal) -> None:
    case = portal.examined(b"quick")
    portal.call("POST", f"/cases/{case}/landmarks/confirm", 202)
    portal.wait(case, "done")
    assert portal.call("GET", f"/cases/{case}/result", 200).json()["asked"]["landmarks"] == {}


def test_a_unit_can_be_corrected(portal: Portal) -> None:
    case = portal.examined(b"quick")
    assert portal.call("PUT", f"/cases/{case}/scan/unit", 202, json={"unit": "cm"}).json()["status"] == "checking"
    portal.wait(case, "awaiting_landmarks")


def test_another_tenants_case_is_not_there(service: Service, portal: Portal) -> None:
    case, other = portal.examined(b"quick"), service.portal("another clinic")
    for method, path in [
        ("GET", ""),
        ("GET", "/scan"),
        ("GET", "/result"),
        ("GET", "/events"),
        ("GET", "/view.html"),
        ("GET", "/scan.ply"),
        ("PUT", "/scan"),
        ("POST", "/landmarks/confirm"),
        ("POST", "/cancel"),
        ("DELETE", ""),
    ]:
        response = other.call(method, f"/cases/{case}{path}", 404, content=b"x" if method == "PUT" else None)
        problem(response, "case-not-found")
    for path, body in (("/landmarks", NOTCH), ("/scan/unit", {"unit": "m"})):
        problem(other.call("PUT", f"/cases/{case}{path}", 404, json=body), "case-not-found")
    assert portal.state(case)["status"] == "awaiting_landmarks"


def test_a_call_repeated_with_its_idempotency_key_opens_one_case(portal: Portal) -> None:
    key, body = {"Idempotency-Key": os.urandom(8).hex()}, {"patient": PATIENT}
    first = portal.call("POST", "/cases", 201, json=body, headers=key).json()
    assert portal.call("POST", "/cases", 201, json=body, headers=key).json()["id"] == first["id"]
    other = portal.call("POST", "/cases", 422, json=body | {"external_id": "B"}, headers=key)
    problem(other, "idempotency-mismatch")


@pytest.mark.parametrize("question", sorted(NO_STOPS))
def test_a_yes_to_a_stop_question_refuses_with_its_reason(portal: Portal, question: str) -> None:
    case = portal.open_case(answers=NO_STOPS | {question: True})
    state = portal.state(case)
    assert (state["status"], state["reason"]["code"]) == ("refused", question)
    problem(portal.send(case, b"quick", expect=409), "state-conflict")
    result = portal.call("GET", f"/cases/{case}/result", 200).json()
    assert result["verdict"] == "refuse"
    assert "areas" not in result
    assert [reason["code"] for reason in result["reasons"]] == [question]


@pytest.mark.parametrize(
    ("scan", "code"),
    [
        (b"junk", "unreadable_file"),
        (b"crash", "unreadable_file"),
        (b"memory", "unreadable_file"),
        (b"hang", "unreadable_file"),
        (b"refuse", "mirrored_scan"),
    ],
)
def test_a_scan_that_cannot_be_used_is_refused_and_the_worker_lives_on(portal: Portal, scan: bytes, code: str) -> None:
    case = portal.open_case()
    portal.send(case, scan)
    state = portal.wait(case, "refused", "failed", "awaiting_landmarks")
    assert (state["status"], state["reason"]["code"]) == ("refused", code)
    assert state["reason"]["advice"]
    portal.send(case, b"quick")
    portal.wait(case, "awaiting_landmarks")


def test_a_fault_of_ours_is_told_as_such(portal: Portal) -> None:
    case = portal.open_case()
    portal.send(case, b"bug")
    assert portal.wait(case, "failed", "refused")["reason"]["code"] == "internal"


@pytest.mark.parametrize("scan", [b"slow 60", b"quick\nslow 60"])
def test_cancel_steps_back_at_once_and_frees_the_worker(portal: Portal, scan: bytes) -> None:
    case = portal.open_case()
    portal.send(case, scan)
    if scan.startswith(b"quick"):
        portal.wait(case, "awaiting_landmarks")
        portal.call("PUT", f"/cases/{case}/landmarks", 202, json={})
    eventually(lambda: portal.state(case)["stage"] == "fit")
    before = "awaiting_landmarks" if scan.startswith(b"quick") else "awaiting_scan"
    assert portal.call("POST", f"/cases/{case}/cancel", 200).json()["status"] == before
    problem(portal.call("POST", f"/cases/{case}/cancel", 409), "state-conflict")
    portal.done(b"quick")
    assert portal.state(case)["status"] == before


def test_deleting_a_case_at_work_stops_the_work(portal: Portal) -> None:
    case = portal.open_case()
    portal.send(case, b"slow 60")
    eventually(lambda: portal.state(case)["stage"] == "fit")
    portal.call("DELETE", f"/cases/{case}", 200)
    portal.done(b"quick")


def events(portal: Portal, case: str, after: int | None = None) -> list[dict[str, str]]:
    """The stream to its end."""
    headers = {} if after is None else {"Last-Event-ID": str(after)}
    text = portal.call("GET", f"/cases/{case}/events", 200, headers=headers).text
    blocks = [block for block in text.replace("\r\n", "\n").split("\n\n") if "data:" in block]
    return [dict(line.split(": ", 1) for line in block.split("\n") if ": " in line) for block in blocks]


def test_events_are_told_in_order_and_go_on_where_they_stopped(portal: Portal) -> None:
    case = portal.done(b"quick")
    told = events(portal, case)
    numbers = [int(event["id"]) for event in told]
    assert numbers == list(range(1, len(told) + 1))
    states = [json.loads(event["data"])["status"] for event in told if event["event"] == "status"]
    assert states == ["awaiting_scan", "checking", "awaiting_landmarks", "queued", "running", "done"]
    assert "progress" in {event["event"] for event in told}
    assert events(portal, case, after=numbers[2]) == told[3:]
    assert events(portal, case, after=numbers[-1]) == []


def test_nothing_plain_is_stored_and_nothing_private_is_logged(service: Service, portal: Portal) -> None:
    secret = b"NAKED-SKIN-" + os.urandom(16).hex().encode()
    scan = b"quick\n" + secret * 50_000
    case = portal.open_case(external_id="Emma Example")
    portal.send(case, scan)
    portal.wait(case, "awaiting_landmarks")
    for path in service.settings.data_dir.rglob("*"):
        if path.is_file():
            assert secret not in path.read_bytes(), path.name
    log = service.log.read_text()
    assert "Emma" not in log
    assert "lubdub_" not in log
    assert case not in log.replace(f"{case}.check", "")
    assert all(json.loads(line) for line in log.splitlines())


def test_too_large_a_body_is_refused_before_and_while_it_is_read(portal: Portal) -> None:
    case = portal.open_case()
    problem(portal.send(case, bytes(3_000_001), expect=413), "too-large")

    def dripping() -> object:
        for _ in range(40):
            yield bytes(100_000)

    problem(portal.call("PUT", f"/cases/{case}/scan", 413, content=dripping()), "too-large")
    problem(portal.call("POST", "/cases", 413, content=bytes(1_000_001)), "too-large")
    assert portal.state(case)["status"] == "awaiting_scan"


def test_an_upload_that_breaks_off_leaves_nothing(service: Service, portal: Portal) -> None:
    case = portal.open_case()
    head = [
        f"PUT /api/v1/cases/{case}/scan HTTP/1.1",
        "Host: 127.0.0.1",
        f"Authorization: {portal.http.headers['authorization']}",
        "Content-Length: 2500000",
    ]
    faults = service.log.read_text().count("a request failed")
    with socket.create_connection(("127.0.0.1", service.settings.port)) as half:
        half.sendall(("\r\n".join(head) + "\r\n\r\n").encode() + bytes(1_500_000))
    eventually(lambda: '"status": 499' in service.log.read_text())
    assert portal.state(case)["status"] == "awaiting_scan"
    assert not list((service.settings.data_dir / "files" / case).glob("*"))
    assert service.log.read_text().count("a request failed") == faults


def test_what_does_not_fit_is_a_problem_that_does_not_repeat_it(portal: Portal) -> None:
    case = portal.open_case()
    problem(portal.send(case, b"", expect=422), "empty-body")
    for body in (
        {},
        {"patient": PATIENT | {"age_years": 121}},
        {"patient": PATIENT | {"age_years": -1}},
        {"patient": {"sex": "male"}},
        {"patient": PATIENT, "answers": {"heart_on_right": "perhaps"}},
        {"patient": PATIENT, "name": "Emma Example"},
    ):
        document = problem(portal.call("POST", "/cases", 422, json=body), "invalid-input")
        assert "Emma" not in json.dumps(document)
    for body in ({"navel": [1, 2]}, {"naval": [1, 2, 3]}, {"navel": [1, 2, 1e300]}):
        problem(portal.call("PUT", f"/cases/{case}/landmarks", 422, json=body), "invalid-input")
    problem(portal.call("PUT", f"/cases/{case}/landmarks", 409, json=NOTCH), "state-conflict")
    problem(portal.call("GET", f"/cases/{case}/result", 409), "state-conflict")
    problem(portal.call("GET", f"/cases/{case}/scan", 404), "file-not-ready")
    problem(portal.call("GET", "/nothing", 404), "page-not-found")
    problem(portal.call("PATCH", f"/cases/{case}", 405), "method-not-allowed")


def test_every_kind_of_problem_has_an_address(service: Service) -> None:
    for kind, known in PROBLEMS.items():
        said = httpx.get(f"{service.settings.address}/problems/{kind}").json()
        assert (said["type"], said["status"]) == (f"/problems/{kind}", known.status)
