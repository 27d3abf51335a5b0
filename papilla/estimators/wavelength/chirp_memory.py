"""Answer and state of a tracker that does not know the velocity."""

import math
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from papilla.core.status import Status
from papilla.estimators.stream import SpreadTask
from papilla.estimators.wavelength.motion_fit import PRIOR_STIFFNESS_SIGMA, SHAPE_PARAMETERS, Design, MotionFit

FIRST_LIVELY = 1.0
"""Process noise of the motion at the beginning of a fit, relative to the frequency, in s^-2 and per sqrt(Hz)."""
OFFSET_KINK_LIMITS = 0.1, 10.0
"""Smallest and largest kink of the offset at a knot, relative to the first harmonic, over the window."""


class ChirpStatus(Status):
    """Status of an answer."""

    OK = "ok"
    SEARCHING = "no frequency stands out: the last one, if any, is continued in doubt, and its sigma grows"
    QUIET = "the reading does not change: standstill, or no texture"
    MISSING = "the reading is missing, not finite or saturated: the motion goes on as it was"
    AMBIGUOUS = "ambiguous: the frequency may be a harmonic of a lower one"


class ChirpEstimate(NamedTuple):
    """frequency_Hz and frequency_sigma_Hz, `lag_s` ago; wavelength_mm and wavelength_sigma_mm, NaN without a velocity;
    status (a `ChirpStatus` value). NaN before the first lock. Of a block, arrays (n,)."""

    frequency_Hz: float | np.ndarray
    frequency_sigma_Hz: float | np.ndarray
    wavelength_mm: float | np.ndarray
    wavelength_sigma_mm: float | np.ndarray
    status: int | np.ndarray

    @property
    def sentence(self) -> Any:
        """The status in words: a string, or a list of them."""
        return ChirpStatus.in_words(self.status)


class Step(NamedTuple):
    """A running step of the fit for `stride` new samples, in the readings (m,) of its window: the last fit extrapolated
    over them, the information before them, and the new fit once it is solved."""

    design: Design
    prior: np.ndarray
    about: np.ndarray
    readings: np.ndarray
    stride: int
    fit: MotionFit | None = None


@dataclass(eq=False)
class ChirpMemory:
    """readings, phases (n,), speeds : of the latest samples; phases in cycles, NaN if not known; count : number of
    readings in use; since : samples since the last step.

    stroke : the fit that is followed, None before the first; answers : frequency and sigma of each sample since the
    last step. span : samples since it began; followed : periods since; doubt : ratio of its residual to the noise;
    price : its cost on the readings of a search. known (9, 9), about (9,) : information of the profile in units of the
    noise, and its values;
    stiffness : mean and variance; lively, wander : noise of the motion and of the offset; swing : fading mean square of
    the frequency; quiet : whether nothing changes; absent : whether the wave that is followed is missing.
    step : the running step. search : the running `FrequencySearch` or `SubharmonicTest`; rival : cost that its best fit
    must undercut; waited : samples since a search began; idle : True if none was begun because the readings were noise.
    asked : samples since the last test for a harmonic; other : the other possible frequency, 0 for none, NaN before the
    first test; clean : number of tests without a sign since. held : wavelength and sigma.
    """

    readings: np.ndarray
    phases: np.ndarray
    speeds: list[float]
    count: int = 0
    since: int = 0
    stroke: MotionFit | None = None
    answers: list[tuple[float, float]] = field(default_factory=list)
    span: int = 0
    followed: float = 0.0
    doubt: float = 0.0
    price: float = math.inf
    known: np.ndarray = field(default_factory=lambda: np.zeros((SHAPE_PARAMETERS, SHAPE_PARAMETERS)))
    about: np.ndarray = field(default_factory=lambda: np.zeros(SHAPE_PARAMETERS))
    stiffness: tuple[float, float] = (0.0, PRIOR_STIFFNESS_SIGMA**2)
    lively: float = FIRST_LIVELY
    wander: float = OFFSET_KINK_LIMITS[0]
    swing: float = 0.0
    quiet: bool = False
    absent: bool = False
    step: Step | None = None
    search: SpreadTask | None = None
    rival: float = math.inf
    waited: int = 0
    idle: bool = False
    asked: int = 0
    clean: int = 0
    other: float = math.nan
    held: tuple[float, float] = (math.nan, math.nan)
