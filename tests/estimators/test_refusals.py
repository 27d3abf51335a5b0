"""Options that cannot be used: each is refused by one line with its name, and what lies on the limit is taken."""

import math
from dataclasses import replace

import numpy as np
import pytest

from papilla.core.errors import InputError, MissingExtraError
from papilla.estimators import (
    ChirpTracker,
    Doubts,
    Friction,
    FusedTracker,
    GaugeSoftness,
    Pipeline,
    Softness,
    SpaceTracker,
)
from papilla.estimators.methods import SURFACES_METHOD, depth_method, sample_method, softness_names

NOISE = {"gauge_sigma": 20, "force_sigma_N": 0.002}
MAKERS = {
    "chirp": lambda _, **options: ChirpTracker(**options), "space": lambda _, **options: SpaceTracker(**options),
    "fused": lambda _, **options: FusedTracker(**options), "friction": lambda _, **options: Friction(**options),
    "doubts": lambda _, **options: Doubts(**options), "pipeline": lambda _, **options: Pipeline(**options),
    "s_d": lambda calibration, **options: Softness(calibration, **(NOISE | options)),
    "gauges": lambda calibration, **options: GaugeSoftness(calibration, **(NOISE | options)),
}  # fmt: skip
ABOVE_ZERO = {
    "friction": dict.fromkeys(("sample_rate_Hz", "rest_mm_s", "contact_N", "memory_mm", "offset_sigma_N"), (0,)),
    "space": {"saturation": (0.0, -1.0, math.nan), "resonances_Hz": ((0.0,), (-5.0,))},
    "s_d": {"gauge_sigma": (0, -1.0, math.nan), "force_sigma_N": (-1.0,), "contact_force_N": (0, -1),
            "saturation": (0, -5), "stuck_samples": (1,), "memory_s": (0, -1, math.nan)},
    "gauges": {"gauge_sigma": (0, -1.0, math.nan), "force_sigma_N": (-1.0,), "contact_force_N": (0, -1),
               "saturation": (0, -5), "stuck_samples": (1,), "position_sigma_mm": (0, -1, math.nan)},
    "doubts": dict.fromkeys(("gauge_gain", "creep", "zero_microstrain", "force_gain", "beside_mm"), (-0.1, math.inf))
              | {"thickness_mm": (0,)},
    "chirp": {"sample_rate_Hz": (0,), "saturation": (-1,)}, "pipeline": {"sample_rate_Hz": (0,), "saturation": (-1,)},
}  # fmt: skip


@pytest.mark.parametrize("maker", ABOVE_ZERO)
def test_a_number_that_must_be_above_a_limit_is_refused_by_its_name(five_gauges, maker):
    for name, values in ABOVE_ZERO[maker].items():
        for value in values:
            with pytest.raises(InputError, match=f"^{name}"):
                MAKERS[maker](five_gauges, **{name: value})


@pytest.mark.parametrize(
    "maker, options, message",
    [
        ("chirp", {"frequency_range_Hz": (100, 50)}, "must rise, got 100 and 50"),
        ("chirp", {"frequency_range_Hz": (100, 150)}, "must span a factor 2 to 100 below 0.4 of the sampling rate"),
        ("chirp", {"frequency_range_Hz": (15, 450)}, "got 15 to 450 Hz"),
        ("chirp", {"frequency_range_Hz": 15}, "must be two numbers"),
        ("chirp", {"lag_s": 0.2}, "lag_s must lie between 0 and 0.03"),
        ("fused", {"gauge_positions_mm": ()}, "different places"),
        ("fused", {"gauge_positions_mm": (1.0, 1.0)}, "different places"),
        ("fused", {"gauge_positions_mm": 0}, "different places"),
        ("pipeline", {"gauges": 0}, "gauges must be at least 1, got 0"),
        ("pipeline", {"gauges": ("g1", "g2", "g1")}, "the names of gauges must differ, got g1, g2, g1"),
        ("pipeline", {"columns": ("speed",)}, "columns must be among force_N, .* got speed"),
        ("pipeline", {"columns": ("force_N", "force_N")}, "columns must differ"),
        ("pipeline", {"wavelength_range_mm": (6, 0.4)}, "wavelength_range_mm must rise, got 6 and 0.4"),
        ("pipeline", {"wavelength_range_mm": (math.nan, 4)}, "must be finite"),
        ("pipeline", {"gauges": 4, "gauge_positions_mm": (0.0, 1.0)}, "gauge_positions_mm must be 4 places"),
        ("pipeline", {"position_sigma_mm": 0}, "position_sigma_mm must be greater than 0, or None, got 0"),
        ("pipeline", {"ridge_pitch_mm": -1}, "ridge_pitch_mm must lie between 0 and 100"),
    ],
)  # fmt: skip
def test_what_cannot_be_used_is_one_line(five_gauges, maker, options, message):
    with pytest.raises(InputError, match=message):
        MAKERS[maker](five_gauges, **options)


def test_methods_are_those_of_papilla_and_of_installed_packages(five_gauges):
    assert {*SURFACES_METHOD, "printed"} <= set(softness_names())
    assert sample_method("printed", five_gauges, **NOISE).note
    with pytest.raises(InputError, match="softness must be one of gauges, surface, sd, .*, got 'none'"):
        sample_method("none", five_gauges)
    force, modulus = (axis.ravel() for axis in np.meshgrid(np.linspace(0.1, 0.7, 8), np.geomspace(0.05, 0.7, 8)))
    depth = (force / modulus) ** (2 / 3)
    by_depth = depth_method("force-depth", force, modulus, depth)
    found, _, _ = by_depth.process(force, depth, by_depth.errors_of(1e-4, 1e-4))
    assert np.nanmedian(np.abs(found / modulus - 1)) < 0.1
    with pytest.raises(MissingExtraError, match="no installed package brings the method 'none'"):
        depth_method("none", force, modulus, depth)


def test_a_calibration_that_does_not_fit_is_refused(five_gauges):
    with pytest.raises(InputError, match="the calibration is of 5 gauges, the pipeline of 3"):
        Pipeline(five_gauges, gauges=3)
    with pytest.raises(InputError, match="calibration's finger.ridge_pitch_mm"):
        Pipeline(replace(five_gauges, finger={"ridge_pitch_mm": -1}))
    with pytest.raises(InputError, match="the state is of a pipeline for wavelength, this one is for frequency"):
        Pipeline(columns=()).state = Pipeline(columns=("velocity_mm_s",)).state


@pytest.mark.parametrize(
    "option, usable, refused",
    [
        ("wavelength_range_mm", [(1, 1.5), (0.1, 10)], [(1, 1.49), (0.1, 10.1), (6, 1)]),
        ("latency_s", [-0.1, 0.1, None], [-0.11, 0.11]), ("scale_sigma", [0, 0.2], [-0.01, 0.21]),
        ("ridge_pitch_mm", [0, 100, None], [-0.1, 101]),
    ],
)  # fmt: skip
def test_options_of_a_tracker_are_taken_up_to_their_limits(option, usable, refused):
    for value in usable:
        assert SpaceTracker(**{option: value})
    for value in refused:
        with pytest.raises(InputError, match=option):
            SpaceTracker(**{option: value})
