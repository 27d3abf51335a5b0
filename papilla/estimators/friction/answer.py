"""The answer of `Friction`: the coefficients with their standard deviations, and a status."""

import math
from typing import Any, NamedTuple

import numpy as np

from papilla.status import Status

_NONE = math.nan


class FrictionStatus(Status):
    """Status of an answer; the greater the number, the more is missing."""

    OK = 0, "ok"
    STATIC_NOT_SEEN = 1, "ok, but the last start showed no breakaway: no static coefficient"
    ONE_WAY = 2, "one way: nothing shows the offset of the tangential force"
    UNSURE = 3, "its sigma is more than 8 %"
    OUTLIER = 4, "the forces contradict all sliding so far: left out"
    CHANGED = 5, "the friction changed: learning again"
    NO_PULL = 6, "hardly any tangential force although the velocity shows sliding: is the finger at rest?"
    NEGATIVE = 7, "negative: the tangential force or the velocity has the wrong sign, or the force's zero is wrong"
    NO_CONTACT = 8, "no contact"
    NOT_SLIDING = 9, "has not slid yet"
    BAD_INPUT = 10, "a force or the velocity is missing or not finite"


class FrictionEstimate(NamedTuple):
    """mu_kinetic and mu_static of the direction of the last sliding, offset_N, their standard deviations, and status.

    The status is a `FrictionStatus`. NaN where there is no answer. Of a block, arrays (n,).
    """

    mu_kinetic: float | np.ndarray = _NONE
    mu_static: float | np.ndarray = _NONE
    offset_N: float | np.ndarray = _NONE
    mu_kinetic_sigma: float | np.ndarray = _NONE
    mu_static_sigma: float | np.ndarray = _NONE
    offset_sigma_N: float | np.ndarray = _NONE
    status: int | np.ndarray = int(FrictionStatus.NOT_SLIDING)

    @property
    def sentence(self) -> Any:
        """The status in words: a string, or a list of them."""
        return FrictionStatus.in_words(self.status)
