"""Stickers on the pages: the sheet to print, and the points that need no tap any more."""

from __future__ import annotations

from dataclasses import replace

import pytest

from lubdub.geometry.stickers import BONES, StickerProof
from lubdub.report.archive import examination_to_bytes
from tests.views import sample
from tests.web.family import Family
from tests.web.service import Service, eventually


@pytest.fixture(scope="module")
def family(service: Service) -> Family:
    return Family(service)


def worn() -> bytes:
    """An examination of a scan with both stickers."""
    plain = sample.examination()
    marked = {name: replace(plain.suggested[name], source="sticker") for name in BONES}
    proof = StickerProof(BONES, 1.01)
    return examination_to_bytes(replace(plain, suggested={**plain.suggested, **marked}, stickers=proof))


def with_stickers(family: Family) -> str:
    case = family.examined()
    family.vault.put(case, "examination.npz", worn())
    return case


@pytest.mark.parametrize("query", ["", "?paper=letter", "?paper=a4&size=small"])
def test_anybody_may_have_the_sheet(family: Family, query: str) -> None:
    answer = family.http.get(f"/stickers.pdf{query}")
    assert answer.status_code == 200
    assert answer.headers["content-type"] == "application/pdf"
    assert answer.content.startswith(b"%PDF")


@pytest.mark.parametrize("query", ["?paper=napkin", "?size=huge"])
def test_a_sheet_that_there_is_not_is_refused_in_words(family: Family, query: str) -> None:
    answer = family.http.get(f"/stickers.pdf{query}")
    assert 400 <= answer.status_code < 500
    assert "Traceback" not in answer.text


@pytest.mark.parametrize(("years", "size"), [("6", "large"), ("0", "small")])
def test_where_a_scan_is_prepared_the_sheet_that_fits_the_age_is_offered(family: Family, years: str, size: str) -> None:
    page = family.get(f"/cases/{family.consented(years=years)}/ready")
    for paper in ("a4", "letter"):
        link = f"/stickers.pdf?paper={paper}&amp;size={size}"
        assert link in page
        assert family.http.get(link.replace("&amp;", "&")).status_code == 200


def test_the_page_says_that_the_stickers_were_seen(family: Family) -> None:
    case = with_stickers(family)
    assert "not mirrored" in family.get(f"/cases/{case}/size")
    assert "not mirrored" not in family.get(f"/cases/{family.examined()}/size")


def test_points_with_stickers_are_marked_already_and_go_into_the_run(family: Family) -> None:
    case = with_stickers(family)
    family.post(f"/cases/{case}/size", size="right", side="left")
    page = family.get(f"/cases/{case}/points")
    assert page.count("by sticker") == len(BONES)
    assert "Point 3 of 5" in page
    assert set(family.marks(case)["placed"]) == set(BONES)
    family.locate(case)
    eventually(lambda: family.rest_status(case) == "done")


def test_a_sticker_says_so_when_its_point_is_chosen(family: Family) -> None:
    case = with_stickers(family)
    family.post(f"/cases/{case}/size", size="right", side="left")
    family.post(f"/cases/{case}/points", action="choose", name="xiphisternum")
    assert "Your sticker marks it" in family.get(f"/cases/{case}/points")
