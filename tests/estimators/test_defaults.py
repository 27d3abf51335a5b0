"""What a caller gets who says nothing: one default for an option of one name; a change of one moves numbers."""

import inspect
import math

import numpy as np
import pytest

from papilla import estimators
from papilla.core.errors import InputError
from papilla.estimators.texture import Features
from papilla_papers import methods
from papilla_papers.methods import texture, wavelet

COMMON = {
    "sample_rate_Hz": 1000.0, "wavelength_range_mm": (0.4, 6.0), "scale_sigma": 0.015, "latency_s": None,
    "resonances_Hz": (), "ridge_pitch_mm": None, "saturation": math.inf, "stuck_samples": 50, "doubts": None,
    "contact_force_N": 0.02, "position_sigma_mm": None, "variant": "as_printed", "window_s": None, "hop_s": None,
    "calibration": None, "gauges": None, "softness": "gauges", "gauge_positions_mm": None,
}  # fmt: skip
OWN = {
    "ChirpTracker": {"frequency_range_Hz": None, "lag_s": 0.014, "saturation": 1e12},
    "CrossRidge": {"low_Hz": 10.0, "high_Hz": 100.0, "per_octave": 12},
    "Doubts": {"gauge_gain": 0.03, "creep": 0.02, "zero_microstrain": 200.0, "force_gain": 0.02, "beside_mm": 1.0,
               "force_offset_N": 0.006, "thickness_mm": None, "thickness_error": 0.05},
    "Friction": {"rest_mm_s": None, "contact_N": 0.02, "memory_mm": None, "offset_sigma_N": 0.2},
    "FusedTracker": {"saturation": 1e12},
    "Pipeline": {"gauges": 5, "columns": ("force_N", "velocity_mm_s", "tangential_N"), "gauge_sigma": 1.0,
                 "force_sigma_N": 1e-3, "saturation": 1e12, "position_sigma_mm": 1.0, "friction_memory_mm": None},
    "PrintedSoftness": {"form": "printed", "gauge_sigma": 0.0, "force_sigma_N": 0.0, "scale": None},
    "Softness": {"memory_s": math.inf},
    "ZeroCrossing": {"high_pass_Hz": 10.0},
    "find_lines": {"wavelength_range_mm": None, "false_alarm": 0.01},
}  # fmt: skip
FIGURES = {
    Features: {"window_mm": 100.0, "shortest_mm": 1.0, "longest_mm": 50.0, "bands": 8},
    texture.leave_m_out: {"splits": 1000, "neighbours": 1},
    texture.concordance: {"level": 0.95},
    texture.grubbs_critical: {"level": 0.05},
    texture.grubbs_outliers: {"level": 0.05},
    wavelet.octaves: {"per_octave": 100},
    wavelet.cross_quantile: {"level": 0.05},
    wavelet.cross_threshold: {"level": 0.05},
}


METHODS = [name for name in methods.__all__ if name != "ForceDepth"]


def of_name(name):
    """An estimator of papilla or of the papers."""
    return getattr(methods if name in METHODS else estimators, name)


def defaults(of):
    return {name: one.default for name, one in inspect.signature(of).parameters.items() if one.default is not one.empty}


@pytest.mark.parametrize(
    "name",
    [
        name
        for name in (*estimators.__all__, *METHODS)
        if not name.endswith(("Estimate", "State")) and name != "background"
    ],
)
def test_an_option_has_the_default_of_its_name(name):
    found = defaults(of_name(name))
    assert found == {option: (COMMON | OWN.get(name, {}))[option] for option in found}
    assert set(OWN.get(name, {})) <= set(found)


LOG = np.arange(40) * 0.1, np.sin(np.arange(40.0))
NEEDED = {
    "FusedTracker": {"gauge_positions_mm": 2}, "LineTracker": {"channels": 2},
    "PrintedSoftness": {"scale": 1.0, "gauges": 3},
    "find_lines": {"position_mm": LOG[0], "readings": LOG[1]},
}  # fmt: skip


@pytest.mark.parametrize("name", [name for name in OWN if name not in ("Softness",)])
def test_the_defaults_are_usable(name):
    assert of_name(name)(**NEEDED.get(name, {})) is not None


def test_the_defaults_of_softness_are_usable(calibration, five_gauges):
    for make, of in ((estimators.Softness, calibration), (estimators.GaugeSoftness, five_gauges)):
        own = make(of, gauge_sigma=1.0, force_sigma_N=1e-3)
        assert own.update((1.0,) * 5 + (0.019,)).sentence == own.update((1.0,) * 5 + (0.0,)).sentence == "no contact"
    assert Features().bands == 8 and len(wavelet.octaves(10.0, 20.0)) == 101 and wavelet.cross_quantile() > 3.9
    assert texture.grubbs_critical(10) == pytest.approx(texture.grubbs_critical(10, 0.05))
    assert texture.concordance(LOG[0], LOG[1]).high < 1
    with pytest.raises(InputError, match="at least two different labels"):
        texture.leave_m_out([[1.0]], ["a"], 1, seed=0)


@pytest.mark.parametrize("of", FIGURES, ids=lambda of: of.__name__)
def test_the_papers_figures_and_the_models_are_the_defaults(of):
    assert defaults(of) == FIGURES[of]
