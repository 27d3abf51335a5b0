"""The modulus from force and indentation: exact series come back, offsets and intervals hold, bad ones are refused."""

import numpy as np
import pytest

from papilla.core.errors import InputError
from papilla.identification.one_touch import fit_indentation, on_bonded_layer, on_finger, on_half_space
from papilla.references import bonded_layer_sphere, hertz_sphere_at

DEPTH = np.linspace(0.05, 0.6, 40)
HERTZ = np.array([hertz_sphere_at(float(depth), 5.0, 0.3 / 0.75).force for depth in DEPTH])


def test_an_exact_series_gives_modulus_and_offset_back():
    found = fit_indentation(HERTZ, DEPTH + 0.123, on_half_space(5.0))
    assert found.modulus_MPa == pytest.approx(0.3, rel=1e-6) and found.offset_mm == pytest.approx(0.123, abs=1e-6)
    assert found.rms_N < 1e-8 and found.freedom == 38


def test_on_a_layer_hertz_is_far_off_and_the_layers_solution_is_not():
    force = [bonded_layer_sphere(float(depth), 25.0, 10.0, 0.1).force for depth in DEPTH]
    assert fit_indentation(force, DEPTH, on_half_space(25.0)).modulus_MPa > 0.13
    assert fit_indentation(force, DEPTH, on_bonded_layer(25.0, 10.0, 0.8)).modulus_MPa == pytest.approx(0.1, rel=2e-3)


def test_the_interval_holds_the_truth_as_often_as_it_says():
    rng, inside = np.random.default_rng(3), 0
    for _ in range(200):
        noisy = HERTZ + 0.01 * HERTZ.max() * rng.standard_normal(40)
        found = fit_indentation(noisy[noisy > 0], DEPTH[noisy > 0] + 0.05, on_half_space(5.0))
        inside += found.interval[0] <= 0.3 <= found.interval[1]
    assert 176 <= inside <= 199


def test_a_table_of_presses_is_a_model_to_its_ends_and_nothing_beyond_it(made_up):
    model, forces = on_finger(made_up), np.geomspace(0.06, 0.9, 12)
    ends = np.array([made_up.force_N.min(), made_up.force_N.max()])
    soft, hard = made_up.modulus_MPa.min(), made_up.modulus_MPa.max()
    for modulus, force in ((0.3, forces), (soft, ends), (hard, ends)):
        assert model(modulus, force) == pytest.approx(force**0.7, rel=1e-3)
    for modulus, force in ((0.999 * soft, ends), (1.001 * hard, ends), (0.3, ends * np.array([0.999, 1.001]))):
        assert np.isnan(model(modulus, force)).all()
    with pytest.raises(InputError, match="leaves the range of the indentation model"):
        fit_indentation(forces * 10, forces**0.7, model)


def test_a_series_that_cannot_tell_is_refused():
    for force, message in (([0, 0, 0, 0.1], "4 points in contact"), ([0.1, 0.2, np.nan, 0.3], "equal finite columns")):
        with pytest.raises(InputError, match=message):
            fit_indentation(force, [0.1, 0.2, 0.3, 0.4], on_half_space(5.0))


def test_residuals_of_an_indentation_are_of_the_force():
    """Noise of 2 mN that alternates: its root mean square for 38 degrees of freedom, and the sigmas."""
    force = np.linspace(0.05, 0.6, 40)
    depth = on_half_space(5.0)(0.3, force) + 0.1
    # d = (0.75 (1 - 0.25) F / (E sqrt(R)))^(2/3), written out
    assert depth - 0.1 == pytest.approx((0.5625 * force / (0.3 * np.sqrt(5.0))) ** (2 / 3))
    found = fit_indentation(force + 2e-3 * (-1.0) ** np.arange(40), depth, on_half_space(5.0))
    assert found.rms_N == pytest.approx(2e-3 * np.sqrt(40 / 38), rel=0.02) and found.freedom == 38
    slopes = np.column_stack([force, force / (2 / 3 * (depth - 0.1))])  # of the force, by ln E and by the offset
    sigma = found.rms_N * np.sqrt(np.diag(np.linalg.inv(slopes.T @ slopes)))
    assert [found.sigma_MPa / 0.3, found.offset_sigma_mm] == pytest.approx(sigma, rel=0.02)
    # Student's t of 38 degrees of freedom at 97.5 % is 2.0244
    half = 2.0244 * found.sigma_MPa / found.modulus_MPa
    assert np.log(found.interval) == pytest.approx(np.log(found.modulus_MPa) + np.array([-half, half]), rel=1e-4)
