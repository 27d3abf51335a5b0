"""Small parts of a calibration and an identification against numbers that were computed otherwise."""

from types import SimpleNamespace

import numpy as np
import pytest

from papilla.calibration.fitting import checking
from papilla.calibration.fitting import fit as fitting
from papilla.calibration.fitting.fit import _inside, _slope, fit_compact
from papilla.calibration.fitting.job import _between
from papilla.calibration.fitting.sweep import DEFAULT_FORCES, DEFAULT_MODULI
from papilla.calibration.readouts import ln_sd
from papilla.core import cache
from papilla.core.errors import InputError
from papilla.identification import Noise
from papilla.identification.diagnosis import _condition, influence_by_parameter
from papilla.identification.fit import _distinct
from papilla.identification.one_touch import crept, fit_indentation, fit_touch, on_finger, on_half_space
from papilla.identification.page import weighted_residuals
from papilla.logs import PressLog
from papilla.model.finger import Finger
from papilla.references import Prony
from tests.support.spring_calibration import TRUE, calibration


def test_the_slope_that_weights_the_compact_form_is_its_derivative():
    x, y, step = np.log([0.1, 0.9, 0.4]), np.log([0.05, 0.3, 0.7]), 1e-6
    expected = (ln_sd(TRUE, x, y + step) - ln_sd(TRUE, x, y - step)) / (2 * step)
    assert _slope(TRUE, x, y) == pytest.approx(expected, rel=1e-6)


def test_the_compact_form_is_fitted_from_10_to_100_gf_and_005_to_072_mpa():
    form = fit_compact(calibration())
    assert form.force_N == pytest.approx((0.0980665, 0.980665)) and form.modulus_MPa == pytest.approx((0.05, 0.72))
    assert _inside((1.0, 3.1), (2.0, 9.0), "forces")[[0, -1]] == pytest.approx([2.0, 3.1])
    with pytest.raises(InputError, match="too little of the forces"):
        _inside((1.0, 2.9), (2.0, 9.0), "forces")


@pytest.mark.parametrize("success, values", [(False, TRUE), (True, np.full(5, np.nan))])
def test_a_compact_form_that_was_not_found_is_refused(monkeypatch, success, values):
    real, calls = fitting.least_squares, []

    def failing(residuals, start):
        calls.append(start)
        if len(calls) == 1:
            return real(residuals, start)
        return SimpleNamespace(success=success, x=values, message="it wandered off")

    monkeypatch.setattr(fitting, "least_squares", failing)
    with pytest.raises(InputError, match="the compact form was not fitted: it wandered off"):
        fit_compact(calibration())


def test_published_depths_have_the_printed_numbers():
    """0.20 mm at 0.70 gf and 0.80 mm at 38.37 gf (2006), 1 mm at 0.6 N (2011)."""
    assert np.array(checking.PUBLISHED_POINTS) == pytest.approx(
        np.array([[0.20, 0.00686466], [0.80, 0.3762812], [1.0, 0.6]])
    )


def test_default_presses_are_those_of_the_documents():
    assert (DEFAULT_FORCES[0], DEFAULT_FORCES[-1], len(DEFAULT_FORCES)) == pytest.approx((0.05, 1.0, 60))
    assert (DEFAULT_MODULI[0], DEFAULT_MODULI[-1], len(DEFAULT_MODULI)) == pytest.approx((0.02, 5.0, 43))


def test_checks_lie_between_grid_values_inside_the_limits():
    assert _between([1.0, 4.0, 16.0, 64.0], (3.0, 10.0)) == pytest.approx([8.0])
    assert _between([1.0, 4.0, 16.0], (3.0, 7.0)) == pytest.approx([2.0, 8.0]), "all, where none is inside"
    assert _between([1.0, 4.0, 16.0], (2.0, 8.0)) == pytest.approx([2.0, 8.0]), "the limits are inside"
    many = _between(np.geomspace(1, 100, 60).tolist(), (0.0, 200.0))
    assert len(many) == 10 and many[0] == pytest.approx(100 ** (0.5 / 59))
    assert many[-1] == pytest.approx(100 ** (58.5 / 59))


def test_residuals_of_an_indentation_are_of_the_force():
    """Noise of 2 mN that alternates: its root mean square for 38 degrees of freedom, and the sigmas."""
    force = np.linspace(0.05, 0.6, 40)
    depth = on_half_space(5.0)(0.3, force) + 0.1
    # d = (0.75 (1 - 0.25) F / (E sqrt(R)))^(2/3), written out
    assert depth - 0.1 == pytest.approx((0.5625 * force / (0.3 * np.sqrt(5.0))) ** (2 / 3))
    noise = 2e-3 * (-1.0) ** np.arange(40)
    found = fit_indentation(force + noise, depth, on_half_space(5.0))
    assert found.rms_N == pytest.approx(2e-3 * np.sqrt(40 / 38), rel=0.02) and found.freedom == 38
    ln_modulus, offset = np.ones(40) * force, force / (2 / 3 * (depth - 0.1))
    spread = found.rms_N * np.sqrt(
        np.diag(
            np.linalg.inv(
                np.array([[ln_modulus @ ln_modulus, ln_modulus @ offset], [ln_modulus @ offset, offset @ offset]])
            )
        )
    )
    assert found.sigma_MPa == pytest.approx(0.3 * spread[0], rel=0.02)
    assert found.offset_sigma_mm == pytest.approx(spread[1], rel=0.02)
    # Student's t of 38 degrees of freedom at 97.5 % is 2.0244
    assert np.log(found.interval) == pytest.approx(
        np.log(found.modulus_MPa) + np.array([-1, 1]) * 2.0244 * found.sigma_MPa / found.modulus_MPa, rel=1e-4
    )


def test_a_table_of_indentations_reaches_its_first_and_last_force_and_modulus(made_up):
    model = on_finger(made_up)
    ends = np.array([made_up.force_N.min(), made_up.force_N.max()])
    for modulus in (made_up.modulus_MPa.min(), made_up.modulus_MPa.max()):
        assert model(modulus, ends) == pytest.approx(ends**0.7, rel=1e-3)
    assert np.isnan(model(1.001 * made_up.modulus_MPa.max(), ends)).all()
    assert np.isnan(model(0.999 * made_up.modulus_MPa.min(), ends)).all()
    assert np.isnan(model(0.3, ends * np.array([0.999, 1.001]))).all()


def test_presses_against_physics_are_known_under_the_key_under_which_they_are_kept(monkeypatch):
    keys = []
    monkeypatch.setattr(cache, "key", lambda maker, *values: repr((maker, values)))
    monkeypatch.setattr(cache, "find", lambda kind, key: keys.append((kind, key)))
    monkeypatch.setattr(
        cache, "fetch", lambda kind, key, make: keys.append((kind, key)) or {"presses": np.zeros((0, 4)), "laws": ""}
    )
    finger = Finger.default()
    assert not checking.truth_is_known(finger, 2.0, "stick")
    checking.press_truth(finger, 2.0, "stick", print)
    assert keys[0] == keys[1]
    checking.press_truth(finger, 2.5, "stick", print)
    checking.press_truth(finger, 2.0, 0.3, print)
    assert len({*keys}) == 3


def test_the_remark_on_laws_is_the_last_instability():
    assert checking.worst_law([]) == "" and checking.worst_law(["a law", "b law"]) == "b law"
    assert checking.worst_law(["unstable law 1", "unstable law 2", "a law"]) == "unstable law 2"


class TwoSprings:
    """A response: indentation and strains are powers of the force, curvature is not felt."""

    def felt(self, force, modulus, outer, inner):
        assert (modulus == 0.5).all() and (outer, inner) == (0.15, 0.04)
        values = np.zeros((len(force), 2, 2))
        values[:, 0], values[:, 1] = np.outer(force**0.8, [1.0, -1.0]), np.outer(force, [0.5, 0.0])
        return SimpleNamespace(values=values, indentation=force**0.66)


@pytest.mark.parametrize("deep", [True, False])
def test_the_longest_touch_of_a_log_is_fitted_by_the_finger_that_was_identified(deep):
    """By depth or, without it, by S_d; the loading rows say by how much the equivalent force exceeds the force."""
    prony, touch = Prony((0.3,), (2.0,)), np.concatenate([np.linspace(0.05, 1, 20), np.linspace(1.2, 25, 60)])
    time = np.concatenate([touch[:10], 2 + touch])
    modulus = np.repeat([0.4, 0.5], [10, 80])
    force = 0.5 * np.minimum(np.concatenate([touch[:10], touch]), 1.0)
    felt = TwoSprings().felt(prony.strained(touch, force[10:]), np.full(80, 0.5), 0.15, 0.04)
    gains = {"gain": np.array([2.0, 3.0]), "lever_mm": np.array([0.1, 0.2]), "zero_microstrain": np.array([7.0, -9.0])}
    readings = np.zeros((90, 2))
    readings[10:] = gains["gain"] * felt.values[:, 0] + gains["lever_mm"] * felt.values[:, 1]
    depth = np.concatenate([np.zeros(10), felt.indentation + 0.15])
    log = PressLog(
        force, modulus, readings + gains["zero_microstrain"], ("g1", "g2"), depth if deep else None, t_s=time
    )
    problem = SimpleNamespace(each=lambda name, values: gains[name], shapes=[SimpleNamespace(responses=[TwoSprings()])])
    found = fit_touch(SimpleNamespace(
        problem=problem, values={"outer_modulus_MPa": 0.15, "inner_modulus_MPa": 0.04}), log, 1)  # fmt: skip
    assert found.by == ("indentation" if deep else "S_d") and found.modulus_MPa == 0.5
    assert found.fitted.prony.shares == pytest.approx((0.3,), rel=0.05)
    assert found.fitted.prony.times_s == pytest.approx((2.0,), rel=0.1)
    assert found.crept == crept(found.fitted.prony, log) and 1.0 <= found.crept[0] < found.crept[1] < 1 / 0.7
    plain = found.to_json()
    assert plain["by"] == found.by and plain["terms"][0]["time_s"] == found.fitted.prony.times_s[0]
    assert found.recorded["relaxation_shares"] == found.fitted.prony.shares


def test_weighted_residuals_are_over_noise_model_and_error_of_force():
    modelled = SimpleNamespace(unsure=np.array([[3.0, 0.0]]), by_ln_force=np.array([[400.0, 0.8]]))
    problem = SimpleNamespace(
        noise=Noise(force=0.03, indentation_mm=0.01),
        reading_noise=4.0,
        reading_names=("S_d",),
        modelled=lambda v: modelled,
    )
    found = SimpleNamespace(problem=problem, vector=None, residuals=np.array([[26.0, 0.026]]))
    assert weighted_residuals(found) == pytest.approx(np.array([[26 / 13, 0.026 / np.hypot(0.01, 0.024)]]))


def drawn_fit():
    """A linear fit of two common parameters and a gauge's to five presses of two channels, at its optimum."""
    rng = np.random.default_rng(0)
    jacobian = np.vstack([rng.normal(size=(10, 3)), 0.5 * np.eye(3), np.zeros((1, 3))]) * np.array([1.0, 30.0, 0.2])
    off = np.concatenate([rng.normal(size=10), np.zeros(4)])
    residuals = off - jacobian @ np.linalg.lstsq(jacobian, off)[0]
    problem = SimpleNamespace(
        measured=np.zeros((5, 2)), jacobian=lambda vector: jacobian, linearised=lambda vector: (residuals, jacobian)
    )
    names = ("outer_modulus_MPa", "inner_modulus_MPa", "gain.g1")
    return jacobian, residuals, SimpleNamespace(problem=problem, names=names, vector=None)


def test_influence_is_that_of_a_fit_without_the_press():
    jacobian, residuals, found = drawn_fit()
    spread = np.sqrt(np.diag(np.linalg.inv(jacobian.T @ jacobian)))
    expected = []
    for press in range(5):
        kept = np.delete(np.arange(14), [2 * press, 2 * press + 1])
        moved = np.linalg.lstsq(jacobian[kept], residuals[kept])[0]
        expected.append(np.abs(moved / spread)[:2])
    moved = np.array(list(influence_by_parameter(found).values())).T
    assert moved == pytest.approx(np.array(expected))
    found.problem.measured = np.zeros((1, 2))
    assert influence_by_parameter(found) == {}


def test_the_condition_is_that_of_the_presses_with_columns_of_length_one():
    jacobian, _, found = drawn_fit()
    presses = jacobian[:10]
    assert _condition(found) == pytest.approx(np.linalg.cond(presses / np.linalg.norm(presses, axis=0)))


def test_fits_of_the_same_cost_are_one():
    found = [(1.0, np.zeros(1)), (1.0019, np.ones(1)), (1.0021, np.full(1, 2.0)), (9.0, np.full(1, 3.0))]
    assert [float(vector[0]) for _, vector in _distinct(found)] == [0.0, 2.0, 3.0]
