import pytest

from lubdub.cases.screening import may_be_pregnant


@pytest.mark.parametrize(
    ("sex", "age_years", "may_be"),
    [
        ("female", 11.9, False),
        ("female", 12.0, True),
        ("female", 59.9, True),
        ("female", 60.0, False),
        ("female", 81.0, False),
        ("male", 30.0, False),
        (None, 30.0, False),
        ("female", None, False),
    ],
)
def test_a_pregnancy_is_asked_about_only_where_there_can_be_one(sex, age_years, may_be: bool) -> None:
    assert may_be_pregnant(sex, age_years) is may_be
