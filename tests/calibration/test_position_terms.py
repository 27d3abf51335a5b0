"""Contact positions of a calibration: fitted to presses that were moved, and left out with a reason."""

import numpy as np

from papilla.calibration.fitting.position_terms import POSITION_CELLS, READING_CHANGE_ERROR, fit_positions

GAUGES_MM = np.array([-13.0, -7.0, 0.0, 7.0, 13.0])
PLACES = np.linspace(-4, 4, 2 * POSITION_CELLS + 1)


def seen(force, modulus, x):
    """(..., g) readings per newton: a bell over the distance from each gauge."""
    size = 5e4 * force**-0.3 * (modulus / (modulus + 0.1)) ** 0.4
    return np.asarray(size)[..., None] * np.exp(-(((np.asarray(x)[..., None] - GAUGES_MM) / 5) ** 2))


def moved(noise=0.0):
    modulus, force = (part.ravel() for part in np.meshgrid(np.geomspace(0.02, 5, 12), np.geomspace(0.05, 1, 10)))
    reading = force[:, None] * seen(force, modulus, PLACES[:, None])
    reading = reading + noise * force[:, None] * np.random.default_rng(0).normal(size=reading.shape)
    return {"force_N": force, "modulus_MPa": modulus, "place_mm": PLACES, "reading": reading}


def test_a_smooth_change_is_given_back():
    terms = fit_positions(moved())
    assert terms.reach_mm == 4.0 and terms.cells == (4, 6, POSITION_CELLS)
    rng = np.random.default_rng(1)
    force, modulus, x = np.exp(rng.uniform(np.log(0.05), 0, 200)), np.exp(rng.uniform(-3.9, 1.6, 200)), PLACES[3]
    expected = seen(force, modulus, x) - seen(force, modulus, 0.0)
    np.testing.assert_allclose(terms.change(force, modulus, x), expected, atol=0.01 * np.abs(expected).max())
    between = seen(0.3, 0.3, 1.3) - seen(0.3, 0.3, 0.0)
    np.testing.assert_allclose(terms.change(0.3, 0.3, 1.3), between, atol=0.01 * np.abs(between).max())
    assert np.abs(terms.change(force, modulus, 0.0)).max() < 1e-9 * np.abs(expected).max()


def test_its_error_is_a_share_of_the_change_and_what_the_fit_misses():
    smooth, rough = fit_positions(moved()), fit_positions(moved(noise=300.0))
    data = moved()
    change = (data["reading"][-1] - data["reading"][POSITION_CELLS]) / data["force_N"][:, None]
    np.testing.assert_allclose(smooth.error[:, -1], READING_CHANGE_ERROR * np.sqrt((change**2).mean(axis=0)), rtol=0.05)
    assert (smooth.error[:, POSITION_CELLS // 2] < 1e-6).all()
    assert (rough.error[:, 1] ** 2 > smooth.error[:, 1] ** 2 + 200.0**2).all()
