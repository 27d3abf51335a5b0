"""Fits, doubts, profiles and suggestions on a response by power laws: both edges of each limit, and formulas written
out."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from power_law_presses import FINGER, Powers, problem

from papilla.identification import Diagnosis, Noise, diagnosis, fit, record
from papilla.identification.fit import Identification, solve

QUIET = Noise(readings_microstrain=0.01, force=1e-5, indentation_mm=1e-5, model=1e-5, depth=1e-5)


@pytest.fixture(scope="module")
def found():
    """A finger identified from eight presses with hardly any noise."""
    made = problem(force=np.geomspace(0.1, 0.9, 8), response=Powers(error=1e-5))
    noise = 0.01 * np.random.default_rng(0).normal(size=(8, 3))
    return solve(replace(made, noise=QUIET, log=replace(made.log, readings=made.log.readings + noise)))


def varied(found, sigma=None, correlation=0.0, **changes):
    """The identification with other standard deviations by name, and a correlation of both moduli."""
    size = np.full(len(found.names), 1e-4)
    for name, value in (sigma or {}).items():
        size[found.names.index(name)] = value
    together = np.eye(len(size))
    together[0, 1] = together[1, 0] = correlation
    return replace(found, covariance=together * np.outer(size, size), **changes)


def said(doubts, part):
    return any(part in one for one in doubts)


def test_a_fit_returns_the_finger_its_covariance_and_its_chi_square(found):
    truth = {"outer_modulus_MPa": FINGER.outer.modulus, "gain.g2": -0.5, "lever_mm.g3": 0.05, "touch_down_mm": 0.15}
    for name, value in truth.items():
        assert found[name][0] == pytest.approx(value, rel=0.02), name
    jacobian, residuals = found.problem.jacobian(found.vector), found.problem.residuals(found.vector)
    inner = np.linalg.inv(jacobian[:-1].T @ jacobian[:-1])
    assert found.covariance == pytest.approx(inner, rel=1e-4) and found.chi_square < 1.5 * found.freedom
    priors = len(found.names) + 1
    assert found.chi_square == pytest.approx((residuals[:-priors] ** 2).sum())
    used = np.trace(inner @ (jacobian[:-priors].T @ jacobian[:-priors]))
    assert found.freedom == pytest.approx(32 - used) and 8 < used < len(found.names)
    shown = found.finger
    assert shown.gauges[1].membrane_gain == found.values["gain.g2"]
    lever = found.values["lever_mm.g2"] - 0.2 * found.values["gain.g2"]
    assert shown.gauges[1].lever_mm == pytest.approx(lever)
    assert found.residuals == pytest.approx(found.problem.measured - found.problem.modelled(found.vector).values)
    assert found.at(np.array([0.2]), np.array([0.5])).shape == (1, 4)


def test_fits_start_at_the_design_and_one_prior_sigma_to_both_sides():
    made = problem(free=("outer_modulus_MPa", "inner_modulus_MPa", "common_gain", "gain.g1"))
    middle = made.start[:3]
    starts = np.array(fit.starts_of(made)) - middle
    assert starts == pytest.approx(0.7 * np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]]))


@pytest.mark.parametrize("share, named", [(0.9e-3, True), (1.1e-3, False)])
@pytest.mark.parametrize("end", [0, 1])
def test_a_parameter_is_at_its_bound_within_a_thousandth_of_the_range(found, share, named, end):
    made, vector = found.problem, found.problem.start.copy()
    low, high = made.bounds
    assert diagnosis.at_bounds(made, vector) == []
    vector[0] = (low[0] + share * (high - low)[0]) if end == 0 else high[0] - share * (high - low)[0]
    vector[1] = vector[0] - 1.0
    assert ("outer_modulus_MPa" in diagnosis.at_bounds(made, vector)) == named
    vector[1] = vector[0] + 0.1
    assert diagnosis.RATIO in diagnosis.at_bounds(made, vector)


def test_a_record_has_what_gauges_share_as_each_gauges_own(found):
    made = replace(found.problem, free=("outer_modulus_MPa", "common_gain", "common_lever_mm"))
    vector = np.array([np.log(0.2), np.log(1.5), -0.3])
    covariance = np.array([[4.0, 1.0, 0.5], [1.0, 9.0, -1.0], [0.5, -1.0, 2.0]]) * 1e-4
    one = Identification(made, vector, covariance, 12.0, 9.0)
    kept = record(one, Diagnosis("ok", (), {"outer_modulus_MPa": (0.1, 0.4)}, (), np.zeros(8), 1.0), "a block")
    gain, lever = 1.5 * -0.5, 1.5 * 0.3 + 1.5 * -0.5 * -0.3
    values, places = dict(zip(kept.parameters, kept.values, strict=True)), kept.parameters.index
    assert len(kept.parameters) == 7 and values["gain.g2"] == pytest.approx(gain)
    assert values["lever_mm.g2"] == pytest.approx(lever) and values["outer_modulus_MPa"] == pytest.approx(0.2)
    assert kept.logarithmic[0] and not any(kept.logarithmic[1:])
    # gain and lever have these derivatives by (ln outer modulus, ln common gain, common lever)
    slopes = np.array([[1.0, 0, 0], [0, gain, 0], [0, lever, gain]])
    rows = [0, places("gain.g2"), places("lever_mm.g2")]
    found_covariance = np.array(kept.covariance)[np.ix_(rows, rows)]
    assert found_covariance == pytest.approx(slopes @ covariance @ slopes.T)
    half = 1.959964 * np.sqrt(found_covariance[2, 2])
    assert (kept.lower[rows[2]], kept.upper[rows[2]]) == pytest.approx((lever - half, lever + half))
    assert (kept.lower[0], kept.upper[0], kept.presses, kept.specimen) == (0.1, 0.4, 8, "a block")
    assert kept.zeros_microstrain == pytest.approx((0.0, 7.0, 0.0)) and kept.touch_down_mm == 0.15
    assert kept.friction == "stick" and one.with_record(kept).bench.friction == "stick"


@dataclass(frozen=True)
class Linear:
    """A linear problem of which `free` are the first columns."""

    columns: np.ndarray
    off: np.ndarray
    free: tuple[str, ...]

    def linearised(self, vector):
        jacobian = self.columns[:, : len(self.free)]
        return jacobian @ vector - self.off, jacobian
