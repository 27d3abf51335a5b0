"""What channels read at a contact: splines against scipy's, slopes as differences, and each error where it belongs."""

import math

import numpy as np
import pytest

from papilla.estimators.softness.channels import GaugeSurfaces, SdReading, distance_curve


@pytest.mark.parametrize("force, modulus", [(0.07, 0.03), (0.4, 0.2), (0.9, 3.0)])
def test_readings_and_slopes_are_the_calibrations(five, calibration, force, modulus):
    at, step = (math.log(force), math.log(modulus)), 1e-5
    for surfaces, predict in (
        (GaugeSurfaces(five(0.01), False), lambda f, e: five(0.01).predict_readings(f, e)),
        (SdReading(calibration), lambda f, e: np.atleast_1d(calibration.predict(f, e))),
    ):
        found = surfaces.at(*at, 0.0)
        assert found.reading == pytest.approx(predict(force, modulus), rel=1e-9)
        up, down = predict(force * math.exp(step), modulus), predict(force * math.exp(-step), modulus)
        assert found.along_force == pytest.approx((up - down) / (2 * step * force), rel=1e-4)
        up, down = predict(force, modulus * math.exp(step)), predict(force, modulus * math.exp(-step))
        assert found.along_modulus == pytest.approx((up - down) / (2 * step), rel=1e-3, abs=1e-3)
        assert not found.along_x.any() and len(found.along_x) == surfaces.channels


def test_errors_are_those_that_the_calibration_states(make, five):
    sd, gauges = make(fit_rms=0.02), five(0.013)
    surface, each = SdReading(sd), GaugeSurfaces(gauges, False)
    middle = math.exp(surface.ln_nodes[len(surface.ln_nodes) // 2])
    for force in (0.06, 0.8):
        stated = [gauge.uncertainty.sigma_at(force) for gauge in gauges.gauges]
        assert each.error(math.log(force)) == pytest.approx(stated) and min(stated) > 0
        relative = surface.error(math.log(force)) * force / sd.predict(force, middle)
        assert relative == pytest.approx(0.02, rel=1e-6)
    assert not surface.without_friction(-1.0, -1.0).any()
    assert surface.friction_known and each.friction_known and each.reach == surface.reach == 0.0


def test_a_distance_curve_has_its_slopes_where_they_let_it_rise():
    """Between nodes it is their mean; a slope below a thousandth of the steepest counts as that."""
    slopes = np.array([2.0, 1.5, 1.0, 0.8, 0.0])
    curve = distance_curve(slopes, -3.0, 4.0)
    assert curve.values == pytest.approx(np.cumsum([0, 3.5 / 8, 2.5 / 8, 1.8 / 8, 0.802 / 8]))
    for node, slope in zip(-3.0 + np.arange(5) / 4.0, [*slopes[:4], 0.002], strict=True):
        at, found = curve.solve(curve.values[round(4 * (node + 3))], 0, 4)
        assert (at, found) == pytest.approx((node, slope), abs=1e-4)
    steep = distance_curve(np.array([9.0, 1.0, 0.01]), 0.0, 1.0)
    inner = [steep.solve(value, 0, 2)[1] for value in np.linspace(0, steep.values[-1], 50)]
    assert min(inner) > 0
