"""What a geometry takes from its neighbour, and what a design lacks: large strain."""

from dataclasses import replace

import numpy as np
import pytest

from papilla.core.errors import InputError
from papilla.design.geometry import GeometryMap, measure_base, with_sites
from papilla.design.in_scene import DesignInScene
from papilla.design.parameters import made
from papilla.design.places import Places
from papilla.design.scene import DesignScene
from papilla.fem.pressing.large_strain import known
from papilla.model.finger import Finger, Layer


def test_a_finger_a_third_as_large_has_the_large_strain_of_the_default(tmp_path, monkeypatch):
    monkeypatch.setenv("PAPILLA_CACHE", str(tmp_path))
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


@pytest.mark.parametrize("inner, begins", [(0.034, "begins at 0.02 MPa"), (0.4, "begins at 0.2"), (20.0, "has no")])
def test_a_specimen_below_the_first_modulus_of_a_calibration_is_refused(made_up_geometry, inner, begins):
    finger = Finger.default()
    places = Places.of(finger)
    free, stuck = made_up_geometry(with_sites(finger, places), places).ends
    measured = GeometryMap(finger, places, (replace(free, large_strain=True), replace(stuck, large_strain=True)))
    stiff = replace(finger, inner=Layer(inner), outer=Layer(4 * inner))
    with pytest.raises(InputError, match=f"too soft for an inner layer of {inner:.3g} MPa.* a calibration {begins}"):
        _ = DesignInScene(stiff, measured, DesignScene(modulus_MPa=(0.019, 0.72))).ends
