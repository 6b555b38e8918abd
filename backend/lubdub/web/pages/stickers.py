"""The sticker sheet to download, for whoever prepares a scan. It says nothing about anybody: anybody may have it."""

from __future__ import annotations

from functools import lru_cache

from fastapi import APIRouter, Request
from fastapi.responses import Response

from lubdub.cases.values import Case
from lubdub.geometry.stickers import SMALL_UNTIL_YEARS, StickerSize
from lubdub.report.stationery import Paper
from lubdub.results import Examination
from lubdub.web.languages import language_of, words_of

router = APIRouter(include_in_schema=False)


@router.get("/stickers.pdf")
def sheet(request: Request, paper: Paper = "a4", size: StickerSize = "large") -> Response:
    """The sheet for this paper and this size of stickers."""
    headers = {
        "Content-Disposition": 'inline; filename="stickers.pdf"',
        "Cache-Control": "no-cache",
        "Vary": "Accept-Language, Cookie",
    }
    return Response(_drawn(paper, size, language_of(request)), media_type="application/pdf", headers=headers)


def sheets_for(case: Case) -> dict[str, str]:
    """Paper -> address of the sheet with the stickers that fit this person."""
    is_small = case.age_years is not None and case.age_years < SMALL_UNTIL_YEARS
    return {paper: f"/stickers.pdf?paper={paper}&size={'small' if is_small else 'large'}" for paper in ("a4", "letter")}


def marked_by_stickers(examination: Examination) -> dict[str, list[float]]:
    """The points that stickers on the scan mark: name -> [x, y, z] in the file's own coordinates."""
    file_from_body = examination.scan.body_from_file.inverse()
    return {
        name: file_from_body.apply(mark.position).tolist()
        for name, mark in examination.suggested.items()
        if mark.source == "sticker"
    }


@lru_cache(maxsize=16)
def _drawn(paper: Paper, size: StickerSize, language: str) -> bytes:
    from lubdub.report.sticker_sheet import sticker_sheet, sticker_words  # the PDF library takes long to load

    return sticker_sheet(paper, size, sticker_words(size, words_of(language).gettext), language)
