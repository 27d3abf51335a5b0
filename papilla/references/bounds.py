"""Cramér-Rao bounds of a grating's wavelength, of a varying frequency, and of a specimen's modulus.

The readings of a grating are `y_i = b + sum_h Re(c_h exp(-j h theta_i))` plus white noise. The offset b and the complex
amplitudes c_h are unknown. The phase theta is the wavenumber times a known position, or a polynomial of time.
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from papilla.core import checks
from papilla.core.errors import InputError


def wavelength_bound(
    position_mm: ArrayLike,
    wavelength_mm: float,
    amplitudes: ArrayLike,
    noise_sd: float,
    present: ArrayLike | None = None,
) -> float:
    """Smallest relative standard deviation (a fraction) of an unbiased wavelength estimate at known positions.

    Parameters
    ----------
    position_mm : (n,) where each sample was taken, along the sliding direction.
    wavelength_mm : the true wavelength, > 0.
    amplitudes : (H,) complex harmonic amplitudes c_1 ... c_H; in long windows their phases do not matter.
    noise_sd : standard deviation of the white noise of a sample, in the unit of the amplitudes.
    present : (n, H) bool, harmonics that pass the anti-aliasing filter at each sample; all by default.

    Returns inf if the window does not determine the wavelength (it has no length, or too little for the number of
    unknowns). Raises `InputError` for arrays whose shapes do not fit. Source: Kay, Fundamentals of Statistical Signal
    Processing I (1993), section 3.9 (the Fisher information of a signal in white noise), ISBN 978-0133457117.
    """
    wavelength = checks.positive("wavelength (mm)", wavelength_mm)
    position = np.asarray(position_mm, float)
    wavenumber = 2 * math.pi / wavelength
    centred = position - position.mean() if position.size else position
    # d phase / d ln wavenumber is the phase, measured from the middle of the window
    variance = _end_variance(wavenumber * centred, (wavenumber * centred)[:, None], amplitudes, noise_sd, present)
    return math.sqrt(variance)


def frequency_bound(
    time_s: ArrayLike,
    phase: ArrayLike,
    rate_Hz: float,
    amplitudes: ArrayLike,
    noise_sd: float,
    *,
    degree: int,
    at_s: float | None = None,
) -> float:
    """Smallest relative standard deviation (a fraction) of a frequency estimate at `at_s`; the velocity is unknown.

    time_s, phase : (n,) times in s and true phases in rad. The unknown frequency deviates from the true one by a
    polynomial of time of degree `degree` (0 constant, 1 a chirp). rate_Hz : true frequency at `at_s`, by default the
    last sample (no delay).

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
    # A constant phase is part of the amplitudes; the coefficient of the first power, over the span, is 2 pi frequency
    variance = _end_variance(np.asarray(phase, float), powers, amplitudes, noise_sd, None)
    return math.sqrt(variance) / (2 * math.pi * rate * span)


def chirp_bound(
    count: int, sample_rate_Hz: float, frequency_Hz: float, amplitudes: ArrayLike, noise_sd: float, lag_s: float = 0.0
) -> float:
    """Smallest relative standard deviation (a fraction) of the frequency `lag_s` before the last of `count` samples.

    This is `frequency_bound` of degree 1 in closed form, for windows of many periods. A sample has the information
    `sum_h h^2 |c_h|^2 / (2 noise_sd^2)` about its phase, which is a parabola of time. Expand it in Legendre polynomials
    over the window, x = 0 in the middle and 1 at the last sample: P1 and P2 have the slopes 1 and 3 x, and their
    squares sum to count/3 and count/5. So the slope at x has the variance `(3 + 45 x^2) / (count information)`.

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


def modulus_bound(
    along_modulus: ArrayLike,
    along_force: ArrayLike,
    reading_sigma: float,
    force_sigma: float,
    errors: ArrayLike | None = None,
    nuisances: Sequence[tuple[ArrayLike, float]] = (),
) -> float:
    """Smallest standard deviation of an unbiased estimate of ln E from n samples of g readings and of the force.

    E is common to all samples. Each sample has its own unknown force, measured by its readings and by the force sensor.
    For S_d alone g = 1, with sigma of a gauge over sqrt(number of gauges).

    Parameters
    ----------
    along_modulus, along_force : (n, g) slopes of the readings in ln E (microstrain) and in force (microstrain / N).
    reading_sigma : standard deviation of the noise of a reading, microstrain, > 0.
    force_sigma : standard deviation of the measured force, N, > 0; inf without a force sensor.
    errors : (n, g, k) change of the readings by one sigma of each of k calibration errors. They are the same in all
        samples and do not average out. The bound is then the hybrid one: E is a parameter, the errors are random.
    nuisances : (slopes (n, g) of the readings, prior standard deviation) of each further unknown that differs from
        sample to sample, such as the place of the contact; inf means no prior.

    Returns inf if the readings do not depend on the modulus. Raises `InputError` for shapes that do not fit.
    Source: Fisher information with the nuisance eliminated by its Schur complement; van Trees, Detection, Estimation
    and Modulation Theory I (1968), section 2.4, ISBN 978-0471095170; Rockah and Schultheiss (1987) for the hybrid
    bound, doi:10.1109/TASSP.1987.1165144.
    """
    noise = checks.positive("reading_sigma", reading_sigma)
    if not force_sigma > 0:
        raise InputError(f"force_sigma must be greater than 0, got {force_sigma}")
    a, b = (np.asarray(slopes, float) for slopes in (along_modulus, along_force))
    if a.ndim != 2 or a.shape != b.shape:
        raise InputError(f"slopes must be two arrays (n, g), got {a.shape} and {b.shape}")
    parts = np.zeros((*a.shape, 0)) if errors is None else np.asarray(errors, float)
    if parts.shape[:2] != a.shape or parts.ndim != 3:
        raise InputError(f"errors must be (n, g, k) with n x g = {a.shape}, got {parts.shape}")
    design = np.concatenate([a[..., None], parts], axis=2) / noise
    slopes, precisions = [b], [force_sigma**-2.0]
    for along, sigma in nuisances:
        slopes.append(np.asarray(along, float))
        if slopes[-1].shape != a.shape or not sigma > 0:
            raise InputError(
                f"a nuisance must be slopes {a.shape} and a sigma above 0, got {slopes[-1].shape}, {sigma}"
            )
        precisions.append(sigma**-2.0)
    nuisance_design = np.stack(slopes, axis=2) / noise
    gram = np.einsum("ngi,ngj->ij", design, design)
    nuisance_information = np.einsum("ngk,ngl->nkl", nuisance_design, nuisance_design) + np.diag(precisions)
    mixed = np.einsum("ngi,ngk->nki", design, nuisance_design)
    gram -= np.einsum("nki,nkj->ij", mixed, np.linalg.pinv(nuisance_information, hermitian=True) @ mixed)
    gram[1:, 1:] += np.eye(parts.shape[2])
    information = gram[0, 0] - gram[0, 1:] @ np.linalg.solve(gram[1:, 1:], gram[1:, 0])
    return 1 / math.sqrt(information) if information > 1e-12 * (design[..., 0] ** 2).sum() else math.inf


def _end_variance(phase, turns, amplitudes, noise_sd: float, present) -> float:
    """Variance bound of the first of p coefficients; `turns` (n, p) are the derivatives of the phase by them."""
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
    scaled = basis[:, used] / scale[used]
    others, wanted = scaled[:, 1:], scaled[:, 0]
    q, r = np.linalg.qr(others)
    pivots = np.abs(np.diag(r))
    q = q[:, pivots > 1e-12 * pivots.max(initial=1e-300)]
    rest = wanted - q @ (q.T @ wanted)
    information = float(rest @ rest)
    return math.inf if information < 1e-18 else noise**2 / (information * scale[0] ** 2)
