"""Japanese lines end where a reader takes a breath."""

from __future__ import annotations

import pytest

from lubdub.report.line_breaks import broken, phrases

SENTENCE = (
    "胸骨の上の端（のどのくぼみのすぐ下にある、硬いふち）から始めます。"
    "皮膚に沿って、まっすぐ下へ3.5 cm（指2本分くらい）進みます。"
)


@pytest.mark.parametrize(
    ("text", "split"),
    [
        ("胸骨の上の端から始めます。", "胸骨の|上の|端から|始めます。"),
        ("下へ3.5\u00a0cm（指2本分くらい）進みます。", "下へ|3.5\u00a0cm|（指2本分くらい）|進みます。"),
        ("次に、お子さんから見て左へ進みます。", "次に、|お子さんから|見て|左へ|進みます。"),
        ("「100 %」で印刷してください。", "「100 %」で|印刷してください。"),
        ("LiDARスキャンを選びます。", "LiDARスキャンを|選びます。"),
    ],
)
def test_a_phrase_ends_after_its_particle(text: str, split: str) -> None:
    assert phrases(text) == split.split("|")


@pytest.mark.parametrize("width", [8, 11, 15, 23, 200])
def test_no_line_is_too_wide_and_none_begins_with_a_full_stop(width: int) -> None:
    lines = broken(SENTENCE, width, len).split("\n")
    assert "".join(lines) == SENTENCE
    assert all(len(line) <= width for line in lines if len(phrases(line)) > 1)
    assert not [line for line in lines if line[0] in "、。）」"]


def test_lines_that_stand_already_stay() -> None:
    assert broken("一つ目。\n二つ目。", 100, len) == "一つ目。\n二つ目。"
