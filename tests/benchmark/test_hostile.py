from __future__ import annotations

import numpy as np
import pytest

from lubdub.scans.read import read_scan
from tests.benchmark.hostile import read_batch, report
from tests.benchmark.hostile_child import is_confirmed, is_same, verdict_on
from tests.benchmark.mutants import DAMAGES, mutant, originals
from tests.writers import write_ply, write_stl


@pytest.mark.parametrize("kind", list(originals()))
def test_a_second_reader_finds_in_every_sound_file_what_ours_does(kind: str) -> None:
    data = originals()[kind]
    read = read_scan(data).surface
    assert verdict_on(data, read, kind) == "same"
    assert is_confirmed(read, data, kind)


@pytest.mark.parametrize("kind", list(originals()))
def test_a_damaged_file_is_the_same_whenever_it_is_made(kind: str) -> None:
    assert [mutant(3, kind, number) for number in range(5)] == [mutant(3, kind, number) for number in range(5)]
    assert {mutant(3, kind, number).how for number in range(5)} == set(DAMAGES)
    assert mutant(3, kind, 1) != mutant(4, kind, 1)


def test_a_file_taken_for_what_it_is_not_is_a_wrong_verdict() -> None:
    sound = read_scan(originals()["ply"]).surface
    moved = type(sound)(sound.vertices + [5.0, 0.0, 0.0], sound.triangles)
    assert not is_same(moved, sound)
    assert is_confirmed(moved, write_ply(moved), "ply")
    assert not is_confirmed(moved, write_ply(sound), "ply")
    assert not is_confirmed(moved, write_stl(moved)[:-7], "stl")


def test_a_point_that_moved_by_less_than_a_scanner_sees_is_where_it_was() -> None:
    sound = read_scan(originals()["ply"]).surface
    nudged = type(sound)(sound.vertices + np.array([0.0, 0.4, 0.0]), sound.triangles)
    assert is_same(nudged, sound)
    assert not is_same(type(sound)(sound.vertices, sound.triangles[:, ::-1]), sound)


def test_damaged_files_end_in_a_right_verdict_and_leave_the_worker_alive() -> None:
    rows = [row for kind in ("ply", "glb", "pcd, text") for row in read_batch(1, kind, range(15))]
    numbers = report(rows).numbers
    assert len(rows) == 45
    assert (numbers["worker_deaths"], numbers["wrong_verdicts"], numbers["child_crashes"]) == (0, 0, 0)
    assert sum(row["verdict"] == "refused" for row in rows) > 15
