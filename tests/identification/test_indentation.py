"""The modulus from force and indentation: exact series come back, offsets and intervals hold, bad ones are refused."""

import numpy as np
import pytest

from papilla.core.errors import InputError
from papilla.identification.one_touch import fit_indentation, on_bonded_layer, on_finger, on_half_space
from papilla.references import bonded_layer_sphere, hertz_sphere_at

DEPTH = np.linspace(0.05, 0.6, 40)


def hertz(modulus: float, radius: float = 5.0) -> np.ndarray:
    return np.array([hertz_sphere_at(float(one), radius, modulus / 0.75).force for one in DEPTH])


def test_an_exact_series_gives_modulus_and_offset_back():
    found = fit_indentation(hertz(0.3), DEPTH + 0.123, on_half_space(5.0))
    assert found.modulus_MPa == pytest.approx(0.3, rel=1e-6)
    assert found.offset_mm == pytest.approx(0.123, abs=1e-6)
    assert found.rms_N < 1e-8 and found.freedom == 38


def test_on_a_layer_hertz_is_far_off_and_the_layers_solution_is_not():
    force = [bonded_layer_sphere(float(one), 25.0, 10.0, 0.1).force for one in DEPTH]
    assert fit_indentation(force, DEPTH, on_half_space(25.0)).modulus_MPa > 0.13
    assert fit_indentation(force, DEPTH, on_bonded_layer(25.0, 10.0, 0.8)).modulus_MPa == pytest.approx(0.1, rel=2e-3)


def test_the_interval_holds_the_truth_as_often_as_it_says():
    rng, force, inside = np.random.default_rng(3), hertz(0.3), 0
    for _ in range(200):
        noisy = force + 0.01 * force.max() * rng.standard_normal(len(force))
        found = fit_indentation(noisy[noisy > 0], DEPTH[noisy > 0] + 0.05, on_half_space(5.0))
        inside += found.interval[0] <= 0.3 <= found.interval[1]
    assert 176 <= inside <= 199


def test_a_table_of_presses_is_a_model_and_nothing_beyond_it(made_up):
    model = on_finger(made_up)
    forces = np.geomspace(0.06, 0.9, 12)
    assert model(0.3, forces) == pytest.approx(forces**0.7, rel=1e-3)
    assert np.isnan(model(9.0, forces)).all() and np.isnan(model(0.3, np.array([0.01]))).all()
    with pytest.raises(InputError, match="leaves the range of the indentation model"):
        fit_indentation(forces * 10, forces**0.7, model)


@pytest.mark.parametrize(
    "force, depth, message",
    [
        ([0.1, 0.2, 0.3], [0.1, 0.2, 0.3], "4 points in contact"),
        ([0.0, 0.0, 0.0, 0.1, 0.2, 0.3], [0, 0, 0, 0.1, 0.2, 0.3], "4 points in contact"),
        ([0.1, 0.2, np.nan, 0.3], [0.1, 0.2, 0.3, 0.4], "finite columns"),
        ([0.1, 0.2], [0.1], "equal finite columns"),
    ],
)
def test_a_series_that_cannot_tell_is_refused(force, depth, message):
    with pytest.raises((InputError, ValueError), match=message):
        fit_indentation(force, depth, on_half_space(5.0))


def test_residuals_are_of_the_force_also_where_the_model_ends():
    """An error of depth counts by the stiffness there, taken from below at the last force that the model covers."""
    force = hertz(0.3)

    def ending(modulus, pressed):
        depth = on_half_space(5.0)(modulus, np.maximum(pressed, 1e-9))
        return np.where(pressed <= force[-1], depth, np.nan)

    off = np.zeros(len(DEPTH))
    off[-1], off[5] = 1e-4, -1e-4
    whole, cut = (fit_indentation(force, DEPTH + off, model) for model in (on_half_space(5.0), ending))
    assert cut.rms_N == pytest.approx(whole.rms_N, rel=1e-3)
    assert cut.modulus_MPa == pytest.approx(whole.modulus_MPa, rel=1e-6)


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
