"""What goes into the sandboxed child and what comes out, without a child."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from lubdub.geometry.frames import Similarity
from lubdub.geometry.surface import Surface, cloud
from lubdub.jobs.bundle import BadBundle, Bundle
from lubdub.jobs.tasks import _references, surface_ply, with_care_when_unsure
from lubdub.library.marks import AreaMarks, Step, write_marks
from lubdub.library.own import begin, disable
from lubdub.results import AREA_NAMES, CleanScan, Outcome, Reason, Unit, VerdictWord

NO = dict.fromkeys(("heart_on_right", "chest_operation_or_device", "late_pregnancy"), "no")
parts = st.dictionaries(st.text(max_size=8), st.binary(max_size=50), max_size=4)
facts = st.dictionaries(st.text(max_size=5), st.none() | st.booleans() | st.integers() | st.text(), max_size=4)


@given(facts=facts, parts=parts)
def test_a_bundle_comes_back_as_it_was(facts: dict[str, object], parts: dict[str, bytes]) -> None:
    back = Bundle.from_bytes(Bundle(facts, parts).to_bytes())
    assert (dict(back.facts), dict(back.parts)) == (facts, parts)


@given(parts=parts, cut=st.integers(1, 30))
def test_a_cut_or_lengthened_bundle_is_noticed(parts: dict[str, bytes], cut: int) -> None:
    whole = Bundle({}, parts).to_bytes()
    for touched in (whole[:-cut], whole + bytes(cut)):
        with pytest.raises(BadBundle):
            Bundle.from_bytes(touched)


@given(junk=st.binary(max_size=200))
def test_junk_is_no_bundle(junk: bytes) -> None:
    with pytest.raises(BadBundle):
        Bundle.from_bytes(junk)


def test_sizes_below_zero_do_not_make_a_bundle() -> None:
    head = b'{"facts": {}, "parts": [["a", -4], ["b", 4]]}'
    with pytest.raises(BadBundle):
        Bundle.from_bytes(len(head).to_bytes(4, "little") + head)


def outcome(verdict: VerdictWord) -> Outcome:
    reasons = (Reason("mirrored_scan", "m", "a"),) if verdict == "refuse" else ()
    return Outcome(verdict, reasons, {}, {}, None, None, (), None, None, {}, {})


@pytest.mark.parametrize("verdict", ["show", "show_with_care"])
def test_an_answer_nobody_was_sure_of_is_shown_with_care(verdict: VerdictWord) -> None:
    told = with_care_when_unsure(outcome(verdict), NO | {"late_pregnancy": "unsure"})
    assert told.verdict == "show_with_care"
    assert [reason.code for reason in told.reasons] == ["unsure_late_pregnancy"]
    assert len(with_care_when_unsure(outcome(verdict), {}).reasons) == 3


@pytest.mark.parametrize("verdict", ["show", "show_with_care"])
def test_three_times_no_changes_nothing(verdict: VerdictWord) -> None:
    assert with_care_when_unsure(outcome(verdict), NO).verdict == verdict


def test_a_refusal_stays_a_refusal_for_its_own_reason() -> None:
    told = with_care_when_unsure(outcome("refuse"), {})
    assert (told.verdict, [reason.code for reason in told.reasons]) == ("refuse", ["mirrored_scan"])


@pytest.mark.parametrize("is_cloud", [True, False])
def test_the_cleaned_surface_leaves_in_the_files_own_coordinates(is_cloud: bool) -> None:
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    body_from_file = Similarity(1000.0, turn, np.array([5.0, 6.0, 7.0]))
    in_file = np.random.default_rng(1).normal(size=(30, 3))
    skin = body_from_file.apply(in_file)
    surface = cloud(skin) if is_cloud else Surface(skin, np.arange(30).reshape(10, 3))
    scan = CleanScan(skin, skin, np.zeros(30, bool), lambda: surface, body_from_file, Unit("m", 1000.0, "given"))
    back = trimesh.load(io.BytesIO(surface_ply(scan)), file_type="ply", process=False)
    np.testing.assert_allclose(back.vertices, in_file, atol=1e-6)


def test_a_warm_library_follows_what_is_added_marked_and_disabled_without_a_restart(tmp_path: Path) -> None:
    facts = {"references": str(tmp_path)}
    begin(tmp_path)
    before = _references(facts)
    assert _references(facts) is before, "unchanged, it is not read again"
    assert disable(tmp_path, "man-25")
    fewer = _references(facts)
    assert len(fewer.references) == len(before.references) - 1
    body = next(one for one in fewer.references if one.id == "girl-06")
    steps = tuple(Step(name, body.areas[name]) for name in AREA_NAMES)
    for who in ("mori", "silva"):
        marks = AreaMarks(body.id, body.card["sha256"], who, who, "t", steps, 4, "2026-01-02T03:04:05+00:00")
        write_marks(tmp_path, marks)
    (marked,) = (one for one in _references(facts).references if one.id == "girl-06")
    assert marked.card["placed_by"] == "mori and silva"
