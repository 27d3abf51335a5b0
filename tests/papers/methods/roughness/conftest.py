"""Synthetic gratings for the published estimators: groove = ridge, trapezoidal profile through a soft skin."""

import numpy as np
import pytest

HARMONICS, SKIN_MM, ANTI_ALIAS_HZ = 9, 0.1, 400.0


def profile() -> np.ndarray:
    """Complex amplitudes of harmonics 1 to 9 of a groove with an entry ramp of 0.08 and an exit ramp of 0.15."""
    height = np.interp(np.arange(4096) / 4096, [0, 0.08, 0.5, 0.65, 1.0], [1, -1, -1, 1, 1])
    return 2 * np.fft.rfft(height - height.mean())[1 : HARMONICS + 1] / 4096


def stroke(kind: str, seconds: float, rate: float, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Velocity and position of one touch: `const`, `act1` (100 sin 2 pi t mm/s) or `act2` (197 sin 2 pi 1.07 t)."""
    time = np.arange(round(seconds * rate)) / rate
    if kind == "const":
        speed = 100 * (1 + 0.03 * np.random.default_rng(seed).uniform(-1, 1))
        return np.full_like(time, speed), speed * time
    peak, omega = {"act1": (100.0, 2 * np.pi), "act2": (197.0, 2 * np.pi * 1.07)}[kind]
    return peak * np.sin(omega * time), peak / omega * (1 - np.cos(omega * time))


def of_grating(wavelength: float, kind="const", snr_dB=20.0, seed=0, seconds=3.0, rate=1000.0) -> np.ndarray:
    """(n, 2) rows of reading (AC power 1 plus white noise) and velocity."""
    velocity, position = stroke(kind, seconds, rate, seed)
    generator = np.random.default_rng(1000 + seed)
    position = position + generator.uniform(0, wavelength)
    orders = np.arange(1, HARMONICS + 1)
    amplitude = profile() * np.exp(-0.5 * (2 * np.pi * orders / wavelength * SKIN_MM) ** 2)
    passed = np.clip((ANTI_ALIAS_HZ - np.outer(np.abs(velocity), orders) / wavelength) / 50 + 0.5, 0, 1)
    waves = np.real(amplitude * np.exp(2j * np.pi * np.outer(position, orders) / wavelength))
    reading = (passed * waves).sum(axis=1) / np.sqrt(0.5 * (np.abs(amplitude) ** 2).sum())
    return np.column_stack([reading + generator.normal(0, 10 ** (-snr_dB / 20), velocity.size), velocity])


def rms_of(make, wavelengths, kind="const", snr_dB=20.0, seeds=(0, 1)) -> float:
    """RMS of wavelength / truth - 1, clipped to -1 ... 3, after 1 s and above 0.3 of the peak speed."""
    squares = []
    for wavelength in wavelengths:
        errors = []
        for seed in seeds:
            rows = of_grating(wavelength, kind, snr_dB, seed)
            counted = (np.arange(len(rows)) > 1000) & (np.abs(rows[:, 1]) > 0.3 * np.abs(rows[:, 1]).max())
            errors.append(np.clip(make().process(rows).wavelength_mm[counted] / wavelength - 1, -1, 3))
        squares.append(np.nanmean(np.concatenate(errors) ** 2))
    return float(np.sqrt(np.mean(squares)))


@pytest.fixture
def grating():
    return of_grating


@pytest.fixture
def rms_error():
    return rms_of
