"""tus 1.0.0 against the running service: pieces, breaks, restarts and everything that does not fit."""

from __future__ import annotations

import base64
import socket
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path

import httpx
import pytest

from lubdub.web.api.uploads import PIECE
from tests.web.api.test_rest import problem
from tests.web.service import Portal, Service, eventually

SPOKEN = {"Tus-Resumable": "1.0.0"}


def metadata(**said: str) -> str:
    return ",".join(f"{key} {base64.b64encode(value.encode()).decode()}" for key, value in said.items())


def begin(portal: Portal, case: str, length: int, expect: int = 201, **said: str) -> httpx.Response:
    headers = SPOKEN | {"Upload-Length": str(length), "Upload-Metadata": metadata(case=case, **said)}
    return portal.call("POST", "/uploads", expect, headers=headers)


def path_of(begun: httpx.Response) -> str:
    return begun.headers["location"].removeprefix("/api/v1")


def piece(portal: Portal, path: str, offset: int, data: bytes, expect: int = 204, **more: str) -> httpx.Response:
    headers = SPOKEN | {"Upload-Offset": str(offset), "Content-Type": PIECE} | more
    return portal.call("PATCH", path, expect, headers=headers, content=data)


def stands_at(portal: Portal, path: str) -> int:
    return int(portal.call("HEAD", path, 200, headers=SPOKEN).headers["upload-offset"])


def test_a_scan_in_pieces_is_examined_like_one_in_one_piece(portal: Portal) -> None:
    case = portal.open_case()
    begun = begin(portal, case, 5, unit="cm")
    assert begun.headers["tus-resumable"] == "1.0.0"
    assert begun.headers["upload-expires"].endswith("GMT")
    path = path_of(begun)
    assert piece(portal, path, 0, b"qui").headers["upload-offset"] == "3"
    assert stands_at(portal, path) == 3
    assert portal.state(case)["status"] == "awaiting_scan"
    piece(portal, path, 3, b"ck")
    portal.wait(case, "awaiting_landmarks")
    problem_of_head = portal.call("HEAD", path, 404, headers=SPOKEN)
    assert problem_of_head.status_code == 404


@contextmanager
def half_sent(portal: Portal, method: str, path: str, **headers: str) -> Iterator[socket.socket]:
    """A call the service is at work on: it has asked for the body, and was sent 700 kB of 2 MB."""
    said = {
        "Host": "127.0.0.1",
        "Authorization": portal.http.headers["authorization"],
        "Content-Length": "2000000",
        "Expect": "100-continue",
    }
    lines = [f"{method} /api/v1{path} HTTP/1.1", *(f"{key}: {value}" for key, value in (said | headers).items())]
    with socket.create_connection(("127.0.0.1", int(portal.http.base_url.port or 80))) as line:
        line.sendall("\r\n".join([*lines, "", ""]).encode())
        assert line.recv(1000).startswith(b"HTTP/1.1 100")
        line.sendall(b"x" * 700_000)
        yield line


def half_a_piece(portal: Portal, path: str, offset: int) -> AbstractContextManager[socket.socket]:
    return half_sent(portal, "PATCH", path, **SPOKEN, **{"Upload-Offset": str(offset), "Content-Type": PIECE})


def test_what_was_on_its_way_when_the_service_was_killed_is_not_half_taken_and_can_be_sent_again(
    service: Service, portal: Portal
) -> None:
    in_pieces, at_once = portal.open_case(), portal.open_case()
    path = path_of(begin(portal, in_pieces, 2_000_003))
    piece(portal, path, 0, b"qui")
    web = service.processes[0]
    with half_a_piece(portal, path, 3), half_sent(portal, "PUT", f"/cases/{at_once}/scan"):
        web.kill()
        web.wait()
    service.processes.remove(web)
    service.start_web()
    assert stands_at(portal, path) == 3
    piece(portal, path, 3, b"ck\n".ljust(2_000_000))
    assert portal.state(at_once)["status"] == "awaiting_scan"
    portal.send(at_once, b"quick")
    for case in (in_pieces, at_once):
        portal.wait(case, "awaiting_landmarks")


def test_what_came_before_the_network_broke_stays_and_the_rest_follows(portal: Portal) -> None:
    case = portal.open_case()
    path = path_of(begin(portal, case, 2_000_006))
    piece(portal, path, 0, b"quick\n")
    with half_a_piece(portal, path, 6) as line:
        line.shutdown(socket.SHUT_WR)
        assert line.recv(1) == b""
    there = eventually(lambda: (at := stands_at(portal, path)) > 6 and at)
    assert there <= 700_006
    piece(portal, path, there, b"x" * (2_000_006 - there))
    portal.wait(case, "awaiting_landmarks")


def test_a_piece_must_begin_where_the_upload_ends(portal: Portal) -> None:
    path = path_of(begin(portal, portal.open_case(), 10))
    piece(portal, path, 0, b"12345")
    answer = piece(portal, path, 2, b"345", 409)
    problem(answer, "wrong-offset")
    assert answer.headers["upload-offset"] == "5"


def test_more_bytes_than_promised_are_refused_and_not_kept(portal: Portal) -> None:
    path = path_of(begin(portal, portal.open_case(), 4))
    problem(piece(portal, path, 0, b"12345", 413), "too-large")
    assert stands_at(portal, path) == 0


def test_a_scan_that_is_too_large_is_refused_before_its_first_byte(portal: Portal) -> None:
    problem(begin(portal, portal.open_case(), 2_000_000_000, 413), "too-large")


def test_an_upload_that_is_given_up_is_gone(portal: Portal) -> None:
    path = path_of(begin(portal, portal.open_case(), 10))
    piece(portal, path, 0, b"123")
    portal.call("DELETE", path, 204, headers=SPOKEN)
    problem(piece(portal, path, 3, b"4", 404), "upload-not-found")


def test_another_tenants_upload_is_not_there(service: Service, portal: Portal) -> None:
    other = service.portal("another clinic")
    case = portal.open_case()
    path = path_of(begin(portal, case, 10))
    problem(begin(other, case, 10, 404), "case-not-found")
    problem(piece(other, path, 0, b"1", 404), "case-not-found")
    problem(other.call("DELETE", path, 404, headers=SPOKEN), "case-not-found")


@pytest.mark.parametrize(
    ("headers", "status", "kind"),
    [
        ({"Tus-Resumable": "0.2.2"}, 412, "tus-version"),
        ({"Content-Type": "application/json"}, 415, "wrong-media-type"),
        ({"Upload-Offset": "-1"}, 422, "invalid-input"),
    ],
)
def test_a_piece_that_is_no_piece_is_refused(portal: Portal, headers: dict[str, str], status: int, kind: str) -> None:
    path = path_of(begin(portal, portal.open_case(), 10))
    problem(piece(portal, path, 0, b"123", status, **headers), kind)
    assert stands_at(portal, path) == 0


@pytest.mark.parametrize("said", ["", "case !!!", "case /w==", "unit bW0="])
def test_metadata_that_names_no_case_is_refused(portal: Portal, said: str) -> None:
    headers = SPOKEN | {"Upload-Length": "10", "Upload-Metadata": said}
    problem(portal.call("POST", "/uploads", 400, headers=headers), "bad-request")


def test_the_service_says_what_it_speaks_and_how_large_a_scan_may_be(service: Service, portal: Portal) -> None:
    told = portal.call("OPTIONS", "/uploads", 204).headers
    assert told["tus-version"] == "1.0.0"
    assert set(told["tus-extension"].split(",")) == {"creation", "expiration", "termination"}
    assert int(told["tus-max-size"]) == service.settings.max_upload_mb * 1_000_000


def test_nothing_of_an_unfinished_upload_lies_in_the_clear(service: Service, portal: Portal) -> None:
    path = path_of(begin(portal, portal.open_case(), 2_900_000))
    piece(portal, path, 0, b"a very private chest " * 100_000)
    files = [file for file in Path(service.settings.data_dir).rglob("*") if file.is_file()]
    assert files
    assert not any(b"a very private chest" in file.read_bytes() for file in files)
