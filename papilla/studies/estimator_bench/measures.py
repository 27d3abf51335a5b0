"""What the answers of one run are judged by: error, stated sigma, false locks, lag, time to settle after a step."""

import math
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from papilla.studies.estimator_bench.scenes import Scene

CLIP = (-1.0, 3.0)
"""Relative errors are clipped to these; a row without an answer counts as the worst."""
OUTLIER = 0.1
LOCK_S, LOCK_SPREAD = 0.2, 0.1
"""A false lock: for so long every answer is an outlier, and they differ by no more than this fraction."""
FOLLOWS = 0.5
"""Correlation from which a frequency is taken to follow the true one."""
SETTLED_S = 1.0
_LONGEST_LAG_MS, _LONGEST_LEAD_MS = 150, 30


class Errors(NamedTuple):
    """Of one run over the judged rows: |relative error| (n,), which rows have an answer (n,), and the mean square of
    error over stated sigma (NaN without one)."""

    absolute: np.ndarray
    answered: np.ndarray
    sigma_square: float


def errors_of(scene: Scene, answer) -> Errors:
    """Compare the wavelengths of `answer` (its columns n rows) with the scene's truth."""
    rows = scene.judged(SETTLED_S)
    truth, found = scene.wavelength_mm[rows], np.asarray(answer.wavelength_mm)[rows]
    sigma = getattr(answer, "wavelength_sigma_mm", None)
    square = math.nan
    if sigma is not None:
        stated = np.asarray(sigma)[rows]
        known = np.isfinite(found) & (stated > 0)
        if known.any():
            square = float(np.mean(((found - truth)[known] / stated[known]) ** 2))
    return Errors(np.abs(_clipped(found, truth)), np.isfinite(found), square)


def _clipped(found, truth):
    return np.clip(np.where(np.isfinite(found), found / truth - 1, CLIP[1]), *CLIP)


def falsely_locked(scene: Scene, wavelength_mm) -> bool:
    """Whether a run settles on a wrong wavelength after the first second: 10 % off and steady for `LOCK_S`."""
    after = scene.time_s > SETTLED_S
    found = np.asarray(wavelength_mm, float)[after]
    length = round(LOCK_S * scene.sample_rate_Hz)
    if found.size < length:
        return False
    off = np.abs(found / scene.wavelength_mm[after] - 1) > OUTLIER
    windows = sliding_window_view(np.where(off, found, np.nan), length)
    spread = windows.max(axis=1) / windows.min(axis=1)
    return bool(np.any(spread < 1 + LOCK_SPREAD))


def lag_ms(scene: Scene, frequency_Hz) -> float:
    """Shift in ms by which the estimated frequency follows |v| / lambda best, to a fraction of a sample.

    Looked for from 30 ms early to 150 ms late. NaN where the frequency does not vary, was never told, or where no shift
    correlates with it by `FOLLOWS`: what does not follow has no lag.
    """
    rate, truth = scene.sample_rate_Hz, scene.frequency_Hz
    found = np.nan_to_num(np.asarray(frequency_Hz, float), posinf=0.0, neginf=0.0)
    late, early = round(_LONGEST_LAG_MS * rate / 1000), round(_LONGEST_LEAD_MS * rate / 1000)
    start, stop = int(np.searchsorted(scene.time_s, SETTLED_S)), truth.size - early
    if start < late or np.ptp(truth[start:]) < 1e-6 * truth.max() or np.ptp(found[start:stop]) == 0:
        return math.nan
    shifts = np.arange(-early, late + 1)
    windows = sliding_window_view(truth, stop - start)[start - shifts]
    windows = windows - windows.mean(axis=1, keepdims=True)
    answer = found[start:stop] - found[start:stop].mean()
    scores = windows @ answer / (np.linalg.norm(windows, axis=1) * np.linalg.norm(answer))
    best = int(np.argmax(scores))
    if not (0 < best < shifts.size - 1 and scores[best] >= FOLLOWS):
        return math.nan
    left, middle, right = scores[best - 1 : best + 2]
    between = 0.5 * (left - right) / (left - 2 * middle + right)
    return 1000 * float(shifts[best] + between) / rate


def aligned_square(scene: Scene, frequency_Hz, lag: float) -> float:
    """Mean square relative error of the wavelength when the velocity is taken `lag` ms earlier, as the frequency is.

    NaN where the lag is.
    """
    if math.isnan(lag):
        return math.nan
    rows = scene.judged(SETTLED_S)
    truth = np.interp(scene.time_s - lag / 1000, scene.time_s, scene.frequency_Hz)[rows]
    found = np.asarray(frequency_Hz, float)[rows]
    usable = np.isfinite(found) & (found > 0)
    wavelength = np.divide(truth, found, out=np.full(found.size, np.nan), where=usable)
    return float(np.mean(_clipped(wavelength, 1.0) ** 2))


def settling_ms(scene: Scene, wavelength_mm, at_s: float, within: float = 0.05) -> float:
    """Time in ms after a step at `at_s` from which the wavelength stays within a fraction of the truth; inf for
    never."""
    start = int(np.searchsorted(scene.time_s, at_s))
    error = np.abs(np.asarray(wavelength_mm)[start:] / scene.wavelength_mm[start:] - 1)
    bad = np.flatnonzero(~(error <= within))
    if bad.size and bad[-1] == error.size - 1:
        return math.inf
    return 1000 * (float(bad[-1]) + 1 if bad.size else 0.0) / scene.sample_rate_Hz
