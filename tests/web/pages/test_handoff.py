"""Going on with another device: two browsers, one case, and a code that works once."""

from __future__ import annotations

import re

import pytest

from tests.web.family import Family
from tests.web.service import Service


@pytest.fixture
def computer(service: Service) -> Family:
    return Family(service)


@pytest.fixture
def phone(service: Service) -> Family:
    return Family(service)


def code_for(family: Family, case: str) -> str:
    page = family.post(f"/cases/{case}/handoff").text
    found = re.search(r'code-signs">([A-Z0-9-]{19})<', page)
    assert found is not None
    return found.group(1)


def test_the_case_moves_with_everything_said_and_the_first_device_is_told(computer: Family, phone: Family) -> None:
    case = computer.confirmed()
    code = code_for(computer, case)
    computer.get(f"/cases/{case}/handoff/state")
    page = phone.post("/handoff", code=code)
    assert page.url.path == f"/cases/{case}/points"
    computer.get(f"/cases/{case}/handoff/state", 404)
    assert "There is nothing here" in computer.get(f"/cases/{case}", 404)


def test_it_comes_back_the_same_way(computer: Family, phone: Family) -> None:
    case = computer.confirmed()
    phone.post("/handoff", code=code_for(computer, case))
    assert computer.post("/handoff", code=code_for(phone, case)).url.path == f"/cases/{case}/points"
    phone.get(f"/cases/{case}", 404)


@pytest.mark.parametrize("typed", ["", "ABCD-EFGH-JKMN-PQRS", "<script>", "x" * 500])
def test_a_wrong_code_is_asked_for_again(phone: Family, typed: str) -> None:
    page = phone.post("/handoff", 422, code=typed).text
    assert 'href="#code"' in page
    assert "<script>" not in page.split("<main", 1)[1]


def test_a_code_works_once_and_small_letters_are_forgiven(computer: Family, phone: Family, service: Service) -> None:
    case = computer.confirmed()
    code = code_for(computer, case)
    phone.post("/handoff", code=code.lower().replace("-", " "))
    assert "does not work" in Family(service).post("/handoff", 422, code=code).text


def test_a_new_code_ends_the_old_one(computer: Family, phone: Family) -> None:
    case = computer.confirmed()
    old, new = code_for(computer, case), code_for(computer, case)
    phone.post("/handoff", 422, code=old)
    phone.post("/handoff", code=new)


def test_looking_at_pages_moves_nothing(computer: Family, phone: Family) -> None:
    case = computer.confirmed()
    code = code_for(computer, case)
    phone.get("/handoff")
    phone.get(f"/handoff?code={code}")
    computer.get(f"/cases/{case}/handoff")
    assert computer.where(case) == "points"
    phone.post("/handoff", 403, code=code, token="0" * 128)
    assert computer.where(case) == "points"


def test_nobody_makes_a_code_for_a_case_of_others(computer: Family, phone: Family) -> None:
    case = computer.confirmed()
    phone.get(f"/cases/{case}/handoff", 404)
    phone.post(f"/cases/{case}/handoff", 404)


def test_the_code_stays_out_of_addresses_logs_and_stores(computer: Family, service: Service) -> None:
    case = computer.confirmed()
    answer = computer.post(f"/cases/{case}/handoff")
    assert answer.headers["cache-control"] == "no-store"
    code = code_for(computer, case)
    assert code not in str(answer.url)
    assert not [
        file for file in service.settings.data_dir.rglob("*") if file.is_file() and code.encode() in file.read_bytes()
    ]


def test_on_one_computer_alone_the_page_says_that_no_phone_can_come(computer: Family) -> None:
    case = computer.confirmed()
    assert "a phone cannot reach it" in computer.get(f"/cases/{case}/handoff")
