"""What is known of how skin looks where navel and nipples lie. Lengths as in `landmarks.relief`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Sign:
    """What skin looks like where a landmark lies, see `landmarks.signs`.

    filters: (d, k) on patches of d heights; usual: (k,) their mean answers; weights: (2, k + k (k + 1) / 2) of the
    answers and their products, [0] on the finest maps and [1] on the grainiest.
    """

    filters: np.ndarray
    usual: np.ndarray
    weights: np.ndarray


@dataclass(frozen=True)
class Signs:
    """Of the navel, and of a nipple with outwards to the map's right."""

    navel: Sign
    nipple: Sign
