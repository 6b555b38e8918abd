"""Numbers that say which build age and sex let one expect; `lubdub.fitting.expected` reads them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Builds:
    """Usual coefficients of the first b modes of a shape basis, females first.

    means: (2, a, b) by sex at ages (a,) in years, straight between; spread: (b, b) covariance of people around them.
    """

    ages: np.ndarray
    means: np.ndarray
    spread: np.ndarray
