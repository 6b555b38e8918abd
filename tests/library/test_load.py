"""The reference library: what is read, and what is refused."""

from __future__ import annotations

import json
import shutil
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest

from lubdub.library.load import SHIPPED, LibraryDamaged, load_library
from lubdub.results import AREA_NAMES, LANDMARK_NAMES, Library


@pytest.fixture(scope="module")
def library() -> Library:
    return load_library()


@pytest.fixture
def copied(tmp_path: Path) -> Path:
    """A library of two bodies with its own topology and basis."""
    for name in ("manifest.json", "topology.npz", "basis.npz", "signs.npz"):
        shutil.copy(SHIPPED / name, tmp_path / name)
    for body in ("man-25", "girl-06"):
        shutil.copytree(SHIPPED / "bodies" / body, tmp_path / "bodies" / body)
    return tmp_path


def flip_a_byte(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 0xFF
    path.write_bytes(bytes(content))


def test_at_least_24_bodies_share_one_topology(library: Library) -> None:
    assert len(library.references) >= 24
    assert {reference.surface.vertices.shape for reference in library.references} == {library.basis.mean.shape}
    assert all(np.array_equal(one.surface.triangles, library.basis.triangles) for one in library.references)


def test_every_reference_has_all_landmarks_and_areas_by_name(library: Library) -> None:
    for reference in library.references:
        assert tuple(reference.landmarks) == LANDMARK_NAMES
        assert tuple(reference.areas) == AREA_NAMES


def test_the_basis_has_consistent_shapes(library: Library) -> None:
    basis = library.basis
    assert basis.modes.shape == (len(basis.modes), *basis.mean.shape)
    assert 100 <= len(basis.modes) <= 140
    assert basis.landmark_corners.shape == basis.landmark_weights.shape == (5, 3)
    assert basis.area_corners.shape == basis.area_weights.shape == (2, 4, 3)
    np.testing.assert_allclose(basis.area_weights.sum(axis=-1), 1.0, atol=1e-4)
    assert basis.data_weight.min() == 0.0
    assert basis.data_weight.max() == 1.0


def test_the_same_files_give_the_same_library_hash(copied: Path) -> None:
    assert load_library(copied).sha256 == load_library(copied).sha256


def test_another_card_gives_another_library_hash(copied: Path) -> None:
    before = load_library(copied).sha256
    path = copied / "bodies" / "man-25" / "card.json"
    card = json.loads(path.read_text())
    path.write_text(json.dumps(card | {"placed_by": "Dr Example"}))
    assert load_library(copied).sha256 != before


@pytest.mark.parametrize("name", ["topology.npz", "basis.npz", "signs.npz", "bodies/man-25/body.npz"])
def test_a_damaged_file_is_refused_by_name(copied: Path, name: str) -> None:
    flip_a_byte(copied / name)
    with pytest.raises(LibraryDamaged, match=Path(name).name):
        load_library(copied)


@pytest.mark.parametrize("name", ["topology.npz", "basis.npz", "signs.npz", "bodies/man-25/body.npz"])
def test_a_missing_file_is_refused_by_name(copied: Path, name: str) -> None:
    (copied / name).unlink()
    with pytest.raises(LibraryDamaged, match=rf"{Path(name).name} is missing"):
        load_library(copied)


def test_a_card_that_is_no_json_is_refused(copied: Path) -> None:
    (copied / "bodies" / "man-25" / "card.json").write_text("{")
    with pytest.raises(LibraryDamaged):
        load_library(copied)


def test_a_body_of_another_topology_is_refused(copied: Path) -> None:
    flat = copied / "bodies" / "man-25"
    with np.load(flat / "body.npz") as archive:
        arrays = {name: archive[name] for name in archive.files}
    np.savez(flat / "body.npz", **(arrays | {"vertices": arrays["vertices"][:-1]}))
    card = json.loads((flat / "card.json").read_text())
    card["sha256"] = sha256((flat / "body.npz").read_bytes()).hexdigest()
    (flat / "card.json").write_text(json.dumps(card))
    with pytest.raises(LibraryDamaged):
        load_library(copied)


def test_a_folder_without_bodies_is_refused(tmp_path: Path) -> None:
    with pytest.raises(LibraryDamaged, match="no reference bodies"):
        load_library(tmp_path)


def test_a_folder_with_bodies_alone_borrows_the_shipped_basis(copied: Path, library: Library) -> None:
    for name in ("manifest.json", "topology.npz", "basis.npz", "signs.npz"):
        (copied / name).unlink()
    loaded = load_library(copied)
    assert [reference.id for reference in loaded.references] == ["girl-06", "man-25"]
    np.testing.assert_array_equal(loaded.basis.mean, library.basis.mean)
