"""Synthetic gratings for the published estimators: groove = ridge, trapezoidal profile through a soft skin."""

import numpy as np
import pytest

HARMONICS, SKIN_MM, ANTI_ALIAS_HZ = 9, 0.1, 400.0


def _profile() -> np.ndarray:
    """Complex amplitudes of harmonics 1 to 9 of a groove with an entry ramp of 0.08 and an exit ramp of 0.15."""
    place = np.arange(4096) / 4096
    height = np.interp(place, [0, 0.08, 0.5, 0.65, 1.0], [1, -1, -1, 1, 1])
    return 2 * np.fft.rfft(height - height.mean())[1 : HARMONICS + 1] / 4096


def touch(kind: str, seconds: float, rate: float, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Velocity and position of one touch: `const`, `act1` (100 sin 2 pi t mm/s) or `act2` (197 sin 2 pi 1.07 t)."""
    time = np.arange(round(seconds * rate)) / rate
    if kind == "const":
        speed = 100 * (1 + 0.03 * np.random.default_rng(seed).uniform(-1, 1))
        return np.full_like(time, speed), speed * time
    peak, turns = {"act1": (100.0, 1.0), "act2": (197.0, 1.07)}[kind]
    omega = 2 * np.pi * turns
    return peak * np.sin(omega * time), peak / omega * (1 - np.cos(omega * time))


def grating(wavelength: float, kind="const", snr_dB=20.0, seed=0, seconds=3.0, rate=1000.0) -> np.ndarray:
    """(n, 2) rows of reading (AC power 1 plus white noise) and velocity."""
    velocity, position = touch(kind, seconds, rate, seed)
    generator = np.random.default_rng(1000 + seed)
    position = position + generator.uniform(0, wavelength)
    reading, power = np.zeros_like(velocity), 0.0
    for order, amplitude in enumerate(_profile(), start=1):
        wavenumber = 2 * np.pi * order / wavelength
        amplitude = amplitude * np.exp(-0.5 * (wavenumber * SKIN_MM) ** 2)
        power += 0.5 * abs(amplitude) ** 2
        passed = np.clip((ANTI_ALIAS_HZ - order * np.abs(velocity) / wavelength) / 50 + 0.5, 0, 1)
        reading += passed * np.real(amplitude * np.exp(1j * wavenumber * position))
    reading = reading / np.sqrt(power) + generator.normal(0, 10 ** (-snr_dB / 20), velocity.size)
    return np.column_stack([reading, velocity])


def rms_error(make, wavelengths, kind="const", snr_dB=20.0, seeds=(0, 1)) -> float:
    """RMS of wavelength / truth - 1, clipped to -1 ... 3, after 1 s and above 0.3 of the peak speed."""
    squares = []
    for wavelength in wavelengths:
        errors = []
        for seed in seeds:
            rows = grating(wavelength, kind, snr_dB, seed)
            answer = make().process(rows)
            speed = np.abs(rows[:, 1])
            counted = (np.arange(len(rows)) > 1000) & (speed > 0.3 * speed.max())
            errors.append(np.clip(answer.wavelength_mm[counted] / wavelength - 1, -1, 3))
        squares.append(np.nanmean(np.concatenate(errors) ** 2))
    return float(np.sqrt(np.mean(squares)))


@pytest.fixture(name="grating")
def _grating():
    return grating


@pytest.fixture(name="rms_error")
def _rms_error():
    return rms_error
