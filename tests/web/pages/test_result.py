"""The result's page, its file to keep, its sheet, and sending it, without a browser."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from html import unescape
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pypdfium2
import pytest
from starlette.requests import Request

from lubdub.areas.words import ENGLISH, instruction
from lubdub.cases.states import Status
from lubdub.geometry.raycast import SkinCaster
from lubdub.geometry.whereabouts import whereabouts
from lubdub.judging import reasons
from lubdub.landmarks import reasons as landmark_reasons
from lubdub.landmarks import sticker_reasons
from lubdub.report.archive import examination_to_bytes, outcome_to_bytes
from lubdub.results import AREA_NAMES, Reason
from lubdub.scans import reasons as scan_reasons
from lubdub.settings import Settings
from lubdub.web.pages.marks import Marks
from lubdub.web.pages.result import NEEDS_A_SCAN, _ways_on
from lubdub.web.pages.result_words import DOUBTS, age_words
from lubdub.web.schemas import CaseOut
from tests.views import sample
from tests.web.family import Family, case_in
from tests.web.service import Portal, Service, eventually, free_port


@pytest.fixture
def family(service: Service) -> Family:
    return Family(service)


@pytest.fixture(scope="module")
def clinic(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Service]:
    """A service that names its clinician."""
    folder = tmp_path_factory.mktemp("clinic")
    running = Service(
        Settings(
            data_dir=folder / "data", port=free_port(), requests_per_minute=100_000, job_cpu_s=1, clinic_name="Dr. Park"
        )
    )
    try:
        running.start_web()
        running.start_worker()
        yield running
    finally:
        running.stop()


def sentences(person: str) -> list[str]:
    outcome = sample.outcome()
    skin = SkinCaster(sample.clean_scan().display)
    notch = outcome.landmarks["suprasternal_notch"].position
    ways = [whereabouts(skin, outcome.areas[name].position, notch) for name in AREA_NAMES]
    return [instruction(way, person=person) for way in ways]  # type: ignore[arg-type]


def text_of(sheet: bytes) -> str:
    document = pypdfium2.PdfDocument(sheet)
    assert len(document) == 1
    return " ".join(document[0].get_textpage().get_text_range().split())


def test_each_place_is_told_for_this_body_and_this_child(family: Family) -> None:
    case = family.done()
    page = unescape(family.get(f"/cases/{case}/result"))
    for sentence in sentences("child"):
        assert sentence in page
    assert "33 mm across" in page


def test_without_scripts_the_missing_picture_is_explained(family: Family) -> None:
    page = family.get(f"/cases/{family.done()}/result")
    assert re.search(r"<noscript><p class=\"frame__lost\">The picture needs JavaScript[^<]+</p></noscript>", page)


def test_no_step_or_reason_is_shown_as_a_code(family: Family) -> None:
    reason = Reason("bones_not_given", "The breastbone was not marked.", "Feel for it and mark it.")
    case = family.done(replace(sample.outcome(), verdict="show_with_care", reasons=(reason,)))
    page = family.get(f"/cases/{case}/result")
    assert "The breastbone was not marked." in page
    assert "bones_not_given" not in page
    assert "<Macro" not in unescape(page)


def test_the_file_to_keep_has_everything_inside_it(family: Family) -> None:
    case = family.done()
    answer = family.http.get(f"/api/v1/cases/{case}/view.html")
    assert answer.headers["cache-control"] == "no-store"
    page = answer.text
    outside, inside = page.split("srcdoc=")[0], page
    assert 'http-equiv="Content-Security-Policy"' in outside
    assert "default-src 'none'" in unescape(outside)
    assert not re.findall(r"<(?:script|link|img|iframe)[^>]+(?:src|href)=[\"'](?!data:|blob:)", inside)
    for sentence in sentences("child"):
        assert sentence in unescape(page)
    assert "__VISER_EMBED_DATA__" in page
    assert "not a diagnosis" in page


def test_a_portal_reads_of_the_patient(service: Service, portal: Portal) -> None:
    case = portal.done(b"quick")
    from lubdub.report.archive import outcome_to_bytes

    Family(service).vault.put(case, "outcome.npz", outcome_to_bytes(sample.outcome()))
    said = text_of(portal.call("GET", f"/cases/{case}/sheet.pdf", 200).content)
    for sentence in sentences("patient"):
        assert sentence in said


@pytest.mark.parametrize(("paper", "width_mm"), [("a4", 210.0), ("letter", 215.9)])
def test_the_sheet_says_the_same_and_its_file_names_nobody(family: Family, paper: str, width_mm: float) -> None:
    case = family.done()
    answer = family.http.get(f"/api/v1/cases/{case}/sheet.pdf", params={"paper": paper})
    assert answer.headers["content-type"] == "application/pdf"
    assert answer.headers["cache-control"] == "no-store"
    assert answer.headers["content-disposition"] == 'inline; filename="lubdub-places.pdf"'
    said = text_of(answer.content)
    for sentence in sentences("child"):
        assert sentence in said
    assert case[:6] in said
    assert case not in said
    assert pypdfium2.PdfDocument(answer.content)[0].get_width() / 72 * 25.4 == pytest.approx(width_mm, abs=0.1)


def test_a_samples_sheet_and_kept_file_say_that_it_is_one(family: Family) -> None:
    case = case_in(str(family.post("/samples", name="phone-child").url))
    eventually(lambda: family.where(case) == "size")
    family.vault.put(case, "examination.npz", examination_to_bytes(sample.examination()))
    family.vault.put(case, "marks.json", Marks().to_bytes())  # of the sample's own body, not of the stand-in's
    family.post(f"/cases/{case}/size", size="right", side="left")
    family.locate(case)
    eventually(lambda: family.rest_status(case) == "done")
    family.vault.put(case, "outcome.npz", outcome_to_bytes(sample.outcome()))
    assert "This is a sample." in text_of(family.http.get(f"/api/v1/cases/{case}/sheet.pdf").content)
    assert "This is a sample." in family.http.get(f"/api/v1/cases/{case}/view.html").text
    assert "This is a sample." not in family.http.get(f"/api/v1/cases/{family.done()}/view.html").text


def test_a_paper_nobody_knows_is_a_problem(family: Family) -> None:
    case = family.done()
    assert family.http.get(f"/api/v1/cases/{case}/sheet.pdf?paper=a3").status_code == 422


def test_before_the_end_there_is_neither_sheet_nor_picture(family: Family) -> None:
    case = family.confirmed()
    for path in (f"/api/v1/cases/{case}/sheet.pdf", f"/api/v1/cases/{case}/view.html", f"/cases/{case}/picture"):
        assert family.http.get(path).status_code in (404, 409), path


@pytest.mark.parametrize(
    ("code", "first"),
    [
        ("looks_like_a_back", "Send another scan"),
        ("chest_not_in_scan", "Send another scan"),
        ("sides_swapped", "Look at the points again"),
        ("methods_disagree_strongly", "Look at the points again"),
        (None, "Look at the points again"),
    ],
)
def test_the_first_button_of_a_refusal_does_what_its_reason_asks_for(code: str | None, first: str) -> None:
    case: Any = SimpleNamespace(id="c", status="refused", has_scan=True, is_checked=True)
    ways = [way["words"] for way in _ways_on(Request({"type": "http", "headers": []}), case, code)]
    assert ways[0] == first
    assert sorted(ways) == ["Look at the points again", "Send another scan"]


def test_the_refusals_that_need_another_scan_are_those_the_judge_gives() -> None:
    given = {value.code: value for value in vars(reasons).values() if isinstance(value, Reason)}
    assert given.keys() >= NEEDS_A_SCAN
    assert all(given[code].advice.startswith("Scan ") for code in NEEDS_A_SCAN)


def test_how_sure_a_place_is_is_not_said_plainly_beside_a_warning_that_it_may_be_quite_wrong(family: Family) -> None:
    plain = family.get(f"/cases/{family.done()}/result")
    assert "We are sure to about" in plain
    doubted = replace(sample.outcome(), verdict="show_with_care", reasons=(reasons.DISAGREEMENT,))
    page = family.get(f"/cases/{family.done(doubted)}/result")
    assert "We are sure to about" not in page
    assert "Check the warning first. Without it we would be sure to about" in page


def test_the_doubts_are_warnings_that_some_room_gives() -> None:
    rooms = (reasons, landmark_reasons, sticker_reasons, scan_reasons)
    given = {value.code for room in rooms for value in vars(room).values() if isinstance(value, Reason)}
    assert given >= DOUBTS


def test_a_refused_case_has_no_sheet(family: Family) -> None:
    case = family.done(replace(sample.outcome(), verdict="refuse", areas={}))
    assert family.http.get(f"/api/v1/cases/{case}/sheet.pdf").status_code in (404, 409)


def test_another_familys_result_is_not_there(family: Family, service: Service) -> None:
    case = family.done()
    other = Family(service)
    for path in (f"/cases/{case}/picture", f"/api/v1/cases/{case}/sheet.pdf", f"/api/v1/cases/{case}/view.html"):
        assert other.http.get(path).status_code in (401, 404), path


def test_where_no_clinician_is_named_nothing_is_sent_or_said_to_be(family: Family) -> None:
    case = family.done()
    page = family.get(f"/cases/{case}/result")
    assert f"/cases/{case}/send" not in page
    assert "Give the sheet to your clinician" in page
    family.post(f"/cases/{case}/send", 409)
    assert family.rest_status(case) == "done"


def test_a_result_is_sent_once_kept_as_it_is_and_can_be_taken_back(clinic: Service) -> None:
    family = Family(clinic)
    case = family.done()
    assert "Send to Dr. Park" in family.get(f"/cases/{case}/result")
    for _ in range(2):
        assert "Sent to Dr. Park." in family.post(f"/cases/{case}/send").text
    assert family.rest_status(case) == "in_review"
    assert family.where(case) == "result"
    family.get(f"/cases/{case}/points")
    assert family.rest_status(case) == "in_review"
    assert family.http.get(f"/api/v1/cases/{case}/result").status_code == 200
    family.post(f"/cases/{case}/points", 409, action="done")
    assert family.rest_status(case) == "in_review"
    page = family.post(f"/cases/{case}/take-back").text
    assert "Send to Dr. Park" in page
    assert family.rest_status(case) == "done"


def test_sending_needs_the_pages_own_token(clinic: Service) -> None:
    family = Family(clinic)
    case = family.done()
    family.post(f"/cases/{case}/send", 403, token="0" * 64)
    assert family.rest_status(case) == "done"


def test_rest_knows_the_state_of_a_sent_case() -> None:
    assert "in_review" in Status.__args__  # type: ignore[attr-defined]
    assert "in_review" in str(CaseOut.model_json_schema()["properties"]["status"])


def test_scripts_bring_no_words_of_their_own() -> None:
    from lubdub.web.nhsuk import FRONTEND

    for name in ("parts/steps/steps.js", "family/result/result.js", "family/checking/checking.js"):
        script = re.sub(r"//[^\n]*", "", Path(FRONTEND / name).read_text(encoding="utf-8"))
        assert not re.findall(r"\"[A-Z][a-z]+ [a-z]+[^\"]*\"", script), name


@pytest.mark.parametrize(
    ("years", "said"),
    [
        (None, "age not said"),
        (1 / 12, "1 month old"),
        (1.0, "12 months old"),
        (2.0, "2 years old"),
        (6.9, "6 years old"),
    ],
)
def test_an_age_is_said_as_one_says_it(years: float | None, said: str) -> None:
    assert age_words(ENGLISH, years) == said
