"""The velocity-blind tracker where it once failed: fine textures in noise, harmonics left out, what is held."""

import numpy as np
import pytest

from papilla.estimators.tracking.blind import ChirpStatus, ChirpTracker
from papilla.studies.estimator_bench.scenes import scene


def wavelength_error(kind, wavelength, snr, seed):
    """RMS relative error of the wavelength, and the share of judged rows that are called OK."""
    made = scene(kind, wavelength, snr_dB=snr, seed=seed, seconds=4.0)
    found, rows = ChirpTracker(compiled=False).process(made.block()), made.judged()
    error = found.wavelength_mm[rows] / wavelength - 1
    return np.sqrt(np.mean(error**2)), np.mean(found.status[rows] == ChirpStatus.OK)


@pytest.mark.parametrize("seed", [603, 631])
def test_a_fine_texture_in_noise_is_found(seed):
    # A fit that expects a hand's motion loses the phase at 330 Hz and 0 dB: every other look expects a calm one.
    error, answered = wavelength_error("act2", 0.6, 0.0, seed)
    assert error < 0.01
    assert answered > 0.95


@pytest.mark.parametrize("seed", [716, 730])
def test_harmonics_left_out_do_not_pass_for_motion(seed):
    error, answered = wavelength_error("act1", 3.0, 40.0, seed)
    assert error < 0.01
    assert answered > 0.95


def test_what_is_told_near_a_reversal_is_not_held_for_what_was_known():
    errors = [wavelength_error("harsh", 1.8, 20.0, seed)[0] for seed in (601, 602, 603, 604, 606)]
    assert np.median(errors) < 0.1
