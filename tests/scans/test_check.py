"""Warnings that the cleaned scan itself gives rise to."""

from __future__ import annotations

from dataclasses import replace

import pytest

from lubdub.results import CleanScan, RawScan, Unit
from lubdub.scans.check import check_scan
from lubdub.scans.clean import clean
from lubdub.scans.reasons import TWO_BODIES
from tests.bodies import BodyScan, as_cloud, hide_side, noise, torso_scan


def cleaned(scan: BodyScan) -> CleanScan:
    return clean(RawScan(scan.surface, "ply"), Unit("mm", 1.0, "given"), {})


def codes(scan: CleanScan) -> list[str]:
    return [reason.code for reason in check_scan(scan)]


@pytest.mark.parametrize("size", [0.36, 1.0])
def test_a_good_scan_gives_no_warning(size: float) -> None:
    assert codes(cleaned(as_cloud(noise(hide_side(torso_scan(size=size)), 2.0 * size)))) == []


def test_a_sparse_scan_is_said_to_be_sparse() -> None:
    assert codes(cleaned(hide_side(torso_scan(columns=60, rows=40)))) == ["sparse_scan"]


@pytest.mark.parametrize("size", [0.36, 1.0])
def test_a_rough_scan_is_said_to_be_rough(size: float) -> None:
    assert codes(cleaned(as_cloud(noise(hide_side(torso_scan(size=size)), 8.0 * size)))) == ["noisy_scan"]


def test_what_cleaning_noticed_is_passed_on() -> None:
    scan = replace(cleaned(hide_side(torso_scan())), warnings=(TWO_BODIES,))
    assert codes(scan) == ["two_bodies"]
