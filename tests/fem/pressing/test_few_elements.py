"""Contacts a few elements wide: what nodes lose on a half-space, where Hertz is exact, and what is left alone."""

import numpy as np
import pytest

from papilla.fem import press
from papilla.fem.pressing.contact import contact_press
from papilla.model.specimen import HalfSpace
from papilla.references import hertz_ellipse_at

E_STAR, SOFT = 0.15, HalfSpace(0.3, 0.4)
TOGETHER = 1 / (1 / E_STAR + (1 - 0.4**2) / 0.3)


@pytest.fixture(scope="module")
def coarse(disc, stand_in):
    """A half-space finger of two radii of curvature on elements of 0.4 mm."""
    return stand_in(disc(4.0, 10, lambda x, y: x**2 / 18 + y**2 / 32), E_STAR)


@pytest.mark.parametrize("indentation", [0.04, 0.06, 0.1])
def test_a_light_press_is_hertz_where_its_nodes_are_not(coarse, indentation):
    exact = hertz_ellipse_at(indentation, 9.0, 16.0, TOGETHER)
    nodes, found = (
        make(coarse, SOFT)
        for make in (
            lambda *scene: contact_press(*scene, (exact.force, None), 0.0),
            lambda *scene: press(*scene, force=exact.force, fidelity="contact"),
        )
    )
    truth = {"indentation": indentation, "contact_area": exact.area, "peak_pressure": exact.peak_pressure}
    lost, left = ({name: abs(getattr(one, name) / true - 1) for name, true in truth.items()} for one in (nodes, found))
    assert max(lost.values()) > 5e-3
    assert max(left.values()) < 0.5 * max(lost.values())
    # The gauges of the stand-in read force and second moments
    assert found.strain[0] == pytest.approx(exact.force, rel=1e-3)
    moments = exact.force * np.array([exact.a**2, exact.b**2]) / 5
    assert np.abs(found.strain[1:] / moments - 1).max() < 0.5 * np.abs(nodes.strain[1:] / moments - 1).max() + 2e-3
