"""From the desk to the family and back: asked for a scan, arrived by a button, seen from the desk."""

from __future__ import annotations

import html
import re

import pytest

from tests.web.family import Family
from tests.web.service import Service
from tests.web.staff import Desk, hidden, signed_in


@pytest.fixture
def ada(service: Service) -> Desk:
    return signed_in(service, organisation="Asking House")


def asked(desk: Desk, **fields: str) -> tuple[str, str]:
    """The link's code and the text to send."""
    page = desk.post("/desk/families/invite", **fields).text
    text = html.unescape(re.search(r"(?s)<textarea.*?>(.*?)</textarea>", page)[1])  # type: ignore[index]
    found = re.search(rf"{desk.service.settings.address}/invited#([A-Z0-9-]{{19}})\n", text)
    assert found is not None
    assert "<svg" in page
    return found.group(1), text


def test_a_family_comes_by_the_link_and_the_desk_sees_how_far_it_is(service: Service, ada: Desk) -> None:
    code, text = asked(ada, reference="B-1")
    assert text.startswith("Asking House asks you")
    assert "Not opened yet" in ada.get("/desk/families")
    family = Family(service)
    assert family.post("/invited", code=code).url.path == "/"
    assert "Asking House asks you for a scan" in family.get("/")
    assert "Some questions are left" in ada.get("/desk/families")
    family.asked()
    assert "Asking House asked for this scan" in family.get("/consent")
    case = family.consented()
    assert "The scan is still to come" in ada.get("/desk/families")
    family.get(f"/cases/{case}")
    assert "asks you for a scan" not in family.get("/")


def test_what_was_agreed_to_before_the_invitation_is_asked_again(service: Service, ada: Desk) -> None:
    family = Family(service)
    family.asked()
    family.post("/consent", agree="yes")
    family.post("/invited", code=asked(ada)[0])
    assert family.post("/consent/child", child="yes").url.path == "/consent"


def test_visiting_the_link_uses_nothing_up(service: Service, ada: Desk) -> None:
    code, _ = asked(ada)
    scanner = Family(service)
    scanner.get("/invited")
    scanner.get(f"/invited?code={code}")
    scanner.post("/invited", 403, token="0" * 128, code=code)
    Family(service).post("/invited", code=code)
    assert "does not work any more" in Family(service).post("/invited", 422, code=code).text


def test_a_date_of_birth_is_asked_when_the_desk_gave_one(service: Service, ada: Desk) -> None:
    code, _ = asked(ada, birth_date="2020-05-17")
    family = Family(service)
    assert "born" in family.post("/invited", code=code).text
    for wrong in ("2020-05-18", "", "yesterday", "17.05.2020"):
        assert 'href="#birth_date"' in family.post("/invited", 422, code=code, birth_date=wrong).text
    assert family.post("/invited", code=code, birth_date="2020-05-17").url.path == "/"
    shut, _ = asked(ada, birth_date="2020-05-17")
    for _try in range(5):
        page = family.post("/invited", 422, code=shut, birth_date="2001-01-01").text
    assert "does not work any more" in page
    assert "wrong too often" in ada.get("/desk/families")


def test_a_reminder_has_a_new_link_and_other_words(service: Service, ada: Desk) -> None:
    first, _ = asked(ada, language="es")
    family = Family(service)
    family.post("/invited", code=first)
    case = family.opened()
    one = hidden(ada.get("/desk/families"), "invitation")
    page = html.unescape(ada.post("/desk/families/again", invitation=one, language="ja").text)
    assert "Asking Houseがスキャンを待っています" in page
    code = re.search(r"invited#([A-Z0-9-]{19})", page)
    assert code is not None
    new_phone = Family(service)
    assert new_phone.post("/invited", code=code[1]).url.path == f"/cases/{case}/scan"
    family.get(f"/cases/{case}", 404)


def test_an_invitation_is_taken_back(service: Service, ada: Desk) -> None:
    code, _ = asked(ada, reference="taken-back")
    ada.post("/desk/families/uninvite", invitation=hidden(ada.get("/desk/families"), "invitation"))
    assert "taken-back" not in ada.get("/desk/families")
    Family(service).post("/invited", 422, code=code)


@pytest.mark.parametrize("wrong", [{"birth_date": "2999-01-01"}, {"birth_date": "x"}, {"reference": "x" * 201}])
def test_what_cannot_be_is_said_beside_its_field(ada: Desk, wrong: dict[str, str]) -> None:
    assert f'href="#{next(iter(wrong))}"' in ada.post("/desk/families/invite", 422, **wrong).text


def test_another_organisation_changes_nothing(service: Service, ada: Desk) -> None:
    asked(ada)
    one = hidden(ada.get("/desk/families"), "invitation")
    other = signed_in(service, organisation="Other House")
    assert one not in other.get("/desk/families")
    other.post("/desk/families/again", 409, invitation=one)
    other.post("/desk/families/uninvite", 409, invitation=one)


def test_an_invited_familys_result_can_be_sent_to_who_asked(service: Service, ada: Desk) -> None:
    family = Family(service)
    family.post("/invited", code=asked(ada)[0])
    case = family.done()
    assert "Send to Asking House" in family.get(f"/cases/{case}/result")
    assert "Sent to Asking House" in family.post(f"/cases/{case}/send").text
    assert "Waiting for a review" in ada.get("/desk/families")
