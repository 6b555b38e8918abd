"""The sheet to print is one page, true to scale, and says what the page says; read back by a PDF library."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pypdfium2
import pytest

from lubdub.areas.words import instruction
from lubdub.geometry.raycast import SkinCaster
from lubdub.geometry.whereabouts import whereabouts
from lubdub.report.listening_sheet import BAR_MM, CARD_MM, EDGE, listening_sheet, window_for
from lubdub.report.listening_words import ListeningFacts, PlaceWords, listening_words
from lubdub.report.marks import STYLES
from lubdub.report.stationery import PAPERS, Paper
from lubdub.results import Outcome
from tests.views import sample

OUTCOME = sample.outcome()
PIXELS_PER_MM = 8
WORDS = listening_words(str)
TITLES = {"aortic": "Aortic", "pulmonary": "Pulmonary", "tricuspid": "Tricuspid", "mitral": "Mitral"}


def facts(outcome: Outcome = OUTCOME, **changes: object) -> ListeningFacts:
    assert outcome.scan is not None
    skin, notch = SkinCaster(outcome.scan.display), outcome.landmarks["suprasternal_notch"].position
    places = tuple(
        PlaceWords(name, TITLES[name], instruction(whereabouts(skin, area.position, notch)), "Sure to about 1 cm.")
        for name, area in outcome.areas.items()
    )
    made = ListeningFacts("For: 6 years old, case abc123.", "23 November 2026", "Lie on the back.", 33.0, places)
    return replace(made, **changes)  # type: ignore[arg-type]


def text_of(sheet: bytes) -> str:
    document = pypdfium2.PdfDocument(sheet)
    assert len(document) == 1
    return " ".join(document[0].get_textpage().get_text_range().split())


def picture_of(sheet: bytes) -> np.ndarray:
    """The page as printed. (h, w, 3) uint8"""
    page = pypdfium2.PdfDocument(sheet)[0]
    return np.asarray(page.render(scale=PIXELS_PER_MM * 25.4 / 72).to_pil().convert("RGB"))


def runs(dark: np.ndarray) -> list[tuple[float, float]]:
    """(start, length) in mm of each unbroken run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], dark, [False]]).astype(int)))
    return [(a / PIXELS_PER_MM, (b - a) / PIXELS_PER_MM) for a, b in zip(edges[::2], edges[1::2], strict=True)]


@pytest.mark.parametrize("paper", ["a4", "letter"])
def test_it_is_one_page_of_the_right_paper(paper: Paper) -> None:
    sheet = listening_sheet(OUTCOME, facts(), WORDS, paper)
    document = pypdfium2.PdfDocument(sheet)
    assert len(document) == 1
    assert np.array(document[0].get_size()) / 72 * 25.4 == pytest.approx(np.array(PAPERS[paper]), abs=0.1)
    assert b"/PrintScaling /None" in sheet


@pytest.mark.parametrize("paper", ["a4", "letter"])
def test_the_bars_to_check_the_printer_by_have_their_true_length(paper: Paper) -> None:
    dark = picture_of(listening_sheet(OUTCOME, facts(), WORDS, paper)).max(axis=2) < 120
    found = runs(dark[round(34.0 * PIXELS_PER_MM)])
    assert [start for start, _ in found] == pytest.approx([EDGE, EDGE + 68], abs=0.4)
    assert [length for _, length in found] == pytest.approx([BAR_MM, CARD_MM], abs=0.6)


def test_a_childs_places_are_printed_in_true_size() -> None:
    window = window_for(OUTCOME, 33.0, "a4")
    assert window.scale == 1.0
    aortic, mitral = (OUTCOME.areas[name].position for name in ("aortic", "mitral"))
    apart = np.subtract(window.at(mitral), window.at(aortic))
    assert apart == pytest.approx((mitral - aortic)[:2] * [1, -1])
    assert "drawn in its true size" in text_of(listening_sheet(OUTCOME, facts(), WORDS))


def test_the_rings_are_drawn_as_large_as_the_chestpiece() -> None:
    picture = picture_of(listening_sheet(OUTCOME, facts(), WORDS)).astype(int)
    window = window_for(OUTCOME, 33.0, "a4")
    x, y = window.at(OUTCOME.areas["tricuspid"].position)
    coloured = np.abs(picture[round(y * PIXELS_PER_MM)] - STYLES["tricuspid"].colour).max(axis=1) < 30
    across = [place + length / 2 for place, length in runs(coloured) if abs(abs(place + length / 2 - x) - 16.5) < 1]
    assert max(across) - min(across) == pytest.approx(33.0, abs=0.5)


def test_a_body_too_large_for_the_paper_is_drawn_smaller_and_says_so() -> None:
    grown = replace(
        OUTCOME,
        areas={name: replace(area, position=area.position * 1.9) for name, area in OUTCOME.areas.items()},
    )
    window = window_for(grown, 44.0, "a4")
    assert window.scale < 1.0
    page_width, _ = PAPERS["a4"]
    for area in grown.areas.values():
        x, y = window.at(area.position)
        ring = 22.0 * window.scale
        assert EDGE + ring < x < page_width - EDGE - ring
        assert window.top + ring < y < window.top + window.height - ring
    assert f"{round(100 * window.scale)} % of its true size" in text_of(
        listening_sheet(grown, facts(chestpiece_mm=44.0), WORDS)
    )


def test_it_says_what_the_page_says_and_no_name() -> None:
    said = text_of(listening_sheet(OUTCOME, facts(care="Ask your clinician first: a hole."), WORDS))
    for words in (
        *(place.instruction for place in facts().places),
        "1. Aortic",
        "4. Mitral",
        "patient's left",
        "patient's right",
        "Top of the breastbone",
        "Lower end of the breastbone",
        "33 mm across",
        "case abc123",
        "23 November 2026",
        "not a diagnosis",
        "Ask your clinician first: a hole.",
    ):
        assert words in said


def test_the_patients_left_is_on_the_right() -> None:
    window = window_for(OUTCOME, 33.0, "a4")
    assert window.at(OUTCOME.areas["mitral"].position)[0] > window.at(OUTCOME.areas["aortic"].position)[0]


def test_japanese_is_printed_with_its_own_letters_and_only_those_used() -> None:
    places = tuple(replace(one, title="僧帽弁", instruction="胸骨の上端から下へ6 cmです。") for one in facts().places)
    sheet = listening_sheet(OUTCOME, facts(places=places, posture="あおむけに寝ます。"), WORDS, "a4", "ja")
    said = text_of(sheet)
    assert "僧帽弁" in said
    assert "胸骨の上端から下へ6 cmです。" in said
    assert len(sheet) < 300_000


def test_words_half_as_long_again_still_fit_on_the_page() -> None:
    for paper, (_, height) in PAPERS.items():
        longer = tuple(replace(one, instruction=one.instruction + one.instruction[:75]) for one in facts().places)
        sheet = listening_sheet(OUTCOME, facts(places=longer, care="A reason to ask first. " * 5), WORDS, paper)
        dark = picture_of(sheet).max(axis=2) < 120
        assert np.flatnonzero(dark.any(axis=1)).max() / PIXELS_PER_MM < height - 7
        assert "Do not delay care because of it." in text_of(sheet)


def test_the_same_result_is_the_same_file() -> None:
    assert listening_sheet(OUTCOME, facts(), WORDS) == listening_sheet(OUTCOME, facts(), WORDS)


def test_without_places_there_is_no_sheet() -> None:
    with pytest.raises(ValueError, match="no places"):
        listening_sheet(replace(OUTCOME, areas={}), facts(), WORDS)
