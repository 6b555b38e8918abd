"""The door to the live view: who gets in, and what passes."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator
from typing import Any

import httpx
import msgspec
import pytest
import viser
import websockets
from websockets.typing import Subprotocol

from tests.views import sample
from tests.web.family import Family
from tests.web.service import Service

CURRENT = Subprotocol(f"viser-v{viser.__version__}")


@pytest.fixture(scope="module")
def family(service: Service) -> Family:
    return Family(service)


@pytest.fixture(scope="module")
def case(family: Family) -> str:
    case = family.confirmed()
    family.get(f"/view/{case}/")
    return case


def dial(family: Family, case: str, origin: str | None = None, protocol: Subprotocol = CURRENT) -> Any:
    address = family.service.settings.address
    cookies = "; ".join(f"{name}={value}" for name, value in family.http.cookies.items())
    return websockets.connect(
        address.replace("http", "ws") + f"/view/{case}",
        origin=address if origin is None else origin,  # type: ignore[arg-type]
        additional_headers={"Cookie": cookies},
        subprotocols=[protocol],
        max_size=None,
    )


def test_the_familys_own_page_gets_the_body(family: Family, case: str) -> None:
    async def first_frame() -> tuple[str | None, bytes]:
        async with dial(family, case) as socket:
            return socket.subprotocol, await asyncio.wait_for(socket.recv(), 20)

    protocol, frame = asyncio.run(first_frame())
    assert protocol == CURRENT
    assert len(frame) > 100


@pytest.mark.parametrize("origin", ["https://elsewhere.example", "null"])
def test_a_page_from_elsewhere_is_refused_before_the_socket_opens(family: Family, case: str, origin: str) -> None:
    async def attempt() -> None:
        async with dial(family, case, origin=origin):
            pass

    with pytest.raises(websockets.InvalidStatus) as refused:
        asyncio.run(attempt())
    assert refused.value.response.status_code == 403


def test_another_family_is_refused(service: Service, case: str) -> None:
    other = Family(service)
    other.get("/")

    async def attempt() -> None:
        async with dial(other, case):
            pass

    with pytest.raises(websockets.InvalidStatus):
        asyncio.run(attempt())


def test_an_old_page_learns_that_the_version_changed(family: Family, case: str) -> None:
    async def code() -> int | None:
        async with dial(family, case, protocol=Subprotocol("viser-v0.0.1")) as socket:
            await asyncio.wait_for(socket.wait_closed(), 20)
            return socket.close_code

    assert asyncio.run(code()) == 1002


def test_a_share_request_is_swallowed_and_the_view_goes_on(family: Family, case: str) -> None:
    async def still_open() -> bool:
        async with dial(family, case) as socket:
            await socket.send(msgspec.msgpack.encode({"type": "ShareUrlRequest"}))
            await socket.send(b"no message at all")
            pong = await socket.ping()
            await asyncio.wait_for(pong, 20)
            await asyncio.sleep(0.3)
            return socket.close_code is None

    assert asyncio.run(still_open())


def test_a_tap_counts_only_once_the_sides_are_confirmed(service: Service) -> None:
    family = Family(service)
    case = family.examined()
    family.get(f"/view/{case}/")
    navel = (sample.BODY.landmarks["navel"] / 1000).tolist()
    look = {"wxyz": [1.0, 0.0, 0.0, 0.0], "position": [0.0, 0.0, 1.0], "fov": 0.6, "near": 0.01, "far": 100.0}
    window = {"image_height": 400, "image_width": 300, "look_at": [0.0, 0.0, 0.0], "up_direction": [0.0, 1.0, 0.0]}
    ray = {"ray_origin": [navel[0], navel[1], 1.0], "ray_direction": [0.0, 0.0, -1.0], "screen_pos": [0.5, 0.5]}
    click = {"type": "SceneNodeClickMessage", "name": "/skin", "instance_index": None, "modifier": None, "owner": ""}

    async def tapped() -> None:
        async with dial(family, case) as socket:
            await socket.send(msgspec.msgpack.encode({"type": "ViewerCameraMessage", **look, **window}))
            await asyncio.sleep(0.3)
            await socket.send(msgspec.msgpack.encode({**click, **ray}))
            await asyncio.sleep(0.7)

    asyncio.run(tapped())
    assert "sides_confirmed" not in family.marks(case)
    family.post(f"/cases/{case}/size", size="right", side="left")
    asyncio.run(tapped())
    assert family.marks(case)["placed"]["suprasternal_notch"][:2] == pytest.approx(navel[:2], abs=1e-4)


def test_a_huge_frame_ends_the_connection(family: Family, case: str) -> None:
    async def code() -> int | None:
        async with dial(family, case) as socket:
            await socket.send(b"x" * 70_000)
            await asyncio.wait_for(socket.wait_closed(), 20)
            return socket.close_code

    assert asyncio.run(code()) == 1009


@pytest.mark.parametrize("name", ["websocket", "playbackPath"])
def test_a_view_that_should_listen_to_strangers_is_refused(family: Family, case: str, name: str) -> None:
    family.get(f"/view/{case}/?{name}=wss://elsewhere.example", 400)


def test_the_live_page_carries_the_policy_that_binds_it(family: Family, case: str) -> None:
    policy = family.http.get(f"/view/{case}/").headers["content-security-policy"]
    assert "default-src 'none'" in policy
    assert "connect-src 'self' blob: data:;" in policy
    assert "unsafe-eval" not in policy.replace("wasm-unsafe-eval", "")


def test_a_view_is_only_there_once_the_scan_was_checked(family: Family) -> None:
    case = family.opened()
    family.get(f"/view/{case}/", 404)


def test_the_page_is_told_when_its_view_is_connected_and_when_it_is_lost(family: Family, case: str) -> None:
    async def told() -> list[bool]:
        heard: list[bool] = []
        address = family.service.settings.address
        http = httpx.AsyncClient(base_url=address, cookies=family.http.cookies, timeout=30)
        async with http, http.stream("GET", f"/cases/{case}/points/live") as stream:
            lines = stream.aiter_lines()
            heard.append(await _connected(lines))
            async with dial(family, case):
                heard.append(await _connected(lines))
            heard.append(await _connected(lines))
        return heard

    assert asyncio.run(told()) == [False, True, False]


async def _connected(lines: AsyncIterator[str]) -> bool:
    async for line in lines:
        if line.startswith("data:"):
            return bool(json.loads(line.removeprefix("data:"))["connected"])
    raise AssertionError("the stream ended")
