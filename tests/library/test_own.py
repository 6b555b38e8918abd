"""Signed cases as reference bodies."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lubdub.geometry.surface import Surface
from lubdub.library.load import SHIPPED, load_library
from lubdub.library.own import OwnBody, add_body, cards, check, disable, faults
from lubdub.results import Reference


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A clinic's own references: one body so far."""
    shutil.copytree(SHIPPED / "bodies" / "girl-06", tmp_path / "bodies" / "girl-06")
    return tmp_path


@pytest.fixture(scope="module")
def girl() -> Reference:
    return next(one for one in load_library().references if one.id == "girl-08-heavy")


def signed(girl: Reference) -> OwnBody:
    """As a fit would leave her: elsewhere, with a mitral place a clinician moved."""
    away = np.array([3.0, 250.0, -40.0])
    moved = {**girl.areas, "mitral": girl.areas["mitral"] + np.array([9.0, 0.0, 0.0])}
    return OwnBody(
        surface=Surface(girl.surface.vertices + away, girl.surface.triangles),
        landmarks={name: place + away for name, place in girl.landmarks.items()},
        areas={name: place + away for name, place in moved.items()},
        age_years=8.4,
        sex="female",
        placed_by="Dr. Aiko Mori",
        case="c" * 32,
    )


def test_a_signed_case_serves_beside_the_other_bodies(folder: Path, girl: Reference) -> None:
    before = load_library(folder).sha256
    name = add_body(folder, signed(girl))
    library = load_library(folder)
    own = next(one for one in library.references if one.id == name)
    assert {one.id for one in library.references} == {"girl-06", name}
    assert library.sha256 != before
    np.testing.assert_allclose(own.surface.vertices, girl.surface.vertices, atol=0.01)
    np.testing.assert_allclose(own.landmarks["suprasternal_notch"], 0.0, atol=0.5)
    assert own.areas["mitral"][0] - girl.areas["mitral"][0] == pytest.approx(9.0, abs=4.0)
    assert own.card["placed_by"] == "Dr. Aiko Mori"
    assert own.card["age_years"] == 8.0
    assert faults(own) == []


def test_a_new_folder_begins_with_the_shipped_bodies(tmp_path: Path, girl: Reference) -> None:
    add_body(tmp_path / "ours", signed(girl))
    assert len(load_library(tmp_path / "ours").references) == len(load_library().references) + 1


def test_a_disabled_body_serves_no_more(folder: Path, girl: Reference) -> None:
    name = add_body(folder, signed(girl))
    assert disable(folder, name)
    assert [one.id for one in load_library(folder).references] == ["girl-06"]
    assert [card["id"] for card in cards(folder) if card.get("disabled")] == [name]
    for nobody in ("nobody", "", "../girl-06"):
        assert not disable(folder, nobody)


def test_one_case_is_one_body(folder: Path, girl: Reference) -> None:
    add_body(folder, signed(girl))
    with pytest.raises(ValueError, match="already"):
        add_body(folder, signed(girl))


def test_what_cannot_serve_is_refused_and_leaves_nothing(folder: Path, girl: Reference) -> None:
    good = signed(girl)
    fewer = Surface(good.surface.vertices[:100], np.zeros((0, 3), int))
    far = {**good.areas, "aortic": good.areas["aortic"] + np.array([0.0, 0.0, 60.0])}
    some = {name: place for name, place in good.landmarks.items() if name != "navel"}
    for broken in (replace(good, surface=fewer), replace(good, areas=far), replace(good, landmarks=some)):
        with pytest.raises(ValueError, match=r"topology|reach|navel"):
            add_body(folder, broken)
    assert len(cards(folder)) == 1


def test_the_check_names_what_is_wrong(girl: Reference) -> None:
    assert set(map(tuple, check(None).values())) == {()}
    swapped = {
        **girl.landmarks,
        "nipple_left": girl.landmarks["nipple_right"],
        "nipple_right": girl.landmarks["nipple_left"],
    }
    assert faults(replace(girl, landmarks=swapped)) == ["left and right are swapped"]
    off = {**girl.areas, "aortic": girl.areas["aortic"] + np.array([0.0, 0.0, 30.0])}
    assert faults(replace(girl, areas=off)) == ["aortic does not lie on the skin"]
