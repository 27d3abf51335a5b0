"""What the published roughness estimators answer, and the sentences of its status."""

import math
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from papilla.estimators.status_words import status_in_words

NONE = math.nan


class RoughnessStatus(IntEnum):
    """What became of an answer; `sentence` says it in words."""

    OK = 0
    WARMING_UP = 1
    SILENT = 2
    STANDSTILL = 3
    NO_VELOCITY = 4
    GAP = 5
    MISSING = 6
    SATURATED = 7
    ALIASED = 8
    DUPLICATE = 9

    @property
    def sentence(self) -> str:
        """The status in words."""
        return _SENTENCES[self]


_SENTENCES = {
    RoughnessStatus.OK: "ok",
    RoughnessStatus.WARMING_UP: "the window is not full yet",
    RoughnessStatus.SILENT: "nothing in the window: no texture, a dead gauge, or slower than the window can see",
    RoughnessStatus.STANDSTILL: "no movement, so the frequency tells nothing of a wavelength",
    RoughnessStatus.NO_VELOCITY: "no finite velocity: frequency only",
    RoughnessStatus.GAP: "samples are missing in the window; the answer, if any, is from the others",
    RoughnessStatus.MISSING: "the reading is missing or not finite",
    RoughnessStatus.SATURATED: "the reading is saturated",
    RoughnessStatus.ALIASED: "too fast for this sampling rate: what is counted may be an alias",
    RoughnessStatus.DUPLICATE: "the sample is not later than the one before, and was left out",
}
OK, WARMING_UP, SILENT, STANDSTILL, NO_VELOCITY, GAP, MISSING, SATURATED, ALIASED, DUPLICATE = map(int, RoughnessStatus)


class RoughnessEstimate(NamedTuple):
    """frequency_Hz, wavelength_mm (NaN where there is no answer), power and status: the value of a `RoughnessStatus`.

    power is that of the spectral line in squared units of the reading times s; NaN of the estimators that count. Of a
    block, arrays (n,).
    """

    frequency_Hz: float | np.ndarray
    wavelength_mm: float | np.ndarray
    power: float | np.ndarray
    status: int | np.ndarray

    @property
    def sentence(self):
        """The status in words: a string, or a list of them."""
        return status_in_words(RoughnessStatus, self.status)


class Finding(NamedTuple):
    """What a method finds in its window: frequency in Hz, distance in mm travelled in one period, power, and status.

    NaN where it finds none; a status other than OK or GAP is no answer. Of a block, arrays (n,).
    """

    frequency: float | np.ndarray
    distance: float | np.ndarray
    power: float | np.ndarray
    status: int | np.ndarray


def found_nothing(status: int) -> Finding:
    """No answer, for the reason of this status."""
    return Finding(NONE, NONE, NONE, status)


def first_reason(reasons: list[tuple[np.ndarray, int]], otherwise) -> np.ndarray:
    """The status (n,) of the first reason (of n each) that holds; `otherwise` (a status, or n) where none does."""
    status = otherwise
    for holds, code in reversed(reasons):
        status = np.where(holds, code, status)
    return status
