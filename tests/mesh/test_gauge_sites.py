"""Sites of gauges on a dome and a slab: by angle, by place, and moved along the interface by an arc length."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import ellipeinc

from papilla.core.errors import InputError
from papilla.mesh.body import gauge_site, surfaces_of
from papilla.model.finger import Dome, Finger, Gauge, Slab

DOME = Dome((24.0, 22.0, 20.0), (21.0, 19.0, 17.0), (10.0, 9.0, 6.0))
SLAB = Slab((24.0, 20.0), (21.0, 17.0), (10.0, 6.0), depth=30.0)


def site(shape, **options):
    gauge = Gauge("g1", **options)
    finger = replace(Finger.default(), shape=shape, gauges=(gauge,))
    return gauge_site(finger, gauge, surfaces_of(finger)["interface"])


@pytest.mark.parametrize("shape, width", [(DOME, 21.0 * np.sqrt(1 - (4 / 19) ** 2)), (SLAB, 21.0)])
def test_an_angle_is_the_parameter_of_the_section_at_the_gauges_y(shape, width):
    found = site(shape, angle_deg=25.0, y_mm=4.0)
    x = width * np.sin(np.radians(25.0))
    y_share = (4 / 19) ** 2 if shape is DOME else 0.0
    assert found == pytest.approx([x, 4.0, 17.0 * np.sqrt(1 - (x / 21.0) ** 2 - y_share)])


@pytest.mark.parametrize("axis, half, moved", [(0, 21.0, 7.0), (0, 21.0, -3.1), (1, 19.0, 6.0), (1, 19.0, 0.1)])
def test_a_moved_gauge_lies_an_arc_of_the_ellipse_further(axis, half, moved):
    found = site(DOME, x_mm=0.0, moved_mm=(moved, 0.0) if axis == 0 else (0.0, moved))
    parameter = np.arcsin(found[axis] / half)
    # The arc of an ellipse from its top, x = half sin p, z = 17 cos p
    assert half * ellipeinc(parameter, 1 - (17.0 / half) ** 2) == pytest.approx(moved, rel=2e-4)
    assert found[1 - axis] == 0.0 and found[2] == pytest.approx(17.0 * np.cos(parameter))


def test_a_gauge_that_was_moved_off_the_interface_is_refused():
    with pytest.raises(InputError, match=r"gauge g1 was moved off the interface: moved_mm \[60"):
        site(DOME, x_mm=0.0, moved_mm=(60.0, 0.0))
