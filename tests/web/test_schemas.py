import pytest

from lubdub.web.schemas import CaseIn


def pregnancy(sex: str, age_years: float, **answers: object) -> str:
    body = {"patient": {"sex": sex, "age_years": age_years}, "answers": answers}
    return CaseIn.model_validate(body).to_value().answers["late_pregnancy"]


@pytest.mark.parametrize(("sex", "age_years"), [("male", 30), ("female", 6), ("female", 81)])
def test_a_portal_need_not_answer_for_a_pregnancy_that_cannot_be(sex: str, age_years: float) -> None:
    assert pregnancy(sex, age_years) == "no"


def test_a_pregnancy_that_may_be_and_was_not_asked_about_is_unsure() -> None:
    assert pregnancy("female", 30) == "unsure"
    assert pregnancy("female", 30, late_pregnancy=False) == "no"


def test_a_yes_is_never_talked_away() -> None:
    assert pregnancy("female", 81, late_pregnancy=True) == "yes"
