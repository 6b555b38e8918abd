"""Which passwords somebody may choose: long ones that are hard to guess, whatever signs they are made of."""

from __future__ import annotations

import pytest
from zxcvbn.frequency_lists import FREQUENCY_LISTS

from lubdub.cases.passwords import LONGEST_PASSWORD, SHORTEST_PASSWORD, fault_of, words_of_house

ADA = ("Ada Lovelace", "ada.lovelace@heart.example", "Heart House")


def test_every_common_password_that_is_long_enough_is_refused() -> None:
    common = [one for one in FREQUENCY_LISTS["passwords"] if len(one) >= SHORTEST_PASSWORD]
    assert len(FREQUENCY_LISTS["passwords"]) == 30_000
    assert len(common) > 200
    assert [one for one in common if fault_of(one) != "common"] == []


@pytest.mark.parametrize(
    "made", ["password1234", "Password2024!", "qwertyuiop123", "aaaaaaaaaaaa", "stethoscope12", "p4ssw0rdp4ssw0rd"]
)
def test_what_is_made_of_common_parts_is_refused_too(made: str) -> None:
    assert fault_of(made) == "common"


@pytest.mark.parametrize(
    "made", ["lubdub lubdub", "Heart-House-12", "lovelaceLOVELACE", "lubdub.example", "x.lovelace.heart.house"]
)
def test_words_of_the_house_and_of_the_person_count_for_nothing(made: str) -> None:
    assert fault_of(made, ADA) == "own"


def test_they_may_stand_beside_enough_that_is_hard_to_guess() -> None:
    assert fault_of("lubdub and three plain geese", ADA) is None
    assert fault_of("lubdubpassword1234", ADA) == "common"


def test_the_words_of_the_house_are_our_name_and_what_the_person_is_known_by() -> None:
    assert words_of_house(ADA) == {"lubdub", "lovelace", "heart", "house", "example"}


@pytest.mark.parametrize(
    "plain",
    [
        "three plain words",
        "seven geese walk home",
        "92758301645927",
        "夜の川をわたる三羽のさぎの歌",
        "    zq kvy wm bt    ",
    ],
)
def test_no_rule_says_which_signs_a_password_is_made_of(plain: str) -> None:
    assert fault_of(plain, ADA) is None


def test_long_passwords_are_taken_up_to_a_length_that_is_still_handled_whole() -> None:
    long = "seven geese walk home " * 10
    assert fault_of(long[:64]) is None
    assert fault_of(long[:LONGEST_PASSWORD]) is None
    assert fault_of(long[: LONGEST_PASSWORD + 1]) == "length"
    assert fault_of("q7#" * 3) == "length"
