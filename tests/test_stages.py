"""The steps that join two rooms: how sure the lie of an unmarked scan must be, and what its second look may do."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lubdub import stages
from lubdub.fitting.pose import find_pose
from lubdub.fitting.shape import Pose, Target
from lubdub.fitting.starts import ended
from lubdub.geometry.frames import Similarity
from lubdub.library.load import load_library
from lubdub.methods import Chest
from lubdub.results import Library, Patient
from lubdub.scans.read import read_scan
from lubdub.stickers import prepare
from tests import bodies

MAN = Patient(40, "male")


@pytest.fixture(scope="module")
def library() -> Library:
    return load_library()


@pytest.fixture(scope="module")
def laid(library: Library) -> stages.Laid:
    """An unmarked torso, turned into the body frame by its shape alone."""
    scan = bodies.noise(bodies.hide_side(bodies.torso_scan()), 1.5)
    ready = prepare(read_scan(bodies.write_ply(scan.surface)), None, {})
    return stages.lay_down(ready.scan, {}, library.basis, MAN)


def shifted(laid: stages.Laid, mm: float, size: float = 1.0) -> stages.Laid:
    """The same, but the fit begins so far towards the head, and so much larger."""
    up = Similarity(size, np.eye(3), np.array([0.0, mm, 0.0]))
    return replace(laid, start=Pose(up.after(laid.start.body_from_basis), laid.start.coefficients))


def left_unexplained_mm(chest: Chest, library: Library) -> float:
    assert chest.pose is not None
    assert chest.fit is not None
    expected = stages.expected(chest.patient, library.basis)
    return ended(chest.pose, chest.fit, library.basis, Target.of(chest.scan), expected).misfit_mm


@pytest.mark.parametrize("mm", [-60.0, 0.0, 60.0])
def test_a_second_look_is_kept_only_where_it_explains_the_scan_better(
    laid: stages.Laid, library: Library, monkeypatch: pytest.MonkeyPatch, mm: float
) -> None:
    looked = stages.understand(shifted(laid, mm), MAN, "lubdub", library)
    monkeypatch.setattr(stages, "_second_look", lambda chest, basis: chest)
    first = stages.understand(shifted(laid, mm), MAN, "lubdub", library)
    assert left_unexplained_mm(looked, library) <= left_unexplained_mm(first, library) + 1e-6


def test_a_fit_that_stuck_below_the_bodys_size_is_freed_by_the_second_look(
    laid: stages.Laid, library: Library, monkeypatch: pytest.MonkeyPatch
) -> None:
    small = shifted(laid, 40.0, size=0.6)
    looked = stages.understand(small, MAN, "lubdub", library)
    monkeypatch.setattr(stages, "_second_look", lambda chest, basis: chest)
    stuck = stages.understand(small, MAN, "lubdub", library)
    assert left_unexplained_mm(looked, library) < 0.7 * left_unexplained_mm(stuck, library)


@pytest.mark.parametrize("years", [40.0, 2.0])
def test_nobody_is_laid_down_who_might_as_well_lie_another_way(
    library: Library, monkeypatch: pytest.MonkeyPatch, years: float
) -> None:
    ready = prepare(read_scan(bodies.write_ply(bodies.hide_side(bodies.torso_scan()).surface)), None, {})
    found = find_pose(ready.scan, library.basis)
    monkeypatch.setattr(stages, "find_pose", lambda *_, **__: replace(found, margin=0.19))
    assert stages.lay_down(ready.scan, {}, library.basis, Patient(years)).given == {}
    monkeypatch.setattr(stages, "find_pose", lambda *_, **__: replace(found, margin=0.17))
    with pytest.raises(stages.LieUnclear):
        stages.lay_down(ready.scan, {}, library.basis, Patient(years))
