"""What a geometry takes from its neighbour, and what a design lacks: large strain."""

from dataclasses import replace

import numpy as np
import pytest

from papilla.design.geometry import GeometryMap, measure_base, with_sites
from papilla.design.look import GAUGE_ERROR, Look
from papilla.design.parameters import made
from papilla.design.places import Places
from papilla.design.scene import Scene
from papilla.errors import InputError
from papilla.fem.pressing.large_strain import CONTINUED_GAUGE, known
from papilla.finger import Finger, Layer


def test_a_finger_a_third_as_large_has_the_large_strain_of_the_default():
    default = Finger.default()
    small = made(default, {"shape.scale": 1 / 3})
    foil = {"length_mm": 0.8, "width_mm": 2 / 3, "backing_mm": (1.6, 2 / 3)}
    small = replace(small, gauges=tuple(replace(one, **foil) for one in small.gauges))
    base = with_sites(small, Places.of(small))
    assert not known(base.strain_sha256)
    assert measure_base(base, 1, pytest.fail) == ""
    found, shipped = (known(one.strain_sha256) for one in (base, default))
    assert shipped
    for one, other in zip(found, shipped, strict=True):
        assert one.force == pytest.approx(other.force / 9) and one.modulus == pytest.approx(other.modulus)
        gauges = len(default.gauges)
        strain, curvature = np.split(one.finite[:, 3:] / other.finite[:, 3:], [gauges], axis=1)
        assert strain == pytest.approx(1.0) and curvature == pytest.approx(3.0)


def test_a_hard_inner_layer_leaves_more_of_a_calibration_beyond_its_tables(made_up_geometry):
    finger = Finger.default()
    places = Places.of(finger)
    free, stuck = made_up_geometry(with_sites(finger, places), places).ends
    measured = GeometryMap(finger, places, (replace(free, large_strain=True), replace(stuck, large_strain=True)))

    def of(inner: float) -> Look:
        return Look(replace(finger, inner=Layer(inner)), measured, Scene((0.37, 0.98)))

    # The tables begin at F / E_inner = 0.9 mm2, forces of a calibration at 0.05 N, 60 of them evenly in the logarithm
    assert of(0.034).continued == 0.0
    assert of(0.08).continued ** 2 == pytest.approx(np.log(0.072 / 0.05) / np.log(20), abs=1 / 60)
    without = replace(of(0.08), geometry=GeometryMap(finger, places, (free, stuck)))
    errors = [one.surfaces.gauges[2].uncertainty.strain for one in (of(0.08), without)]
    assert errors[0] / errors[1] == pytest.approx(
        np.hypot(GAUGE_ERROR, CONTINUED_GAUGE * of(0.08).continued) / GAUGE_ERROR
    )


@pytest.mark.parametrize("inner, begins", [(0.034, "begins at 0.02 MPa"), (0.4, "begins at 0.2"), (20.0, "has no")])
def test_a_specimen_below_the_first_modulus_of_a_calibration_is_refused(made_up_geometry, inner, begins):
    finger = Finger.default()
    places = Places.of(finger)
    free, stuck = made_up_geometry(with_sites(finger, places), places).ends
    measured = GeometryMap(finger, places, (replace(free, large_strain=True), replace(stuck, large_strain=True)))
    stiff = replace(finger, inner=Layer(inner), outer=Layer(4 * inner))
    with pytest.raises(InputError, match=f"too soft for an inner layer of {inner:.3g} MPa.* a calibration {begins}"):
        _ = Look(stiff, measured, Scene(modulus_MPa=(0.019, 0.72))).ends
