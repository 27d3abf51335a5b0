"""Cramér-Rao bounds of a grating's wavelength and of a gliding frequency, from white noise on a harmonic signal.

What is bounded is `y_i = b + sum_h Re(c_h exp(-j h theta_i)) + noise`: every complex amplitude c_h and the offset b are
unknown, and theta is either the wavenumber times a known position or a polynomial of time.
"""

import math

import numpy as np

from papilla import checks
from papilla.errors import InputError


def wavelength_bound(position_mm, wavelength_mm: float, amplitudes, noise_sd: float, present=None) -> float:
    """Smallest relative standard deviation (a fraction) of an unbiased wavelength, the positions being known.

    Parameters
    ----------
    position_mm : (n,) where each sample was taken, along the sliding direction.
    wavelength_mm : the true wavelength, > 0.
    amplitudes : (H,) complex harmonic amplitudes c_1 ... c_H; their phases do not matter to long windows.
    noise_sd : standard deviation of the white noise of a sample, in the unit of the amplitudes.
    present : (n, H) bool, which harmonics pass the anti-aliasing of each sample; all of them by default.

    Returns inf where the window cannot tell the wavelength at all (it spans no distance, or less than the model needs).
    Raises `InputError` for arrays whose shapes do not fit. Source: Kay, Fundamentals of Statistical Signal Processing I
    (1993), section 3.9 (the Fisher information of a signal in white noise), ISBN 978-0133457117.
    """
    wavelength = checks.positive("wavelength (mm)", wavelength_mm)
    position = np.asarray(position_mm, float)
    wavenumber = 2 * math.pi / wavelength
    centred = position - position.mean() if position.size else position
    # A small step of the wavenumber turns the phase by the distance from the middle; scaled, its sd is relative.
    variance = _end_variance(wavenumber * centred, (wavenumber * centred)[:, None], amplitudes, noise_sd, present)
    return math.sqrt(variance)


def frequency_bound(
    time_s, phase, rate_Hz: float, amplitudes, noise_sd: float, *, degree: int, at_s: float | None = None
) -> float:
    """Smallest relative standard deviation (a fraction) of a frequency at `at_s`, nothing being known of the velocity.

    The phase deviates from `phase` (n,) in rad by a polynomial of time, so the frequency by one of degree `degree`
    (0 constant, 1 a chirp); `rate_Hz` is the true frequency at `at_s`, by default the last sample (no delay).

    Raises `InputError` for shapes that do not fit, a rate that is not positive, or a negative degree.
    Source: as `wavelength_bound`; the polynomial phase after Peleg & Porat (1991), doi:10.1109/18.61122.
    """
    rate = checks.positive("frequency (Hz)", rate_Hz)
    if degree < 0:
        raise InputError(f"degree of the frequency must be at least 0, got {degree}")
    time = np.asarray(time_s, float)
    at = float(time[-1]) if at_s is None else checks.finite("at_s", at_s)
    span = max(float(np.ptp(time)), 1e-300)
    powers = ((time - at) / span)[:, None] ** np.arange(1, degree + 2)
    # Constant phase belongs to the amplitudes; the first power's coefficient over the span is the frequency wanted.
    variance = _end_variance(np.asarray(phase, float), powers, amplitudes, noise_sd, None)
    return math.sqrt(variance) / (2 * math.pi * rate * span)


def _end_variance(phase, turns, amplitudes, noise_sd: float, present) -> float:
    """Variance bound of the first column's coefficient, where `turns` (n, p) says how the phase answers to each."""
    noise = checks.positive("noise_sd", noise_sd)
    amplitudes = np.atleast_1d(np.asarray(amplitudes, complex))
    order = np.arange(1, amplitudes.size + 1)
    mask = np.ones((phase.size, order.size)) if present is None else np.asarray(present, float)
    if phase.ndim != 1 or turns.shape[0] != phase.size or mask.shape != (phase.size, order.size):
        raise InputError(f"shapes do not fit: {phase.size} samples, {order.size} harmonics, mask {mask.shape}")
    if phase.size == 0 or not np.any(amplitudes):
        return math.inf
    carrier = np.exp(-1j * phase[:, None] * order) * mask
    slope = np.real(-1j * order * amplitudes * carrier).sum(axis=1)
    basis = np.column_stack([turns * slope[:, None], carrier.real, carrier.imag, np.ones(phase.size)])
    scale = np.linalg.norm(basis, axis=0)
    used = scale > 0
    if not used[0]:
        return math.inf
    left = basis[:, used] / scale[used]
    others, wanted = left[:, 1:], left[:, 0]
    q, r = np.linalg.qr(others)
    pivots = np.abs(np.diag(r))
    q = q[:, pivots > 1e-12 * pivots.max(initial=1e-300)]
    rest = wanted - q @ (q.T @ wanted)
    information = float(rest @ rest)
    return math.inf if information < 1e-18 else noise**2 / (information * scale[0] ** 2)
