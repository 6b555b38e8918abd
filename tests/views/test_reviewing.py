"""Judging a result: what is shown, and dragging areas and landmarks along the skin."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import viser

from lubdub.geometry.surface import Surface
from lubdub.results import AREA_NAMES, Fit, Outcome
from lubdub.views.reviewing import ReviewView, Shown, misfit_colours
from lubdub.views.scene import VIEW
from tests.views import sample


@dataclass
class Moves:
    areas: list[tuple[str, np.ndarray]] = field(default_factory=list)
    landmarks: list[tuple[str, np.ndarray]] = field(default_factory=list)


def outcome() -> Outcome:
    """The sample with a fitted body that lies 3 mm in front of its skin."""
    skin = sample.clean_scan().display
    body = Surface(skin.vertices + np.array([0.0, 0.0, 3.0]), skin.triangles)
    return replace(sample.outcome(), fit=Fit(body, {}, {}, 3.0, 1.0, 0.5))


@pytest.fixture
def moves() -> Moves:
    return Moves()


@pytest.fixture
def view(server: viser.ViserServer, moves: Moves) -> ReviewView:
    return ReviewView(
        server,
        outcome(),
        lambda name, place: moves.areas.append((name, place)),
        lambda name, place: moves.landmarks.append((name, place)),
        6.0,
    )


def node(server: viser.ViserServer, name: str) -> Any:
    return server.scene.get_handle_by_name(name)


def listeners(server: viser.ViserServer, name: str) -> list[Any]:
    return list(node(server, name)._impl.drag_cb)


def drag(server: viser.ViserServer, name: str, start: np.ndarray, by: np.ndarray) -> None:
    """As a hand would: hold the thing a little above its place, and let go elsewhere."""
    eye = start + np.array([0.0, 0.0, 600.0])
    held = start + np.array([1.0, 2.0, 4.8])
    client = SimpleNamespace(camera=SimpleNamespace(position=eye * VIEW))
    (listener,) = listeners(server, name)
    for phase in ("start", "update", "end"):
        event = SimpleNamespace(
            phase=phase,
            client=client,
            start_position=tuple(held * VIEW),
            end_position=tuple((held + by) * VIEW),
        )
        listener.callback(event)


def test_one_layer_is_shown_at_a_time_and_the_veil_lies_over_the_skin(
    view: ReviewView, server: viser.ViserServer
) -> None:
    assert view.layers == ("skin", "fitted", "misfit")
    for layer, visible in (("skin", {"/skin"}), ("fitted", {"/skin", "/fitted"}), ("misfit", {"/misfit"})):
        view.show(Shown(outcome(), layer))  # type: ignore[arg-type]
        assert {name for name in ("/skin", "/fitted", "/misfit") if node(server, name).visible} == visible


def test_a_method_without_a_fitted_body_has_the_skin_alone(server: viser.ViserServer) -> None:
    view = ReviewView(server, sample.outcome(), lambda name, place: None, lambda name, place: None)
    assert view.layers == ("skin",)


def test_without_areas_there_is_nothing_to_review(server: viser.ViserServer) -> None:
    with pytest.raises(ValueError, match="no result"):
        ReviewView(server, replace(sample.outcome(), areas={}), lambda name, place: None, lambda name, place: None)


def test_gaps_grow_from_light_to_dark() -> None:
    colours = misfit_colours(np.array([0.0, 2.5, 5.0, 7.5, 10.0, 40.0])).astype(float)
    brightness = colours @ np.array([0.3, 0.6, 0.1])
    assert (np.diff(brightness)[:4] < -5).all()
    assert (colours[-1] == colours[-2]).all()


def test_a_moved_area_is_drawn_where_it_is_and_a_ring_where_it_was(view: ReviewView, server: viser.ViserServer) -> None:
    computed = outcome()
    moved = replace(computed.areas["mitral"], position=computed.areas["mitral"].position + np.array([8.0, 0.0, 0.0]))
    now = replace(computed, areas={**computed.areas, "mitral": moved})
    view.show(Shown(now))
    letter = node(server, "/areas/mitral/letter")
    assert np.linalg.norm(np.asarray(letter.position) / VIEW - moved.position) < 6.0
    assert node(server, "/former/mitral") is not None
    assert node(server, "/former/aortic") is None
    view.show(Shown(now, is_before=True))
    letter = node(server, "/areas/mitral/letter")
    assert np.linalg.norm(np.asarray(letter.position) / VIEW - computed.areas["mitral"].position) < 6.0
    assert node(server, "/former/mitral") is None


@pytest.mark.parametrize("part", ["letter", "region"])
@pytest.mark.parametrize("name", AREA_NAMES)
def test_a_dragged_area_lands_on_the_skin(
    view: ReviewView, server: viser.ViserServer, moves: Moves, name: str, part: str
) -> None:
    view.show(Shown(outcome()))
    start = outcome().areas[name].position  # type: ignore[index]
    drag(server, f"/areas/{name}/{part}", start, np.array([10.0, -4.0, 15.0]))
    ((moved, place),) = moves.areas
    assert moved == name
    assert np.linalg.norm(place[:2] - start[:2] - [10.0, -4.0]) < 3.0
    assert abs(place[2] - start[2]) < 8.0


def test_a_dragged_landmark_lands_on_the_skin(view: ReviewView, server: viser.ViserServer, moves: Moves) -> None:
    view.show(Shown(outcome()))
    assert listeners(server, "/landmarks/xiphisternum") == [], "a dot keeps nobody from dragging what lies under it"
    view.show(Shown(outcome(), has_pins=True))
    start = outcome().landmarks["xiphisternum"].position
    drag(server, "/landmarks/xiphisternum", start, np.array([0.0, 10.0, 0.0]))
    ((moved, place),) = moves.landmarks
    assert moved == "xiphisternum"
    assert place[1] - start[1] == pytest.approx(10.0, abs=1.5)
    assert moves.areas == []


def test_dragged_off_the_body_it_stays_where_it_was(view: ReviewView, server: viser.ViserServer, moves: Moves) -> None:
    view.show(Shown(outcome()))
    drag(server, "/areas/mitral/letter", outcome().areas["mitral"].position, np.array([900.0, 0.0, 0.0]))
    assert moves.areas == []


def test_the_computed_picture_cannot_be_dragged(view: ReviewView, server: viser.ViserServer) -> None:
    parts = ("/areas/mitral/letter", "/areas/mitral/region", "/landmarks/navel")
    view.show(Shown(outcome(), has_pins=True))
    assert all(len(listeners(server, part)) == 1 for part in parts)
    view.show(Shown(outcome(), is_before=True, has_pins=True))
    assert not any(listeners(server, part) for part in parts)
    assert node(server, "/pins/navel") is None
