"""The motion of the operator's hand, in a simulation or if there is no encoder."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from papilla import checks
from papilla.logs.quantities import SAMPLE_RATE_HZ

HAND_HZ, RATE_HZ = 250.0, SAMPLE_RATE_HZ
"""Positions and control periods per second: Okamoto et al. 2011, section 3."""
PARAMETERS_HZ = 50.0
"""Default number of the sensor's messages per second."""
WANDER_HZ = 0.31
"""Frequency with which the rate of the strokes varies."""
PRESS_SWING, PRESS_HZ = 0.4, 0.6
"""Size and frequency of the variation of the pressing force."""


@dataclass(frozen=True)
class Motion:
    """Motion of the hand: strokes to and fro with this peak speed and rate or, at 0 Hz, one stroke at a constant speed.

    The default is the touch of Okamoto et al. 2011, section 4.1.1: 197 sin(2 pi 1.07 t) mm/s, whose rate varies by 10 %
    with a period of 3.2 s, as for a hand. Exactly repeating strokes would look the same half a stroke later. The mean
    force is `press_N`; it varies by 40 % with a period of 1.7 s.
    """

    peak_mm_s: float = 197.0
    strokes_Hz: float = 1.07
    wander: float = 0.1
    press_N: float = 0.5

    def __post_init__(self):
        checks.within("peak_mm_s", self.peak_mm_s, 1, 1000)
        checks.within("strokes_Hz", self.strokes_Hz, 0, 10)
        checks.within("wander", self.wander, 0, 0.5)
        checks.within("press_N", self.press_N, 0, 100)

    def force_N(self, time_s: ArrayLike) -> Any:
        """Pressing force at a time or times."""
        return self.press_N * (1 + PRESS_SWING * np.sin(2 * math.pi * PRESS_HZ * np.asarray(time_s)))

    @property
    def length_mm(self) -> float:
        """Length of a stroke; infinite at a constant speed."""
        return self.peak_mm_s / (math.pi * self.strokes_Hz) if self.strokes_Hz else math.inf

    def place_mm(self, time_s: ArrayLike) -> Any:
        """Position at a time or times; the strokes begin at 0 and go forth first."""
        if self.strokes_Hz == 0:
            return self.peak_mm_s * np.asarray(time_s)
        time, slow = np.asarray(time_s), 2 * math.pi * WANDER_HZ
        turned = 2 * math.pi * self.strokes_Hz * (time + self.wander / slow * (1 - np.cos(slow * time)))
        return 0.5 * self.length_mm * (1 - np.cos(turned))
