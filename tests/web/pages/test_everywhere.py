"""What every page of a case offers: to delete everything, and to move on to another device."""

from __future__ import annotations

import re

import pytest

from lubdub.web.pages.questions import QUESTIONS
from tests.web.family import NO_STOPS, Family
from tests.web.service import Service, eventually


@pytest.fixture
def family(service: Service) -> Family:
    return Family(service)


def offers_deletion(page: str, case: str) -> bool:
    return f'href="/cases/{case}/remove">Delete everything I gave you' in page


def test_everything_can_be_deleted_from_every_page_of_a_case(family: Family) -> None:
    case = family.consented()
    for step in ("guide", "guide/kiri", "guide/none", "ready", "handoff"):
        assert offers_deletion(family.get(f"/cases/{case}/{step}"), case), step
    family.post(f"/cases/{case}/ready")
    assert offers_deletion(family.get(f"/cases/{case}/scan"), case)
    family.send(case, b"slow 30")
    assert offers_deletion(family.get(f"/cases/{case}/checking"), case)
    family.post(f"/cases/{case}/cancel")
    family.send(case, b"junk")
    eventually(lambda: family.where(case) == "refused")
    assert offers_deletion(family.get(f"/cases/{case}/refused"), case)


def test_everything_can_be_deleted_while_points_are_marked_and_afterwards(family: Family) -> None:
    case = family.examined()
    assert offers_deletion(family.get(f"/cases/{case}/size"), case)
    family.post(f"/cases/{case}/size", size="right", side="left")
    for step in ("feel", "points"):
        assert offers_deletion(family.get(f"/cases/{case}/{step}"), case), step
        family.post(f"/cases/{case}/feel")
    case = family.done()
    assert offers_deletion(family.get(f"/cases/{case}/result"), case)
    receipt = family.post(f"/cases/{case}/remove").text
    assert family.get(f"/cases/{case}/removed") == receipt
    assert re.search(r'<time datetime="[0-9T:.+-]+">[A-Z][a-z]+ \d+, \d{4}[^<]* UTC</time>', receipt)
    assert not offers_deletion(family.get(f"/cases/{case}/removed"), case)


def test_before_there_is_a_case_the_answers_can_be_forgotten_from_every_page(family: Family) -> None:
    family.asked(years="30")
    for path in (*(f"/ask/{question.name}" for question in QUESTIONS), "/consent", "/not-now"):
        page = family.get(path)
        assert len(re.findall("Forget my answers", page)) == 1, path
        assert 'action="/anew"' in page
    family.post("/ask/heart_on_right", **(NO_STOPS | {"heart_on_right": "yes"}))
    assert len(re.findall("Forget my answers", family.get("/stop"))) == 1
    family.post("/anew")
    assert "Your answers so far" not in family.get("/")
