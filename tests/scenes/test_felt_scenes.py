"""Estimators on what the finite elements say a gauge feels."""

import numpy as np
import pytest

from papilla.estimators import Pipeline
from papilla.scenes.scenes import scene

pytestmark = pytest.mark.slow


def answers(made):
    pipeline = Pipeline(None, gauges=made.readings.shape[1], columns=("velocity_mm_s",))
    found = pipeline.process(np.column_stack([made.time_s, made.readings, made.known_mm_s]))
    ok = np.array([words.startswith("ok") for words in found.wavelength_status])
    return np.asarray(found.wavelength_mm), ok


@pytest.mark.slow
def test_a_felt_grating_has_its_wavelength_and_unit_power():
    made = scene("const, felt by FEM", 1.2, snr_dB=40, seed=1, seconds=1.0)
    assert made.signal.std() == pytest.approx(1.0, rel=1e-6)
    found, ok = answers(made)
    assert ok[-1]
    assert found[-1] == pytest.approx(1.2, rel=0.01)


@pytest.mark.slow
def test_single_edges_are_not_taken_for_the_ridges_that_feel_them():
    made = scene("const, edges felt by FEM", 1.2, snr_dB=40, seed=1, seconds=1.0)
    assert np.isnan(made.wavelength_mm).all()
    found, ok = answers(made)
    assert not (ok & (np.abs(found / 1.2 - 1) < 0.05)).any()
