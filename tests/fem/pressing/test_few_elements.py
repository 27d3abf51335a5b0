"""Contacts a few elements wide: what nodes lose on a half-space, where Hertz is exact, and what is left alone."""

from dataclasses import replace

import numpy as np
import pytest

from papilla.fem import press
from papilla.fem.pressing.contact import contact_press, with_ellipse
from papilla.model.specimen import Block, HalfSpace
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


@pytest.mark.parametrize("friction", [0, "stick"])
def test_an_indentation_is_that_of_the_press(reference, friction):
    by_force = press(reference, Block(0.51, 10), force=0.05, fidelity="contact", friction=friction)
    scene = {"indentation": by_force.indentation, "fidelity": "contact", "friction": friction}
    found = press(reference, Block(0.51, 10), **scene)
    assert found.indentation == pytest.approx(by_force.indentation, rel=1e-6)
    assert found.force == pytest.approx(by_force.force, rel=1e-5)
    assert found.sd == pytest.approx(by_force.sd, rel=1e-5)


def test_what_friction_changes_is_the_nodes(reference):
    scene = reference, Block(0.51, 10)
    free, stuck = (contact_press(*scene, (0.03, None), friction) for friction in (0.0, np.inf))
    told = [with_ellipse(*scene, one) for one in (free, stuck)]
    assert told[1].values - told[0].values == pytest.approx(stuck.values - free.values, rel=1e-2)
    assert told[1].indentation / told[0].indentation == pytest.approx(stuck.indentation / free.indentation, rel=1e-4)
    assert told[0].indentation != free.indentation


def test_a_wide_press_and_one_that_is_no_ellipse_stay(reference):
    wide = contact_press(reference, Block(0.51, 10), (0.9, None), 0.0)
    assert with_ellipse(reference, Block(0.51, 10), wide) is wide
    light = contact_press(reference, Block(0.51, 10), (0.03, None), 0.0)
    other = replace(light, contact_area=1.2 * light.contact_area)
    assert with_ellipse(reference, Block(0.51, 10), other) is other


def test_it_comes_and_goes_without_a_step(reference):
    """S_d over force is as smooth as its nodes alone are, where the ellipse's weight falls from 1 to 0."""
    forces = np.geomspace(0.02, 0.6, 60)
    specimen = Block(0.51, 10)
    told, nodes = (
        np.log([make(float(force)).sd for force in forces])
        for make in (
            lambda force: press(reference, specimen, force=force, fidelity="contact"),
            lambda force: contact_press(reference, specimen, (force, None), 0.0),
        )
    )
    roughness = [np.abs(np.diff(curve, 3)).max() for curve in (told, nodes)]
    assert roughness[0] < 1.1 * roughness[1]
    assert np.abs(told - nodes).max() > 1e-3
