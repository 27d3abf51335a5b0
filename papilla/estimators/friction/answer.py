"""The answer of `Friction`: the coefficients with their standard deviations, and a status."""

import math
from typing import Any, NamedTuple

import numpy as np

from papilla.status import Status

_NONE = math.nan


class FrictionStatus(Status):
    """Status of an answer; the greater the number, the more is missing."""

    OK = "ok"
    STATIC_NOT_SEEN = "ok, but the last start showed no breakaway: no static coefficient"
    ONE_WAY = "one way: nothing shows the offset of the tangential force"
    UNSURE = "its sigma is more than 8 %"
    OUTLIER = "the forces contradict all sliding so far: left out"
    CHANGED = "the friction changed: learning again"
    NO_PULL = "hardly any tangential force although the velocity shows sliding: is the finger at rest?"
    NEGATIVE = "negative: the tangential force or the velocity has the wrong sign, or the force's zero is wrong"
    NO_CONTACT = "no contact"
    NOT_SLIDING = "has not slid yet"
    BAD_INPUT = "a force or the velocity is missing or not finite"


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
