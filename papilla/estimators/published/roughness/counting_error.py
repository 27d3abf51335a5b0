"""Expected error of counting periods over a time A, and the A that makes it smallest (2007 paper).

The paper says that A = 0.08 s minimises "the formulation of expected estimation errors" and prints no formula. This one
follows from how the estimate is made. A wavelength w under the velocity v(t) = V sin(2 pi r t) gives the frequency
f(t) = v(t) / w; counted over the last A it is N / A.

It holds for a signed count: periods passed backwards count negative, whereas the impulses of the paper only add up.

* Counting: A f is cut to a whole number of periods; with a random phase the square of the error has the expectation
  u (1 - u), u the fractional part of A f, on average 1/6: the frequency is off by 1 / (sqrt(6) A).
* Delay: N / A is the mean of f over the last A: the sinusoid times sinc(r A), late by A / 2. Its mean square
  difference from f(t) is (V / w)^2 / 2 |1 - sinc(r A) exp(-i pi r A)|^2, about (pi r A V / w)^2 / 2.

Counting falls with A, delay rises: the sum is smallest at A = (4/3)^(1/4) sqrt(w / (2 pi r V)). For A = 0.08 s this is
w = 2 pi r V (0.08 s)^2 / (4/3)^(1/2): 3.5 mm at the natural touch of 100 sin(2 pi t) mm/s. The minimum is flat: over
1-4 mm in this touch, with u (1 - u) itself in place of its average, no A has an error more than 4 % smaller.
"""

import numpy as np

from papilla import checks
from papilla.errors import InputError


def expected_error(period_s, wavelength_mm: float, peak_speed_mm_s: float, touch_Hz: float):
    """Root mean square error of the frequency in Hz, counted over `period_s` (scalar or (n,)).

    The touch is peak_speed sin(2 pi touch_Hz t); its amplitude of frequency is peak_speed / wavelength. Counting is
    taken at its average over fractional parts, which holds once a window holds a period or more.
    Raises `InputError` for what is not positive.
    """
    wavelength = checks.positive("wavelength_mm", wavelength_mm)
    speed = checks.positive("peak_speed_mm_s", peak_speed_mm_s)
    turns = checks.positive("touch_Hz", touch_Hz) * _periods(period_s)
    # numpy's sinc already contains the pi.
    delay = np.abs(1 - np.sinc(turns) * np.exp(-1j * np.pi * turns)) ** 2
    return np.sqrt(1 / (6 * _periods(period_s) ** 2) + 0.5 * (speed / wavelength) ** 2 * delay)


def optimal_period(wavelength_mm: float, peak_speed_mm_s: float, touch_Hz: float) -> float:
    """The A in s that makes `expected_error` smallest, to first order in touch_Hz x A.

    Raises `InputError` for what is not positive.
    """
    wavelength = checks.positive("wavelength_mm", wavelength_mm)
    speed, turns = checks.positive("peak_speed_mm_s", peak_speed_mm_s), checks.positive("touch_Hz", touch_Hz)
    return float((4 / 3) ** 0.25 * np.sqrt(wavelength / (2 * np.pi * turns * speed)))


def _periods(period_s) -> np.ndarray:
    periods = np.asarray(period_s, float)
    if not (np.isfinite(periods).all() and (periods > 0).all()):
        raise InputError("period_s must be positive and finite")
    return periods
