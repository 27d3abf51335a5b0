"""Sliding scenes with a known truth: gratings under constant, active and harsh touch, in white noise.

Synthetic on purpose: the truth is exact and a Cramér-Rao bound exists. The sign of the velocity is the sign of motion.
"""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from papilla import checks
from papilla.errors import InputError
from papilla.references.cramer_rao import wavelength_bound

WAVELENGTHS_MM = (0.6, 1.2, 1.8, 2.4, 3.0)
SCENES = ("const", "act1", "act2", "harsh")
HARMONICS = 9
ENTRY_RAMP, EXIT_RAMP = 0.08, 0.15
"""Widths of the two flanks of the grating's trapezoid, as fractions of the wavelength."""
SKIN_KERNEL_MM = 0.1
"""Standard deviation of the Gaussian through which the skin feels the profile."""
PASS_BAND = 0.4
"""Harmonics above this fraction of the sampling rate are removed, as an amplifier's anti-aliasing filter does."""


@dataclass(frozen=True, eq=False)
class Scene:
    """A sliding scene, row by row.

    Parameters
    ----------
    name : one of `SCENES`, or "step".
    time_s, velocity_mm_s, position_mm : (n,) what the finger does; position is the integral of velocity.
    signal : (n, g) clean readings of each gauge, AC power 1 on an endless grating.
    readings : (n, g) the same with noise.
    wavelength_mm : (n,) truth.
    noise_sd : standard deviation of the noise of a sample.
    sample_rate_Hz : samples a second.
    """

    name: str
    time_s: np.ndarray
    velocity_mm_s: np.ndarray
    position_mm: np.ndarray
    signal: np.ndarray
    readings: np.ndarray
    wavelength_mm: np.ndarray
    noise_sd: float
    sample_rate_Hz: float

    @property
    def frequency_Hz(self) -> np.ndarray:
        """(n,) true temporal frequency, |v| / wavelength."""
        return np.abs(self.velocity_mm_s) / self.wavelength_mm

    def judged(self, settle_s: float = 1.0, slow: float = 0.3) -> np.ndarray:
        """(n,) bool: rows that errors are taken over, t > `settle_s` and |v| > `slow` times its peak."""
        speed = np.abs(self.velocity_mm_s)
        return (self.time_s > settle_s) & (speed > slow * speed.max())

    def block(self, delay_samples: int = 0, gain: float = 1.0) -> np.ndarray:
        """(n, g + 1): readings, then the velocity as it is known: `gain` times the true one, `delay_samples` late (the
        oldest is repeated)."""
        velocity = gain * self.velocity_mm_s
        if delay_samples:
            velocity = np.concatenate([np.full(delay_samples, velocity[0]), velocity[:-delay_samples]])
        return np.column_stack([self.readings, velocity])

    def bound(self, window_s: float, stride_s: float = 0.02) -> float:
        """Relative Cramér-Rao bound of the wavelength (a fraction): median over windows that end in judged rows.

        Several gauges have noise and amplitudes of their own, so their informations add up. Disturbances are not part
        of the bound. Raises `InputError` for a window that does not fit into the scene.
        """
        length = round(window_s * self.sample_rate_Hz)
        amplitudes = profile_amplitudes(float(self.wavelength_mm[-1]))
        order = np.arange(1, HARMONICS + 1)
        present = self.frequency_Hz[:, None] * order < PASS_BAND * self.sample_rate_Hz
        ends = np.flatnonzero(self.judged())[:: max(1, round(stride_s * self.sample_rate_Hz))]
        windows = [(slice(end - length, end), float(self.wavelength_mm[end])) for end in ends if end >= length]
        bounds = [
            wavelength_bound(self.position_mm[rows], wavelength, amplitudes, self.noise_sd, present[rows])
            for rows, wavelength in windows
        ]
        if not bounds:
            raise InputError(f"a window of {window_s:g} s does not fit into the scene of {self.time_s[-1]:g} s")
        return float(np.median(bounds)) / math.sqrt(self.signal.shape[1])


@lru_cache(maxsize=64)
def profile_amplitudes(wavelength_mm: float) -> np.ndarray:
    """(HARMONICS,) complex Fourier amplitudes of the felt grating, groove = ridge, AC power 1."""
    wavelength = checks.positive("wavelength (mm)", wavelength_mm)
    # Sum of four ramps: the Fourier integral of a piecewise linear period is exact from its corners.
    corners = np.array([0.0, ENTRY_RAMP, 0.5, 0.5 + EXIT_RAMP])
    slopes = np.array([1 / ENTRY_RAMP, 0.0, -1 / EXIT_RAMP, 0.0])
    turns = 2 * math.pi * np.arange(1, HARMONICS + 1)
    bends = np.diff(slopes, prepend=slopes[-1])
    coefficients = -2 * (np.exp(1j * np.outer(turns, corners)) @ bends) / turns**2
    felt = coefficients * np.exp(-0.5 * (turns * SKIN_KERNEL_MM / wavelength) ** 2)
    felt *= math.sqrt(2 / np.sum(np.abs(felt) ** 2))
    felt.flags.writeable = False
    return felt


def _motion(name: str, time, rng):
    """Velocity in mm/s and its exact integral in mm."""
    if name == "const":
        speed = 100 * (1 + rng.uniform(-0.03, 0.03))
        return np.full(time.size, speed), speed * time
    peak, rate = (197.0, 1.07) if name == "act2" else (100.0, 1.0)
    omega = 2 * math.pi * rate
    return peak * np.sin(omega * time), peak / omega * (1 - np.cos(omega * time))


def sheared(position, lag_mm: float = 0.3, relaxation_mm: float = 0.5):
    """(n,) place of the skin in mm: it trails the finger by `lag_mm`, turning over in `relaxation_mm` of sliding."""
    steps = np.diff(position, prepend=position[0])
    lag, trail = lag_mm, np.empty(position.size)
    for row, step in enumerate(steps):
        lag += (math.copysign(lag_mm, step) - lag) * -math.expm1(-abs(step) / relaxation_mm)
        trail[row] = lag
    return position - trail


def _disturbances(time, velocity, rng):
    """Baseline with pressing steps every 0.7 s, friction that turns with the velocity, and the drift of amplitude."""
    baseline = 2 * np.sin(2 * math.pi * 0.3 * time + rng.uniform(0, 2 * math.pi))
    for start in np.arange(0.35, time[-1], 0.7):
        size = rng.uniform(1.5, 4) * rng.choice([-1, 1])
        baseline += size * np.clip((time - start) / 0.02, 0, 1)
    amplitude = 1 + 0.4 * np.sin(2 * math.pi * 0.37 * time + rng.uniform(0, 2 * math.pi))
    return baseline + 3 * np.tanh(velocity / 5), amplitude


def _felt(position, velocity, wavelength, offset_mm, sample_rate_Hz):
    """Clean signal of one gauge at `offset_mm` along the grating, anti-aliased."""
    order = np.arange(1, HARMONICS + 1)
    signal = np.empty(position.size)
    for value in np.unique(wavelength):
        rows = wavelength == value
        amplitudes = profile_amplitudes(float(value))
        present = np.abs(velocity[rows, None]) * order / value < PASS_BAND * sample_rate_Hz
        phase = 2 * math.pi * (position[rows] + offset_mm) / value
        signal[rows] = np.real(np.exp(-1j * phase[:, None] * order) * present @ amplitudes)
    return signal


def scene(
    name: str,
    wavelength_mm: float,
    *,
    snr_dB: float = 20.0,
    seed: int = 0,
    seconds: float = 4.0,
    gauge_positions_mm=(0.0,),
    step_to_mm: float | None = None,
    step_at_s: float = 2.0,
    sample_rate_Hz: float = 1000.0,
) -> Scene:
    """A scene of `SCENES` on a grating; with `step_to_mm` the wavelength changes at `step_at_s`.

    `gauge_positions_mm` are along the sliding direction; the noise of gauges is independent. The grating starts at a
    random place. Raises `InputError` for an unknown name or values that are not positive.
    """
    if name not in SCENES:
        raise InputError(f"scene must be one of {', '.join(SCENES)}, got {name!r}")
    rate, rng = checks.positive("sample_rate_Hz", sample_rate_Hz), np.random.default_rng(seed)
    time = np.arange(round(checks.positive("seconds", seconds) * rate)) / rate
    velocity, position = _motion(name, time, rng)
    wavelength = np.full(time.size, checks.positive("wavelength (mm)", wavelength_mm))
    if step_to_mm is not None:
        wavelength[time >= step_at_s] = checks.positive("step_to_mm", step_to_mm)
    start = rng.uniform(0, 60)
    skin = sheared(position) if name == "harsh" else position
    signal = np.column_stack([_felt(skin + start, velocity, wavelength, offset, rate) for offset in gauge_positions_mm])
    if name == "harsh":
        baseline, amplitude = _disturbances(time, velocity, rng)
        signal = amplitude[:, None] * signal + baseline[:, None]
    noise_sd = 10 ** (-checks.finite("snr_dB", snr_dB) / 20)
    readings = signal + noise_sd * rng.standard_normal(signal.shape)
    return Scene(name, time, velocity, position, signal, readings, wavelength, noise_sd, rate)
