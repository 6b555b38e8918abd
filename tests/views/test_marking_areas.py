"""Marking areas on a reference body: what is shown, tapped and dragged."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
import viser

from lubdub.results import AREA_NAMES, Area
from lubdub.views.marking_areas import AreaMarkingView
from lubdub.views.scene import VIEW
from tests.views import sample
from tests.views.test_reviewing import drag, node

MITRAL = sample.BODY.areas["mitral"]


@pytest.fixture
def placed() -> list[tuple[str, np.ndarray]]:
    return []


@pytest.fixture
def view(server: viser.ViserServer, placed: list[tuple[str, np.ndarray]]) -> AreaMarkingView:
    body = sample.clean_scan()
    return AreaMarkingView(server, body, sample.landmarks(), lambda name, place: placed.append((name, place)), 6.0)


def tap(server: viser.ViserServer, name: str, place: np.ndarray) -> None:
    eye = place + np.array([0.0, 0.0, 500.0])
    (listener,) = node(server, name)._impl.click_cb
    event = SimpleNamespace(ray_origin=tuple(eye * VIEW), ray_direction=(0.0, 0.0, -1.0))
    listener.callback(event)


def areas() -> dict:
    return {"mitral": Area(MITRAL, np.array([0.0, 0.0, 1.0]), 8.0, "")}


def test_before_anything_is_marked_no_area_is_in_sight(view: AreaMarkingView, server: viser.ViserServer) -> None:
    view.show({})
    assert not any(node(server, f"/areas/{name}/letter") for name in AREA_NAMES)
    assert node(server, "/landmarks/navel") is not None


def test_a_tap_puts_the_area_in_hand_on_the_skin(
    view: AreaMarkingView, server: viser.ViserServer, placed: list[tuple[str, np.ndarray]]
) -> None:
    tap(server, "/skin", MITRAL)
    assert placed == [], "nothing is in hand"
    view.in_hand = "mitral"
    tap(server, "/skin", MITRAL)
    ((name, place),) = placed
    assert name == "mitral"
    assert np.linalg.norm(place - MITRAL) < 1.5


def test_a_marked_area_can_be_dragged_and_lets_taps_through(
    view: AreaMarkingView, server: viser.ViserServer, placed: list[tuple[str, np.ndarray]]
) -> None:
    view.show(areas())
    drag(server, "/areas/mitral/letter", MITRAL, np.array([-10.0, 4.0, 10.0]))
    ((name, place),) = placed
    assert name == "mitral"
    assert np.linalg.norm(place[:2] - MITRAL[:2] - [-10.0, 4.0]) < 3.0
    view.in_hand = "tricuspid"
    tap(server, "/areas/mitral/letter", MITRAL)
    assert placed[-1][0] == "tricuspid"


def test_an_area_taken_back_leaves_the_picture(view: AreaMarkingView, server: viser.ViserServer) -> None:
    view.show(areas())
    assert node(server, "/areas/mitral/letter") is not None
    view.show({})
    assert not any(node(server, f"/areas/mitral/{part}") for part in ("letter", "ring", "edge", "region"))
