"""What the streaming ridge answers, and the sentences of its status."""

import math
from typing import NamedTuple

import numpy as np

from papilla.status import Status

NONE = math.nan


class RidgeStatus(Status):
    """What became of an answer; `sentence` says it in words."""

    OK = 0, "ok"
    WARMING_UP = 1, "the wavelets reach beyond the first sample"
    NOT_SIGNIFICANT = 2, "red noise explains what the two channels share"
    GAP = 3, "too many samples are missing within reach"
    SILENT = 4, "a channel does not change"
    COMMON = 5, "no phase between the two channels: it may be common to both (hum, a jolt of the finger)"


OK, WARMING_UP, NOT_SIGNIFICANT, GAP, SILENT, COMMON = map(int, RidgeStatus)


class RidgeEstimate(NamedTuple):
    """The ridge as it was `lag_s` ago: frequency_Hz is f_MP, mean_Hz and sd_Hz (ddof 1) of its last 20 instants.

    phase : of the first channel before the second, in -pi ... pi; magnitude : of the cross-wavelet there; NaN where
    there is no answer. status : a `RidgeStatus`. Of a block, arrays (n,).
    """

    frequency_Hz: float | np.ndarray
    mean_Hz: float | np.ndarray
    sd_Hz: float | np.ndarray
    phase: float | np.ndarray
    magnitude: float | np.ndarray
    status: int | np.ndarray

    @property
    def sentence(self):
        """The status in words: a string, or a list of them."""
        return RidgeStatus.in_words(self.status)
