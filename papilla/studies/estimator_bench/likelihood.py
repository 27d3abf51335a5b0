"""Is the Cramér-Rao bound real? A maximum-likelihood fit of whole windows, over many noises, against it.

The fit is a harmonic least squares that is told nothing but the positions and a third of an octave to look in: the best
of a grid of wavenumbers, then Gauss-Newton on wavenumber, amplitudes and offset together.
"""

import math
from dataclasses import dataclass

import numpy as np

from papilla.references.cramer_rao import wavelength_bound
from papilla.studies.estimator_bench.scenes import HARMONICS, PASS_BAND, Scene, profile_amplitudes, scene

SEARCH = 1.25
"""The wavelength is looked for within this factor of the truth: twice it has the same harmonics and more."""
GRID = 0.25
"""Spacing of the grid times the length of the window, in turns."""
_STEPS = 6


@dataclass(frozen=True)
class Likelihood:
    """Of one scene and window: scatter of the fitted wavelength and its bound, as fractions (RMS over wavelengths),
    their ratio, and how many fits it is from."""

    scene: str
    snr_dB: float
    window_s: float
    scatter: float
    bound: float
    ratio: float
    fits: int


def fit_wavelengths(position_mm, readings, present, around_mm: float) -> np.ndarray:
    """(m,) wavelengths in mm of maximum likelihood, for m noisy readings (n, m) of one window in white noise.

    position_mm (n,) ; present (n, H) bool, which harmonics pass at each sample; around_mm : looked for within `SEARCH`
    of it. Source: Kay, Fundamentals of Statistical Signal Processing I (1993), section 7 (maximum likelihood in white
    noise is least squares), ISBN 978-0133457117.
    """
    centred = np.asarray(position_mm, float) - np.mean(position_mm)
    middle = 2 * math.pi / around_mm
    step = 2 * math.pi * GRID / float(np.ptp(centred))
    grid = np.arange(middle / SEARCH, middle * SEARCH, step)
    explained = np.array([_explained(_model(centred, wavenumber, present)[0], readings) for wavenumber in grid])
    best = grid[np.argmax(explained, axis=0)]
    return np.array(
        [
            2 * math.pi / _refined(centred, column, present, wavenumber)
            for column, wavenumber in zip(np.asarray(readings).T, best, strict=True)
        ]
    )


def _model(centred, wavenumber: float, present):
    """Design matrix (n, 2 H + 1) of the amplitudes and the offset, and the harmonics' waves (n, H) themselves."""
    waves = np.exp(-1j * wavenumber * centred[:, None] * np.arange(1, present.shape[1] + 1)) * present
    return np.column_stack([waves.real, -waves.imag, np.ones(centred.size)]), waves


def _explained(design, readings):
    """(m,) power that the design explains of each reading."""
    left, values, _ = np.linalg.svd(design, full_matrices=False)
    return np.sum((left[:, values > 1e-9 * values[0]].T @ readings) ** 2, axis=0)


def _refined(centred, reading, present, wavenumber: float) -> float:
    """The wavenumber after Gauss-Newton on all unknowns; amplitudes are solved for at each step."""
    orders = np.arange(1, present.shape[1] + 1)
    for _ in range(_STEPS):
        design, waves = _model(centred, wavenumber, present)
        fit = np.linalg.lstsq(design, reading, rcond=1e-9)[0]
        amplitudes = fit[: orders.size] + 1j * fit[orders.size : 2 * orders.size]
        slope = np.real(-1j * centred[:, None] * waves * orders @ amplitudes)
        wavenumber += np.linalg.lstsq(np.column_stack([slope, design]), reading - design @ fit, rcond=1e-9)[0][0]
    return wavenumber


def likelihood(
    kind: str, wavelengths_mm, *, snr_dB: float = 20.0, window_s: float = 0.2, draws: int = 300, seed: int = 0
) -> Likelihood:
    """Scatter of the fit over `draws` noises on one window of a scene for each wavelength, against the window's bound.

    The window ends where the scene is fastest for the last time.
    """
    squares, bounds = [], []
    for wavelength in wavelengths_mm:
        made = scene(kind, wavelength, snr_dB=snr_dB, seed=seed)
        rows = _window(made, window_s)
        position = made.position_mm[rows]
        present = made.frequency_Hz[rows, None] * np.arange(1, HARMONICS + 1) < PASS_BAND * made.sample_rate_Hz
        bounds.append(
            wavelength_bound(position, wavelength, profile_amplitudes(wavelength), made.noise_sd, present) ** 2
        )
        noise = made.noise_sd * np.random.default_rng(seed).standard_normal((position.size, draws))
        found = fit_wavelengths(position, made.signal[rows] + noise, present, wavelength)
        squares.append(np.mean((found / wavelength - 1) ** 2))
    scatter, bound = math.sqrt(np.mean(squares)), math.sqrt(np.mean(bounds))
    return Likelihood(kind, snr_dB, window_s, scatter, bound, scatter / bound, draws * len(bounds))


def _window(made: Scene, window_s: float) -> slice:
    length = round(window_s * made.sample_rate_Hz)
    speed = np.abs(made.velocity_mm_s)
    end = int(np.flatnonzero(speed >= speed.max() * (1 - 1e-6))[-1]) + 1
    return slice(max(end - length, 0), max(end, length))
