"""Marking reference bodies at the desk, without a browser."""

from __future__ import annotations

import asyncio
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import websockets
import zstandard

from lubdub.library.load import load_body, load_library
from lubdub.library.marks import read_marks
from lubdub.library.own import OwnBody, add_body, remove
from lubdub.results import AREA_NAMES, Reference
from tests.web.reviewing import CURRENT, ORGANISATION
from tests.web.service import Service, eventually
from tests.web.staff import Desk, signed_in

BODY = "boy-08"
ZSTD = b"\x28\xb5\x2f\xfd"
"""With which viser's compressed frames begin, after their lengths."""


def folder_of(service: Service) -> Path:
    folder = service.settings.own_references
    assert folder is not None
    return folder


@pytest.fixture
def desk(service: Service) -> Iterator[Desk]:
    """Somebody new at the desk; what people marked is taken away afterwards."""
    yield signed_in(service, "clinician", ORGANISATION)
    for path in (folder_of(service) / "marks").glob("*/*.json"):
        path.unlink()


class Hand:
    """Presses the marking page's buttons."""

    def __init__(self, desk: Desk, body: str = BODY) -> None:
        self.desk, self.body, self.version, self.token = desk, body, 0, desk.token()

    def press(self, action: str, expect: int = 200, **fields: str) -> dict[str, Any]:
        data = {"csrf_token": self.token, "action": action, "version": str(self.version), **fields}
        headers = {"Origin": self.desk.service.settings.address, "Accept": "application/json"}
        answer = self.desk.http.post(f"/desk/references/{self.body}/review", data=data, headers=headers)
        assert answer.status_code == expect, answer.text[:500]
        said = dict(answer.json())
        self.version = said.get("version", self.version)
        return said

    def mark_all(self, aside: int = 0) -> None:
        """By keys: each from the breastbone, as far as one press goes."""
        for area, left in zip(AREA_NAMES, (-20, 20, 25, 34), strict=True):
            self.press("look", area=area)
            self.press("move", area=area, left_mm=str(left + aside), up_mm="0")


def girl(service: Service) -> Reference:
    folder = folder_of(service)
    return next(one for one in load_library(folder if folder.is_dir() else None).references if one.id == BODY)


def row_of(desk: Desk) -> str:
    found = re.search(rf'data-body="{BODY}".*?</tr>', desk.get("/desk/references"), re.S)
    assert found is not None
    return found.group(0)


def test_two_clinicians_mark_a_body_and_the_list_says_how_far_they_lie_apart(desk: Desk, service: Service) -> None:
    first, second = Hand(desk), Hand(signed_in(service, "lead", ORGANISATION))
    assert "Anatomy table" in row_of(desk)
    first.mark_all()
    first.press("hand_in")
    assert "You have marked it" in row_of(desk)
    assert "Marked by one other" in row_of(second.desk)
    second.mark_all(aside=6)
    assert second.press("hand_in")["next"] == "/desk/references"
    row = row_of(desk)
    assert "Dr Clinician, Dr Lead" in row
    for area in ("Aortic", "Pulmonary", "Tricuspid", "Mitral"):
        assert re.search(f"{area} [567]\xa0mm", row)
    assert girl(service).card["placed_by"] == "Dr Clinician and Dr Lead"
    third = Hand(signed_in(service, "clinician", ORGANISATION))
    assert "Two others have marked this body" in third.desk.get(f"/desk/references/{BODY}")
    third.press("move", 409, area="aortic", left_mm="2", up_mm="0")


def test_the_page_shows_neither_the_tables_places_nor_anybody_elses(desk: Desk, service: Service) -> None:
    other = Hand(signed_in(service, "clinician", ORGANISATION))
    other.mark_all()
    other.press("hand_in")
    page = desk.get(f"/desk/references/{BODY}")
    assert page.count("to be marked") == 4
    assert "Mark: Aortic" in page
    assert ">Hand in<" not in page
    seen = names_in_picture(desk)
    assert {"/skin", "/landmarks/navel"} <= seen
    assert not any(name.startswith("/areas/") for name in seen)


def names_in_picture(desk: Desk) -> set[str]:
    """What viser is told to draw for a clinician who has just opened the body: its first frame holds all of it."""

    async def first() -> bytes:
        async with dial(desk, "0b") as socket:
            return bytes(await asyncio.wait_for(socket.recv(), 60))

    desk.get(f"/desk/body/{BODY}/0b/")
    packed = asyncio.run(first())
    told = zstandard.ZstdDecompressor().decompressobj().decompress(packed[packed.index(ZSTD) :])
    return {name.decode() for name in re.findall(rb"/(?:skin|landmarks/\w+|areas/\w+/(?:letter|ring))", told)}


def dial(desk: Desk, window: str, body: str = BODY, origin: str | None = None) -> Any:
    address = desk.service.settings.address
    cookies = "; ".join(f"{name}={value}" for name, value in desk.http.cookies.items())
    return websockets.connect(
        address.replace("http", "ws") + f"/desk/body/{body}/{window}",
        origin=address if origin is None else origin,  # type: ignore[arg-type]
        additional_headers={"Cookie": cookies},
        subprotocols=[CURRENT],
        max_size=None,
    )


def test_the_views_socket_opens_for_its_own_clinician_and_our_own_pages_alone(desk: Desk, service: Service) -> None:
    desk.get(f"/desk/body/{BODY}/0a/")
    colleague = signed_in(service, "clinician", ORGANISATION)
    for who, origin, body in (
        (desk, "https://elsewhere.example", BODY),
        (Desk(service), None, BODY),
        (colleague, None, BODY),
        (desk, None, "nobody"),
    ):

        async def attempt(who: Desk = who, origin: str | None = origin, body: str = body) -> None:
            async with dial(who, "0a", body, origin):
                pass

        with pytest.raises(websockets.InvalidStatus) as refused:
            asyncio.run(attempt())
        assert refused.value.response.status_code == 403


def test_a_picture_in_which_a_mark_was_made_shows_it_and_undo_takes_it_away(desk: Desk, service: Service) -> None:
    hand = Hand(desk)
    panel = hand.press("move", area="mitral", left_mm="30", up_mm="-10")["panel"]
    assert panel.count("to be marked") == 3
    assert "/areas/mitral/letter" in names_in_picture(desk)
    assert hand.press("undo")["panel"].count("to be marked") == 4
    hand.press("undo", 409)


def test_an_area_starts_on_the_breastbone_and_walks_along_the_skin(desk: Desk, service: Service) -> None:
    hand = Hand(desk)
    hand.press("move", area="tricuspid", left_mm="0", up_mm="2")
    hand.press("move", area="tricuspid", left_mm="24", up_mm="0")
    (marks,) = read_marks(folder_of(service), BODY)
    body = load_body(None, BODY)
    assert body is not None
    first, then = (step.place for step in marks.steps)
    notch, joint = body.landmarks["suprasternal_notch"], body.landmarks["xiphisternum"]
    assert abs(first[0]) < 4.0
    assert joint[1] < first[1] < notch[1]
    assert then[0] - first[0] == pytest.approx(22.0, abs=4.0)
    assert np.linalg.norm(body.surface.vertices - then, axis=1).min() < 25.0


def test_marks_are_withdrawn_by_whoever_made_them(desk: Desk, service: Service) -> None:
    hand, other = Hand(desk), Hand(signed_in(service, "clinician", ORGANISATION))
    hand.mark_all()
    hand.press("hand_in")
    other.press("withdraw", 409)
    assert hand.press("withdraw")["next"] == "/desk/references"
    assert "Not marked yet" in row_of(desk)
    assert read_marks(folder_of(service), BODY) == []


def test_what_does_not_fit_is_refused_in_a_sentence(desk: Desk) -> None:
    hand = Hand(desk)
    hand.press("hand_in", 409)
    hand.press("nothing", 400)
    hand.press("move", 400, area="nowhere", left_mm="1", up_mm="0")
    hand.press("move", 400, area="aortic", left_mm="nan", up_mm="0")
    hand.press("move", area="aortic", left_mm="5", up_mm="0")
    hand.version = 0
    assert "another window" in hand.press("move", 409, area="aortic", left_mm="5", up_mm="0")["detail"]
    for path in ("/desk/references/nobody", "/desk/references/nobody/panel", "/desk/body/nobody/0a/"):
        desk.get(path, 404)


def test_a_patients_body_is_neither_listed_nor_opened_elsewhere(desk: Desk, service: Service) -> None:
    case = service.portal(ORGANISATION).open_case()
    heavy = load_body(None, "girl-08-heavy")
    assert heavy is not None
    body = OwnBody(heavy.surface, heavy.landmarks, heavy.areas, 8.0, "female", "Dr. Mori", case)
    name = add_body(folder_of(service), body)
    try:
        assert name in desk.get("/desk/references")
        desk.get(f"/desk/references/{name}")
        stranger = signed_in(service, "administrator", "Elsewhere Clinic")
        assert name not in stranger.get("/desk/references")
        for path in ("", "/panel", "/live"):
            stranger.get(f"/desk/references/{name}{path}", 404)
        stranger.get(f"/desk/body/{name}/0a/", 404)
        Hand(stranger, name).press("move", 404, area="aortic", left_mm="2", up_mm="0")
    finally:
        remove(folder_of(service), name)


def test_the_page_hears_when_something_was_marked(desk: Desk) -> None:
    hand = Hand(desk)

    def versions() -> list[int]:
        with desk.http.stream("GET", f"/desk/references/{BODY}/live") as stream:
            lines = (line for line in stream.iter_lines() if line.startswith("data:"))
            first = next(lines)
        return [int(re.search(r'"version": ?(\d+)', first).group(1))]  # type: ignore[union-attr]

    assert versions() == [0]
    hand.press("move", area="aortic", left_mm="2", up_mm="0")
    assert eventually(lambda: versions() == [1])
