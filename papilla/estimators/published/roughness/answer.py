"""Answer of the published roughness estimators, and the sentences of its status."""

import math
from typing import Any, NamedTuple

import numpy as np

from papilla.status import Status

NONE = math.nan


class RoughnessStatus(Status):
    """Status of an answer; `sentence` says it in words."""

    OK = "ok"
    WARMING_UP = "the window is not full yet"
    SILENT = "nothing in the window: no texture, a dead gauge, or slower than the window can see"
    STANDSTILL = "no movement, so the frequency gives no wavelength"
    NO_VELOCITY = "no finite velocity: frequency only"
    GAP = "samples are missing in the window; the answer, if any, is from the others"
    MISSING = "the reading is missing or not finite"
    SATURATED = "the reading is saturated"
    ALIASED = "too fast for this sampling rate: what is counted may be an alias"
    DUPLICATE = "the sample is not later than the one before, and was left out"


OK, WARMING_UP, SILENT, STANDSTILL, NO_VELOCITY, GAP, MISSING, SATURATED, ALIASED, DUPLICATE = map(int, RoughnessStatus)


class RoughnessEstimate(NamedTuple):
    """frequency_Hz, wavelength_mm (NaN where there is no answer), power and status: the value of a `RoughnessStatus`.

    power is that of the spectral line in squared units of the reading times s; NaN for the estimators that count. Of a
    block, arrays (n,).
    """

    frequency_Hz: float | np.ndarray
    wavelength_mm: float | np.ndarray
    power: float | np.ndarray
    status: int | np.ndarray

    @property
    def sentence(self) -> Any:
        """The status in words: a string, or a list of them."""
        return RoughnessStatus.in_words(self.status)


class Finding(NamedTuple):
    """Result of a method in its window: status and, if that is OK or GAP, the period.

    frequency in Hz, distance in mm travelled in one period (both NaN if there is none), and power.
    """

    status: int
    frequency: float = NONE
    distance: float = NONE
    power: float = NONE
