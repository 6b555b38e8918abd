"""What age and sex let one expect of a body."""

from __future__ import annotations

import numpy as np
import pytest

from lubdub.fitting.expected import Span, anybody, expect
from lubdub.fitting.shape import shape_of
from lubdub.geometry.rigid import best_similarity
from lubdub.library.load import load_library

LIBRARY = load_library()
BASIS = LIBRARY.basis
TRUNK = BASIS.data_weight > 0.3


def unlike_mm(body: np.ndarray, other: np.ndarray) -> float:
    """Root mean square distance of two trunks (n, 3), the other one moved and sized to fit."""
    move = best_similarity(other[TRUNK], body[TRUNK])
    return float(np.sqrt(((move.apply(other[TRUNK]) - body[TRUNK]) ** 2).sum(axis=1).mean()))


def test_a_body_is_more_like_what_its_age_and_sex_let_one_expect_than_like_the_mean_of_all() -> None:
    shares = []
    for one in LIBRARY.references:
        expected = shape_of(expect(BASIS, one.card["age_years"], one.card["sex"]).mean, BASIS)
        shares.append(unlike_mm(one.surface.vertices, expected) / unlike_mm(one.surface.vertices, BASIS.mean))
    assert np.mean(shares) < 0.85
    assert np.mean(np.array(shares) < 1.0) > 0.8


def test_of_a_person_whose_age_was_not_said_anybody_is_expected() -> None:
    expected, of_all = expect(BASIS, None, "female"), anybody(BASIS)
    np.testing.assert_array_equal(expected.mean, of_all.mean)
    np.testing.assert_array_equal(expected.precision, of_all.precision)
    assert not of_all.mean.any()


def test_a_sex_that_was_not_said_may_be_either() -> None:
    woman, man, either = (expect(BASIS, 30.0, sex) for sex in ("female", "male", None))  # type: ignore[arg-type]
    np.testing.assert_allclose(either.mean, (woman.mean + man.mean) / 2)
    assert either.strangeness(woman.mean) == pytest.approx(either.strangeness(man.mean))
    assert man.strangeness(woman.mean) > 1.5 * either.strangeness(woman.mean)


def test_expectations_change_evenly_between_ages_and_not_beyond_the_last() -> None:
    young, middle, old = (expect(BASIS, age, "male").mean for age in (25.0, 37.5, 50.0))
    np.testing.assert_allclose(middle, (young + old) / 2)
    last, older = (expect(BASIS, age, "male").mean for age in (BASIS.builds.ages[-1], BASIS.builds.ages[-1] + 20))
    np.testing.assert_array_equal(last, older)


def test_only_peoples_build_follows_age_and_sex() -> None:
    builds = len(BASIS.builds.spread)
    expected = expect(BASIS, 1.0, "male")
    assert not expected.mean[builds:].any()
    np.testing.assert_array_equal(expected.precision[builds:, builds:], np.eye(len(BASIS.modes) - builds))
    assert not expected.precision[:builds, builds:].any()


def test_strangeness_counts_standard_deviations() -> None:
    expected = expect(BASIS, 40.0, "female")
    assert expected.strangeness(expected.mean) == 0.0
    off = np.random.default_rng(1).normal(size=len(expected.mean))
    assert expected.strangeness(expected.mean + 2 * off) == pytest.approx(2 * expected.strangeness(expected.mean + off))


def test_the_surprise_of_a_breastbone_begins_beyond_what_is_usual_and_grows_with_the_square() -> None:
    for off_mm, surprise in ((0.0, 0.0), (-9.0, 0.0), (9.0, 0.0), (-30.0, 4.0), (30.0, 4.0), (50.0, 16.0)):
        assert Span(150.0, 10.0).surprise(150.0 + off_mm) == pytest.approx(surprise)
