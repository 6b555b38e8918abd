"""Legal holds at the desk: a lead sets and lifts them; family and portal are told that deleting has to wait."""

from __future__ import annotations

from lubdub.cases.database import Database
from lubdub.cases.holds import Holds
from lubdub.cases.values import SYSTEM
from tests.web.family import Family
from tests.web.service import Service
from tests.web.staff import signed_in


def test_a_lead_holds_a_case_which_then_cannot_be_deleted_until_it_is_released(service: Service) -> None:
    lead, portal = signed_in(service, "lead", "Hold House"), service.portal("Hold House")
    case = portal.open_case()
    page = lead.post("/desk/holds/place", case=case, reason="A question of the court").text
    assert case[:6] in page
    assert "A question of the court" in page
    problem = portal.call("DELETE", f"/cases/{case}", 409).json()
    assert problem["type"] == "/problems/state-conflict"
    assert "legal hold" in problem["detail"]
    assert "court" not in problem["detail"]
    assert "Put a legal hold on a case" in lead.get(f"/desk/audit?case={case[:8]}")
    assert case[:6] not in lead.post("/desk/holds/lift", case=case, reason="Settled").text
    portal.call("DELETE", f"/cases/{case}", 200)


def test_a_hold_that_cannot_be_set_is_said_beside_its_field(service: Service) -> None:
    lead, portal = signed_in(service, "lead", "Hold House"), service.portal("Hold House")
    case, foreign = portal.open_case(), service.portal("Elsewhere").open_case()
    assert "Say why" in lead.post("/desk/holds/place", 422, case=case, reason=" ").text
    assert "There is no such case" in lead.post("/desk/holds/place", 422, case=foreign, reason="curious").text
    lead.post("/desk/holds/place", case=case, reason="for now")
    assert "held already" in lead.post("/desk/holds/place", 422, case=case, reason="again").text


def test_a_family_is_told_kindly_why_deleting_has_to_wait(service: Service) -> None:

    family = Family(service)
    case = family.opened()
    database = Database(service.settings.database)
    Holds(database).place(SYSTEM, case, "a question of the court")
    database.close()
    for page in (family.http.get(f"/cases/{case}/remove"), family.post(f"/cases/{case}/remove")):
        assert page.status_code == 200
        assert "This cannot be deleted yet" in page.text
        assert "court" not in page.text
        assert "Yes, delete everything" not in page.text
    assert family.http.get(f"/cases/{case}").status_code == 200
