"""The sheet prints at its true size, fits the paper, and what is on it reads as the stickers it shows."""

from __future__ import annotations

import re
import zlib
from itertools import combinations, pairwise

import numpy as np
import pypdfium2
import pytest

from lubdub.geometry.stickers import STICKERS, Sticker, StickerSize
from lubdub.landmarks.stickers import marks_in
from lubdub.report.stationery import PAPERS, Paper
from lubdub.report.sticker_sheet import CHECK_MM, EDGE, sticker_middle, sticker_sheet, sticker_words
from lubdub.web.languages import NAMES, words_of

MM = 72 / 25.4
"""Points of a PDF in a millimetre."""
PIXELS_PER_MM = 4
SHEETS: list[tuple[Paper, StickerSize]] = [("a4", "large"), ("a4", "small"), ("letter", "large"), ("letter", "small")]
NUMBER = r"(-?[\d.]+)"


def drawn(sheet: bytes) -> str:
    """The drawing commands of the only page."""
    packed = re.findall(rb"stream\r?\n(.*?)\r?\nendstream", sheet, re.S)
    return max((zlib.decompress(one).decode("latin-1") for one in packed if one[:1] == b"x"), key=len)


def black_rectangles(sheet: bytes) -> list[tuple[float, float, float, float]]:
    """Left, foot, width and height in points, of what is filled in black."""
    found = re.findall(rf"{NUMBER} {NUMBER} {NUMBER} {NUMBER} re f", drawn(sheet))
    return [tuple(map(float, numbers)) for numbers in found]  # type: ignore[misc]


def printed(sheet: bytes, paper: Paper) -> np.ndarray:
    """The black parts of the page as a picture."""
    width, height = PAPERS[paper]
    page = np.full((round(height * PIXELS_PER_MM), round(width * PIXELS_PER_MM)), 255, np.uint8)
    for left, foot, wide, high in black_rectangles(sheet):
        top, bottom = sorted(height - one / MM for one in (foot, foot + high))
        rows = slice(round(top * PIXELS_PER_MM), round(bottom * PIXELS_PER_MM))
        page[rows, round(left / MM * PIXELS_PER_MM) : round((left + wide) / MM * PIXELS_PER_MM)] = 0
    return page


def on_sheet(size: StickerSize) -> list[Sticker]:
    return [one for one in STICKERS if one.size == size]


@pytest.mark.parametrize(("paper", "size"), SHEETS)
def test_the_detector_reads_both_stickers_off_the_page_in_their_printed_size(paper: Paper, size: StickerSize) -> None:
    marks = {mark.sticker: mark for mark in marks_in(printed(sticker_sheet(paper, size), paper))}
    assert set(marks) == set(on_sheet(size))
    for sticker, mark in marks.items():
        sides = [np.linalg.norm(a - b) / PIXELS_PER_MM for a, b in pairwise([*mark.corners, mark.corners[0]])]
        assert np.abs(np.array(sides) - sticker.mark_mm).max() < 0.3
        middle = np.array(sticker_middle(PAPERS[paper][0], sticker.bone))
        assert np.abs(mark.corners.mean(axis=0) / PIXELS_PER_MM - middle).max() < 0.3
        assert not mark.is_mirrored


@pytest.mark.parametrize(("paper", "size"), SHEETS)
def test_the_line_to_check_is_exactly_as_long_as_it_says(paper: Paper, size: StickerSize) -> None:
    lines = re.findall(rf"{NUMBER} {NUMBER} m\s+{NUMBER} {NUMBER} l", drawn(sticker_sheet(paper, size)))
    level = [float(x1) - float(x0) for x0, y0, x1, y1 in lines if y0 == y1]
    assert any(abs(length / MM - CHECK_MM) < 0.01 for length in level)
    assert f"{CHECK_MM:g} mm" in sticker_words(size).check


@pytest.mark.parametrize(("paper", "size"), SHEETS)
def test_everything_stands_on_the_one_page(paper: Paper, size: StickerSize) -> None:
    sheet = sticker_sheet(paper, size)
    width, height = (side * MM for side in PAPERS[paper])
    assert sheet.count(b"/Type /Page\n") == 1
    box = re.search(rb"/MediaBox \[0 0 ([\d.]+) ([\d.]+)\]", sheet)
    assert box is not None
    assert np.allclose([float(one) for one in box.groups()], (width, height), atol=0.1)
    heights = [float(y) for _, y in re.findall(rf"BT {NUMBER} {NUMBER} Td", drawn(sheet))]
    assert len(heights) > 15
    assert min(heights) > EDGE * MM
    assert max(heights) < height - 10 * MM


@pytest.mark.parametrize("language", NAMES)
@pytest.mark.parametrize(("paper", "size"), SHEETS)
def test_no_words_lie_on_others_in_any_language(paper: Paper, size: StickerSize, language: str) -> None:
    sheet = sticker_sheet(paper, size, sticker_words(size, words_of(language).gettext), language)
    text = pypdfium2.PdfDocument(sheet)[0].get_textpage()
    lines = [text.get_rect(number) for number in range(text.count_rects())]
    assert len(lines) > 15
    assert min(foot for _, foot, _, _ in lines) > EDGE * MM
    crossing = [
        (a, b)
        for a, b in combinations(lines, 2)
        if min(a[2], b[2]) - max(a[0], b[0]) > 1 and min(a[3], b[3]) - max(a[1], b[1]) > 1
    ]
    assert crossing == []


def test_readers_are_told_to_print_at_true_size() -> None:
    assert b"/PrintScaling /None" in sticker_sheet()


@pytest.mark.parametrize(("paper", "size"), SHEETS)
def test_the_same_sheet_is_the_same_bytes(paper: Paper, size: StickerSize) -> None:
    assert sticker_sheet(paper, size) == sticker_sheet(paper, size)


@pytest.mark.parametrize("size", ["small", "large"])
def test_the_words_are_short_enough_for_a_child_of_ten(size: StickerSize) -> None:
    words = sticker_words(size)
    said = " ".join(one for one in vars(words).values() if isinstance(one, str))
    sentences = [one for one in re.split(r"[.:]\s", said) if one.strip()]
    lengths = [len(one.split()) for one in sentences]
    assert np.mean(lengths) < 12
    assert max(lengths) < 25
    letters = [len(word) for word in re.findall(r"[A-Za-z]+", said)]
    assert np.mean(letters) < 4.6
