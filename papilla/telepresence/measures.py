"""Measures of a displayed signal by an ideal observer: its delay, and its wavelength for the hand's motion."""

import math
from typing import NamedTuple

import numpy as np

from papilla.units import TINY

WINDOW_S, QUARTERS = 0.25, 4
"""Length of a window: half a stroke of a hand or less, a dozen periods of a texture. Windows of the felt wavelength
advance by a quarter, and a quarter without a signal is silence."""
EARLIEST_S = -0.05
"""Smallest lag that is searched: a display that is early by chance should not look late."""
SLOW = 0.3
"""Share of the largest speed below which no wavelength is estimated."""
GRID = 0.1
"""Step of the searched wavenumbers, in units of the resolution, 1 over the longest path of a window."""
SILENT = 0.05
"""Share of the largest rms of a window below which nothing is felt."""

NEAR_S, BROAD_S = 0.15, 0.02
"""Largest difference of a window's lag from the common one, and range of lags over which windows agree: delays vary."""
LEAST_TURNS, LEAST_COHERENCE = 2.0, 0.35
"""Smallest number of periods of the texture in a window, and smallest share of the signal that the fit explains (1 for
a sine)."""
STEADY = 0.2
"""Share of the largest speed by which the speed must change in a window that determines a lag."""


def lag_s(shown, turns, place_mm, rate_Hz: float, longest_s: float) -> float:
    """Delay of a displayed signal behind the hand: the shift with which it fits the texture under the hand best.

    In windows of 0.25 s, |sum shown(t) exp(-2 pi i turns(t - lag))| over lags from -0.05 s to `longest_s`. Both
    directions of a stroke fit equally well, so a single window also fits half a stroke later; the sum over windows does
    not, if strokes differ. The result is the median over windows of the best lag within 0.15 s of the best lag of that
    sum. NaN if nothing is displayed, if the signal does not contain the texture, or if the speed never changes, because
    a steady sine fits at any lag.

    Parameters
    ----------
    shown : (n,) displacement. turns : (n,) periods of the texture that the hand has passed, with sign.
    place_mm : (n,) position of the hand. rate_Hz : of all. longest_s : greater than 0.
    """
    signal = np.asarray(shown, float)
    passed, place = np.asarray(turns, float), np.asarray(place_mm, float)
    wave = np.exp(-2j * math.pi * passed)
    size, first, last = (round(own * rate_Hz) for own in (WINDOW_S, EARLIEST_S, longest_s))
    loudest, scores = _loudest(signal, size), []
    for begin in range(last, signal.size - size + first, size // 2):
        part, around = signal[begin : begin + size], slice(begin - last, begin - first + size)
        speeds = np.abs(np.diff(place[around]))
        if loudest == 0 or part.std() < SILENT * loudest or np.ptp(speeds) < STEADY * speeds.max():
            continue
        if np.abs(np.diff(passed[begin : begin + size])).sum() < LEAST_TURNS:
            continue
        # `correlate` conjugates its second argument, which has no effect on a real signal.
        score = np.abs(np.correlate(wave[around], part - part.mean(), "valid"))[::-1]
        if score.max() * math.sqrt(2) > LEAST_COHERENCE * size * part.std():
            scores.append(score / score.max())
    if not scores:
        return math.nan
    near, found = round(NEAR_S * rate_Hz), []
    broad = np.convolve(np.sum(scores, axis=0), np.ones(round(BROAD_S * rate_Hz)), "same")
    middle = int(np.argmax(broad))
    low = max(0, middle - near)
    for score in scores:
        best = low + int(np.argmax(score[low : middle + near + 1]))
        if 0 < best < score.size - 1:
            found.append((first + best + _vertex(score[best - 1 : best + 2])) / rate_Hz)
    return float(np.median(found)) if found else math.nan


class Felt(NamedTuple):
    """(m,) times of windows, the felt wavelength (NaN if nothing is displayed) and the true one, both in mm."""

    time_s: np.ndarray
    wavelength_mm: np.ndarray
    truth_mm: np.ndarray

    @property
    def error(self) -> float:
        """RMS of felt over true minus 1 (cut to -1 ... 3) over the windows that are not silent; NaN without any."""
        ratio = self.wavelength_mm / self.truth_mm - 1
        ratio = np.clip(ratio[np.isfinite(ratio)], -1, 3)
        return float(np.sqrt(np.mean(ratio**2))) if ratio.size else math.nan

    @property
    def silent(self) -> float:
        """Share of the windows in which nothing is displayed."""
        return float(np.mean(np.isnan(self.wavelength_mm))) if self.time_s.size else math.nan


def felt_wavelength(shown, place_mm, truth_mm, rate_Hz: float, range_mm=(0.3, 8.0)) -> Felt:
    """The strongest line of what is displayed over the hand's own path, in windows of 0.25 s, each a quarter later.

    An ideal observer, who knows the hand's movement exactly, would obtain it from speed over frequency. Windows in
    which the hand is slower than 30 % of its peak, or the true wavelength changes, are left out; in a window with a
    quarter of silence nothing is felt.

    Parameters
    ----------
    shown, place_mm, truth_mm : (n,) displacement, position of the hand, wavelength under it. rate_Hz : of all.
    range_mm : range of wavelengths.
    """
    signal, place, truth = (np.asarray(values, float) for values in (shown, place_mm, truth_mm))
    size, speed = round(WINDOW_S * rate_Hz), np.abs(np.gradient(place)) * rate_Hz
    loudest, peak = _loudest(signal, size), speed.max()
    wavenumbers = np.arange(1 / range_mm[1], 1 / range_mm[0], GRID / max(peak * WINDOW_S, TINY))
    times, felt, true = [], [], []
    for begin in range(0, signal.size - size + 1, size // QUARTERS):
        rows = slice(begin, begin + size)
        if speed[rows].min() < SLOW * peak or np.ptp(truth[rows]) > 0:
            continue
        part = signal[rows] - signal[rows].mean()
        times.append((begin + size) / rate_Hz)
        true.append(truth[begin])
        quarters = part[: size // QUARTERS * QUARTERS].reshape(QUARTERS, -1).std(axis=1)
        if loudest == 0 or quarters.min() < SILENT * loudest:
            felt.append(math.nan)
            continue
        power = np.abs(np.exp(-2j * math.pi * np.outer(wavenumbers, place[rows])) @ part)
        best = int(np.argmax(power))
        shift = _vertex(power[best - 1 : best + 2]) if 0 < best < power.size - 1 else 0.0
        felt.append(1 / (wavenumbers[best] + shift * (wavenumbers[1] - wavenumbers[0])))
    return Felt(np.array(times), np.array(felt), np.array(true))


def _loudest(signal: np.ndarray, size: int) -> float:
    parts = signal[: signal.size // size * size].reshape(-1, size)
    return float(parts.std(axis=1).max()) if parts.size else 0.0


def _vertex(three: np.ndarray) -> float:
    """Place of the vertex of a parabola through values at -1, 0, 1."""
    before, middle, after = three
    bend = before - 2 * middle + after
    return 0.5 * (before - after) / bend if bend < 0 else 0.0
