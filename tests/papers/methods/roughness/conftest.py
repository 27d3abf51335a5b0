"""Gratings of the shared scenes, and the error of a method on them."""

import numpy as np
import pytest

from papilla.scenes.scenes import scene
from papilla_papers.claims.signals import mean_error


@pytest.fixture
def grating():
    """grating(wavelength, kind) -> (n, 2) rows of reading and velocity."""

    def rows(wavelength_mm, kind="const", seconds=3.0, rate=1000.0, **how):
        made = scene(kind, wavelength_mm, seconds=seconds, sample_rate_Hz=rate, **how)
        return np.column_stack([made.readings[:, 0], made.velocity_mm_s])

    return rows


@pytest.fixture
def rms_error():
    """rms_error(make, wavelengths, kind) -> RMS relative error of new methods."""

    def error(make, wavelengths, kind="const", snr_dB=20.0):
        scenes = [scene(kind, one, seed=seed, snr_dB=snr_dB, seconds=3.0) for one in wavelengths for seed in (0, 1)]
        return mean_error(make, scenes)

    return error
