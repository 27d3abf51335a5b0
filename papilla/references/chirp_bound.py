"""Cramér-Rao bound of the frequency of a periodic signal whose motion nobody knows, from a short window of it.

Within the window the frequency is taken to be linear in time (a chirp); amplitudes, phase and offset are unknown. What
is asked for may be older than the last sample: half a window of delay is worth a factor of four.
"""

import math

import numpy as np

from papilla import checks
from papilla.errors import InputError
from papilla.references.cramer_rao import frequency_bound


def chirp_bound(
    count: int, sample_rate_Hz: float, frequency_Hz: float, amplitudes, noise_sd: float, lag_s: float = 0.0
) -> float:
    """Smallest relative standard deviation (a fraction) of the frequency `lag_s` before the last of `count` samples.

    In closed form, for windows of many periods: the phase is a parabola in white noise of information
    `sum_h h^2 |c_h|^2 / (2 noise_sd^2)` a sample, so that with Legendre's polynomials over the window, whose slopes at
    x are 1 and 3 x and whose squares sum up to count/3 and count/5, the slope at x has the variance
    `(3 + 45 x^2) / (count information)`; x is 1 at the last sample, 0 in the middle.

    amplitudes : (H,) complex harmonic amplitudes c_1 ... c_H, of the reading `sum_h Re(c_h exp(-j h theta))`.
    Raises `InputError` for fewer than four samples and numbers that are not positive. Source: Peleg & Porat (1991),
    doi:10.1109/18.61122 (polynomial phase).
    """
    if count < 4:
        raise InputError(f"count must be at least 4 samples, got {count}")
    rate, frequency = checks.positive("sample_rate_Hz", sample_rate_Hz), checks.positive("frequency (Hz)", frequency_Hz)
    noise = checks.positive("noise_sd", noise_sd)
    amplitudes = np.atleast_1d(np.asarray(amplitudes, complex))
    information = float(np.sum((np.arange(1, amplitudes.size + 1) * np.abs(amplitudes)) ** 2)) / (2 * noise**2)
    half_s = 0.5 * count / rate
    place = 1.0 - checks.finite("lag_s", lag_s) / half_s
    return math.sqrt((3.0 + 45.0 * place**2) / (count * information)) / half_s / (2 * math.pi * frequency)


def windowed_bounds(
    time_s, phase, frequency_Hz, amplitudes, noise_sd: float, *, ends, window_s: float, lag_s: float, band_Hz: float
) -> np.ndarray:
    """(m,) relative bounds (fractions) of the frequency `lag_s` before each of the rows `ends` (m,), numerically.

    time_s, phase, frequency_Hz : (n,) of a whole scene, phase in rad. Each bound is from the `window_s` up to its row,
    from the harmonics that stay below `band_Hz` in all of it. Infinite where a window cannot tell the frequency.
    Raises `InputError` for a window that begins before the first row. Source: `cramer_rao.frequency_bound`, degree 1.
    """
    time, phase, frequency = (np.asarray(values, float) for values in (time_s, phase, frequency_Hz))
    amplitudes = np.atleast_1d(np.asarray(amplitudes, complex))
    step = (time[-1] - time[0]) / (time.size - 1)
    length, back = round(window_s / step), round(lag_s / step)
    bounds = []
    for end in np.asarray(ends, int).tolist():
        rows = slice(end + 1 - length, end + 1)
        if rows.start < 0:
            raise InputError(f"a window of {window_s:g} s does not fit before row {end}")
        present = int(band_Hz / max(float(frequency[rows].max()), band_Hz / amplitudes.size))
        if present == 0 or frequency[end - back] <= 0:
            bounds.append(math.inf)
            continue
        bounds.append(
            frequency_bound(
                time[rows], phase[rows], frequency[end - back], amplitudes[:present], noise_sd,
                degree=1, at_s=float(time[end - back]),
            )
        )  # fmt: skip
    return np.array(bounds)
