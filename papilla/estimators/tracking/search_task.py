"""Input of a search for lines: the latest rows of the path, and what is known of them."""

from typing import NamedTuple

import numpy as np

from papilla import checks
from papilla.errors import InputError
from papilla.estimators.spectrum import longest_strokes, middle, share_of
from papilla.units import TINY

MAINS_HZ = (50.0, 60.0)
GRID = 4
"""Grid points in the shortest wavelength: aliases from beyond are then weaker than a third, and none is a sum of
lines."""
FEWEST_WAVES = 4.0
"""Number of shortest wavelengths that the longest stroke must contain."""


class Options(NamedTuple):
    """low, high : wavelengths in mm. rate_Hz : of the samples. scale_sigma : relative standard deviation of the path's
    scale. latency_s : delay of the path; None means that it is estimated. hums_Hz : frequencies below half the rate
    that a line over time may have. ridge_pitch_mm : of the finger's own ridges, 0 for none or an unknown one."""

    low: float
    high: float
    rate_Hz: float
    scale_sigma: float
    latency_s: float | None
    hums_Hz: tuple[float, ...]
    ridge_pitch_mm: float


def checked(wavelength_range_mm, rate_Hz, scale_sigma, latency_s, resonances_Hz, ridge_pitch_mm=None) -> Options:
    """The options, or `InputError` for unusable ones: a range must span a factor of 1.5 to 100."""
    low, high = checks.rising("wavelength_range_mm", wavelength_range_mm)
    if not 1.5 * low <= high <= 100 * low:
        raise InputError(f"wavelength_range_mm must span a factor 1.5 to 100, got {low:g} to {high:g} mm")
    rate = checks.positive("sample_rate_Hz", rate_Hz)
    hums = {n * base for base in MAINS_HZ for n in range(1, int(0.5 * rate / base) + 1)}
    hums |= {checks.positive("resonances_Hz", value) for value in resonances_Hz}
    late = None if latency_s is None else checks.within("latency_s", latency_s, -0.1, 0.1)
    pitch = 0.0 if ridge_pitch_mm is None else checks.within("ridge_pitch_mm", ridge_pitch_mm, 0, 100)
    return Options(low, high, rate, checks.within("scale_sigma", scale_sigma, 0, 0.2), late, tuple(sorted(hums)), pitch)


class Task(NamedTuple):
    """rows (m, 3 + g) of time, place, samples, readings; breaks : rows at which strokes begin.

    step, size : the grid; late_s : delay of the path behind the readings, and its variance (0: known); before : the
    known wavenumber, 0 for none; proved : the one on which many searches agreed, 0 for none. known_hums_Hz :
    frequencies of lines over time that were found recently.
    """

    rows: np.ndarray
    breaks: tuple[int, ...]
    options: Options
    step: float
    size: int
    late_s: float
    late_variance: float
    before: float
    proved: float
    known_hums_Hz: tuple[float, ...]

    def highest(self, place: np.ndarray) -> float:
        """The highest wavenumber of the range that the distance of these places can show."""
        return min(1 / self.options.low, 0.45 / max(share_of(np.abs(np.diff(place)), 0.9), 1e-12))

    def grid(self, place: np.ndarray) -> float:
        """Step of the grid in mm: that of the path if it is longer. Even steps make images of a line; with this grid
        they fall on the line itself, and not beside it, where they would look like another texture."""
        return max(self.step, middle(np.abs(np.diff(place))))


class Window(NamedTuple):
    """time, place, samples (m,) and number of the stroke (m,) of each row; begin (s + 1,) : first row of each stroke;
    readings (m, g)."""

    time: np.ndarray
    place: np.ndarray
    samples: np.ndarray
    stroke: np.ndarray
    begin: np.ndarray
    readings: np.ndarray


def window_of(task: Task, late_s: float) -> Window | None:
    """The strokes of a task that are long enough; None if there are none.

    The path is late: at a time t the finger is where the path says at t + late.
    """
    rows = task.rows
    time, place = rows[:, 0], rows[:, 1]
    breaks = np.array(task.breaks, int)
    if late_s:
        at = time + late_s
        known = (at >= time[0]) & (at <= time[-1])
        # Where the stated path turned at t + late, the finger turned at t.
        breaks = np.searchsorted(at, time[breaks]) - int(known.argmax())
        rows, place, time = rows[known], np.interp(at[known], time, place), time[known]
    found = longest_strokes(
        place, [0, *(b for b in breaks.tolist() if 0 < b < len(rows)), len(rows)], FEWEST_WAVES * task.options.low
    )
    if found is None:
        return None
    index, begin = found
    stroke = np.repeat(np.arange(len(begin) - 1), np.diff(begin))
    # Only strokes nearly as long as the longest are used: the shortest sets the resolution of all.
    return Window(time[index], place[index], rows[index, 2], stroke, begin, rows[index, 3:])


def bend_of(time: np.ndarray, place: np.ndarray, weight: np.ndarray) -> float:
    """Deviation of a stroke from a straight line over time: root mean square in mm, with weights (m,)."""
    total = float(weight.sum())
    t, x = time - float(weight @ time) / total, place - float(weight @ place) / total
    off = x - t * (float(weight @ (t * x)) / max(float(weight @ t**2), TINY))
    return (float(weight @ off**2) / total) ** 0.5
