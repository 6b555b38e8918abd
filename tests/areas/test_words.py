import numpy as np
import pytest

from lubdub.areas.words import instruction


@pytest.mark.parametrize(("x", "side"), [(-25.0, "right"), (25.0, "left")])
def test_the_side_is_always_the_patients_own(x: float, side: str) -> None:
    words = instruction("aortic" if x < 0 else "pulmonary", np.array([x, -60.0, 0.0]), np.zeros(3))
    assert f"patient's {side}" in words


def test_lengths_are_in_half_centimetres_and_fingers() -> None:
    words = instruction("pulmonary", np.array([26.0, -61.0, 0.0]), np.zeros(3))
    assert "6 cm (about 3 finger-widths)" in words
    assert "2.5 cm (about 1 finger-width)" in words
