"""Marking points by tapping, dragging and aiming."""

from __future__ import annotations

from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import viser

from lubdub.results import LandmarkName
from lubdub.views.placing import MissedTheBody, NotOneViewer, PlacingView, live_page
from lubdub.views.scene import VIEW
from tests.views import sample


@dataclass
class Placed:
    calls: list[tuple[LandmarkName, np.ndarray]] = field(default_factory=list)

    def __call__(self, name: LandmarkName, place: np.ndarray) -> None:
        self.calls.append((name, place))


def tap(at: np.ndarray) -> Any:
    eye = at + np.array([40.0, -30.0, 600.0])
    direction = (at - eye) / np.linalg.norm(at - eye)
    return SimpleNamespace(ray_origin=tuple(eye * VIEW), ray_direction=tuple(direction))


@pytest.fixture
def placed() -> Placed:
    return Placed()


@pytest.fixture
def view(server: viser.ViserServer, placed: Placed) -> PlacingView:
    return PlacingView(server, sample.clean_scan(), sample.landmarks("suggested"), placed)


def test_a_tap_marks_the_point_asked_for_where_it_hit(view: PlacingView, placed: Placed) -> None:
    wanted = sample.BODY.landmarks["suprasternal_notch"]
    view.target = "suprasternal_notch"
    view._tapped(tap(wanted))
    ((name, place),) = placed.calls
    assert name == "suprasternal_notch"
    assert np.linalg.norm(place - wanted) < 1.0


def test_a_tap_marks_nothing_when_no_point_is_asked_for(view: PlacingView, placed: Placed) -> None:
    view._tapped(tap(sample.BODY.landmarks["navel"]))
    assert placed.calls == []


def test_a_tap_beside_the_body_marks_nothing(view: PlacingView, placed: Placed) -> None:
    view.target = "navel"
    view._tapped(tap(np.array([900.0, 0.0, 0.0])))
    assert placed.calls == []


def test_a_dragged_pin_is_put_back_on_the_skin(view: PlacingView, placed: Placed) -> None:
    start = sample.BODY.landmarks["nipple_left"]
    eye = start + np.array([0.0, 0.0, 600.0])
    above = start + np.array([10.0, 5.0, 20.0])
    client = SimpleNamespace(camera=SimpleNamespace(position=eye * VIEW))
    for phase in ("start", "update", "end"):
        held = start + np.array([0.0, 12.0, 15.0])
        moved = held + above - start
        event = SimpleNamespace(
            phase=phase, client=client, start_position=tuple(held * VIEW), end_position=tuple(moved * VIEW)
        )
        view._dragged("nipple_left", start, event)
    ((name, place),) = placed.calls
    assert name == "nipple_left"
    assert abs(place[2] - start[2]) < 8.0
    assert np.linalg.norm(place[:2] - above[:2]) < 2.0


def test_aiming_needs_exactly_one_viewer(view: PlacingView) -> None:
    view.target = "navel"
    with pytest.raises(NotOneViewer):
        view.place_at_crosshair()


def looking(eye: np.ndarray, at: np.ndarray) -> Any:
    forward = (at - eye) / np.linalg.norm(at - eye)
    right = np.cross(forward, [0.0, 1.0, 0.0])
    right /= np.linalg.norm(right)
    turned = np.stack([right, np.cross(forward, right), forward], axis=1)
    camera = SimpleNamespace(position=eye * VIEW, wxyz=viser.transforms.SO3.from_matrix(turned).wxyz)
    return {0: SimpleNamespace(camera=camera)}


def test_the_crosshair_marks_what_the_middle_of_the_view_shows(
    view: PlacingView, placed: Placed, server: viser.ViserServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    wanted = sample.BODY.landmarks["xiphisternum"]
    clients = looking(wanted + np.array([100.0, 50.0, 500.0]), wanted)
    monkeypatch.setattr(server, "get_clients", lambda: clients)
    view.target = "xiphisternum"
    assert np.linalg.norm(view.place_at_crosshair() - wanted) < 1.0
    assert [name for name, _ in placed.calls] == ["xiphisternum"]


def test_the_crosshair_beside_the_body_says_so(
    view: PlacingView, server: viser.ViserServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    clients = looking(np.array([0.0, 0.0, 600.0]), np.array([700.0, 0.0, 0.0]))
    monkeypatch.setattr(server, "get_clients", lambda: clients)
    view.target = "navel"
    with pytest.raises(MissedTheBody):
        view.place_at_crosshair()


def test_pins_that_are_no_longer_wanted_go(view: PlacingView, server: viser.ViserServer) -> None:
    view.show(sample.landmarks())
    view.show({name: mark for name, mark in sample.landmarks().items() if name == "navel"})
    assert server.scene.get_handle_by_name("/landmarks/navel") is not None
    assert server.scene.get_handle_by_name("/pins/nipple_left") is None
    assert server.scene.get_handle_by_name("/landmarks/nipple_left") is None


def test_the_live_page_is_visers_own_with_its_panel_hidden() -> None:
    page = live_page()
    assert "floating-panel" in page
    assert "display:none!important" in page
    assert page.index("viserInside = ") < page.index("viserInside()") < page.rindex("</body>")
