"""Weights, priors and errors of a problem of presses, on a response by power laws, against formulas written out."""

from dataclasses import replace

import numpy as np
import pytest
from power_law_presses import FINGER, GAUGES, Powers, problem, with_sd

from papilla.core.errors import InputError
from papilla.identification.identified_finger import Change, Comparison, unmoved
from papilla.identification.posing import free_parameters, moved_by, specimens_of
from papilla.logs import PressLog


def test_readings_are_gain_times_strain_plus_lever_times_curvature():
    made = problem()
    felt = Powers().felt(made.log.force_N, made.log.modulus_MPa, FINGER.outer.modulus, FINGER.inner.modulus)
    gain, lever = np.array([0.3, -0.5, 0.2]), np.array([-0.1, 0.3, 0.05])
    strain, curvature = felt.values[:, 0], felt.values[:, 1]
    expected = 1e6 * (gain * strain + (lever - 0.2 * gain) * curvature) + [0.0, 7.0, 0.0]
    assert made.measured[:, :3] == pytest.approx(expected)
    assert made.measured[:, 3] == pytest.approx(felt.indentation + 0.15)
    doubled = made.modelled(made.start).values + 0 * made.measured
    twice = replace(made, held={**made.held, "common_gain": 2.0}).modelled(made.start).values
    assert twice[:, :3] - [0.0, 7.0, 0.0] == pytest.approx(2 * (doubled[:, :3] - [0.0, 7.0, 0.0]))


@pytest.mark.parametrize("presses, strained, alike", [(4, 1e9, 1.0), (6, 1e9, 1.0), (24, 1e9, 2.0), (4, 0.0, 1.0)])
def test_errors_of_the_model_are_of_the_rms_over_gauges_and_six_presses_average_them(presses, strained, alike):
    made = problem(force=np.geomspace(0.1, 0.9, presses), response=Powers(strained))
    felt = Powers().felt(made.log.force_N, made.log.modulus_MPa, FINGER.outer.modulus, FINGER.inner.modulus)
    extra = 0.02 if strained == 0 else 0.0
    assert made.strained(0.03).all() == (strained == 0) and made.strained(0.03).any() == (strained == 0)
    depth, strain, curvature = (np.sqrt((alike * one) ** 2 + 0.003**2 + extra**2) for one in (0.01, 0.008, 0.016))
    gain, lever = np.array([0.3, -0.5, 0.2]), np.array([-0.1, 0.3, 0.05])
    sizes = np.sqrt((felt.values**2).mean(axis=2))
    by_strain = strain * sizes[:, :1] * gain
    by_curvature = curvature * sizes[:, 1:] * (lever - 0.2 * gain)
    found = made.modelled(made.start).unsure
    assert found[:, :3] == pytest.approx(1e6 * np.sqrt(by_strain**2 + by_curvature**2))
    assert found[:, 3] == pytest.approx(depth * felt.indentation)
    alone = made.of(made.log.force_N, made.log.modulus_MPa).modelled(made.start).unsure
    assert (alone[:, 3] == pytest.approx(found[:, 3])) == (alike == 1.0), "candidates are judged alone"


def test_an_indentation_beside_the_apex_is_less_sure():
    made = problem()
    at = replace(made, log=replace(made.log, x_mm=np.array([0.0, 3.0, 0.0, 3.0]), y_mm=np.array([0.0, 0.0, 4.0, 4.0])))
    plain, off = made.modelled(made.start).unsure[:, 3], at.modelled(made.start).unsure[:, 3]
    depth = made.measured[:, 3] - 0.15
    assert off**2 - plain**2 == pytest.approx((3e-4 * np.array([0.0, 9.0, 16.0, 25.0]) * depth) ** 2, abs=1e-15)


@pytest.mark.parametrize("deep", [True, False])
def test_s_d_has_the_slopes_and_the_error_that_follow_from_the_readings(deep):
    made = problem(deep=deep)
    alone = with_sd(made)
    every = replace(made, free=alone.free)
    vector, step = alone.start, 1e-6
    readings, found = every.modelled(vector), alone.modelled(vector)
    assert found.values[:, 0] == pytest.approx(readings.values[:, :3].std(axis=1))
    assert found.values.shape == (4, 1 + deep) and alone.reading_names == ("S_d",)
    by_reading = np.array([
        ((readings.values[:, :3] + step * side).std(axis=1) - (readings.values[:, :3] - step * side).std(axis=1))
        / (2 * step)
        for side in np.eye(3)
    ]).T  # fmt: skip
    assert found.unsure[:, 0] == pytest.approx(
        np.sqrt(((by_reading * readings.unsure[:, :3]) ** 2).sum(axis=1)), rel=1e-5
    )
    for k in range(3):
        more, less = (alone.modelled(vector + sign * step * np.eye(3)[k]).values for sign in (1, -1))
        assert found.by_free[:, :, k] == pytest.approx((more - less) / (2 * step), rel=1e-5, abs=1e-6)
    assert alone.reading_noise == pytest.approx(5.0 / np.sqrt(3)) and every.reading_noise == 5.0


def test_weights_are_those_of_noise_model_and_a_common_error_of_the_force():
    made = problem()
    readings = made.log.readings.copy()
    readings[1, 2] = np.nan
    made = replace(made, log=replace(made.log, readings=readings))
    for vector in (made.start, None):
        weights = made.weighted(vector).weights
        modelled = made.modelled(made.start)
        known = np.nan_to_num(made.measured)
        slope = 0.67 * known if vector is None else modelled.by_ln_force
        unsure = 0.008 * np.abs(known) if vector is None else modelled.unsure
        for press in range(4):
            variance = np.array([5.0, 5.0, 5.0, 0.02]) ** 2 + unsure[press] ** 2
            if press == 1:
                variance[2] *= 1e18
            covariance = np.diag(variance) + 0.01**2 * np.outer(slope[press], slope[press])
            size = np.sqrt(np.diag(covariance))
            found = np.linalg.inv(weights[press].T @ weights[press])
            assert found / np.outer(size, size) == pytest.approx(covariance / np.outer(size, size), abs=1e-6)


def test_a_residual_of_four_standard_deviations_counts_half():
    made = problem().weighted()
    readings = made.log.readings.copy()
    readings[2, 1] += 300.0
    off = replace(made, log=replace(made.log, readings=readings))
    whitened = (made.weights @ (off.measured - off.modelled(off.start).values)[:, :, None])[:, :, 0]
    found = off.downweighted(off.start).robust
    assert found**2 == pytest.approx(1 / (1 + (whitened / 4) ** 2))
    assert found[0] == pytest.approx(1.0) and found[2].min() < 0.9
    residuals, jacobian = replace(made, robust=found, log=off.log).linearised(made.start)
    assert residuals[:16] == pytest.approx((whitened * found).ravel())
    assert jacobian[:16] == pytest.approx(made.jacobian(made.start)[:16] * found.ravel()[:, None])


def test_linear_parameters_are_solved_and_others_start_at_the_design():
    made = problem().weighted()
    assert made.residuals(made.start)[:16] == pytest.approx(0, abs=1e-9)
    outside = made.start[~made.linear]
    vector = made.solved(outside)
    residuals, jacobian = made.linearised(vector)
    assert jacobian[:, made.linear].T @ residuals == pytest.approx(0, abs=1e-6 * np.abs(jacobian).max())
    assert [name for name, linear in zip(made.free, made.linear, strict=True) if not linear] == [
        "outer_modulus_MPa", "inner_modulus_MPa",
    ]  # fmt: skip
    low, high = made.bounds
    assert (high - made.start)[:2] == pytest.approx([1.6, 1.6]) and (low - made.start)[:2] == pytest.approx(
        [-1.6, -1.6]
    )


def test_specimens_of_doubtful_modulus_are_parameters_with_a_name_each():
    log = PressLog(np.ones(5), np.array([0.2, 0.5, 0.2, 0.2, 0.9]), np.zeros((5, 3)), GAUGES)
    assert specimens_of(log) == {}
    sigma = np.array([0.02, 0.0, 0.02, 0.06, 0.27])
    found = specimens_of(replace(log, modulus_sigma_MPa=sigma, on=np.array([0, 0, 0, 1, 0])))
    assert {name: (known.sigma, known.rows.tolist()) for name, known in found.items()} == {
        "specimen_modulus.0.2": (pytest.approx(0.1), [0, 2]),
        "specimen_modulus.0.2#2": (pytest.approx(0.3), [3]),
        "specimen_modulus.0.9": (pytest.approx(0.3), [4]),
    }
    with pytest.raises(InputError, match="0.2701 of a specimen of 0.9 MPa says that it is not known at all"):
        specimens_of(replace(log, modulus_sigma_MPa=np.array([0, 0, 0, 0, 0.2701])))


def test_displacements_of_gauges_count_from_the_design():
    values = {"row_along_mm": 0.25, "row_across_mm": -0.5, "place_mm.g2": 0.125}
    assert moved_by(values, "g2") == (0.375, -0.5) and moved_by({}, "g1") == (0.0, 0.0)
    moved = replace(FINGER, gauges=tuple(replace(one, moved_mm=moved_by(values, one.name)) for one in FINGER.gauges))
    assert unmoved(moved, values) == FINGER


def test_the_free_parameters_follow_from_what_a_log_has():
    made = problem()
    every = [f"{key}.{name}" for key in ("gain", "lever_mm", "zero_microstrain") for name in GAUGES]
    moduli = ["outer_modulus_MPa", "inner_modulus_MPa"]
    assert list(free_parameters(made.log, FINGER, (), {})) == [*moduli, *every, "touch_down_mm"]
    flat = replace(made.log, indentation_mm=None)
    assert list(free_parameters(flat, FINGER, (), {"gain.g1": 1.0})) == [
        *moduli,
        *(one for one in every if one != "gain.g1"),
    ]
    alone = with_sd(made).log
    assert list(free_parameters(alone, FINGER, ("thickness_mm",), {})) == [
        *moduli, "thickness_mm", "common_gain", "common_lever_mm", "touch_down_mm",
    ]  # fmt: skip
    held = {f"{key}.{name}": 1.0 for key in ("gain", "lever_mm") for name in GAUGES}
    assert "common_gain" in free_parameters(flat, FINGER, ("common_gain",), held)
    with pytest.raises(InputError, match="touch_down_mm needs indentations"):
        free_parameters(flat, FINGER, ("touch_down_mm",), {})


@pytest.mark.parametrize("probability, rise, same, named", [(0.01, 9.0, True, False), (0.0099, 6.7, False, True),
                                                           (0.0099, 6.5, False, False)])  # fmt: skip
def test_a_finger_is_another_below_one_per_cent_and_a_change_counts_above_6_6(probability, rise, same, named):
    told = Comparison(3, 40.0, 20, probability, (Change("touch_down_mm", -0.12, 0.02, rise),))
    assert told.same == same and told.verdict.startswith("fine" if same else "recalibrate")
    assert told.verdict.endswith("the single change that explains it best: touch_down_mm -0.12 +- 0.02 mm") == named
    words = [Change(name, -0.22, 0.03, 9.0).words for name in ("inner_modulus_MPa", "zero_microstrain.g1")]
    assert words == ["inner_modulus_MPa -22 +- 3 %", "zero_microstrain.g1 -0.22 +- 0.03 µε"]
