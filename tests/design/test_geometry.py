"""What a geometry takes from its neighbour: large strain, measured at one size."""

from dataclasses import replace

import numpy as np
import pytest

from papilla.design.geometry import measure_base, with_sites
from papilla.design.parameters import made
from papilla.design.places import Places
from papilla.fem.pressing.large_strain import known
from papilla.finger import Finger


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
