"""Gauge functionals on the exact interface: what they must ignore, and what they must return."""

import numpy as np
import pytest

from papilla.fem.reduction.gauges import curvature_functional, gauge_frame, strain_functional
from papilla.mesh.body import surfaces_of
from papilla.model.finger import Finger, Gauge

FINGER = Finger.default()
INTERFACE = surfaces_of(FINGER)["interface"]
GAUGES = (
    *FINGER.gauges,
    Gauge("turned", angle_deg=25.0, y_mm=6.0, direction_deg=35.0),
    Gauge("across", x_mm=-4.0, y_mm=-9.0, direction_deg=90.0, length_mm=1.0, backing_mm=(3.0, 1.5)),
)
each_gauge = pytest.mark.parametrize("gauge", GAUGES, ids=lambda gauge: gauge.name)


def both(gauge):
    frame = gauge_frame(FINGER, gauge, INTERFACE)
    return strain_functional(gauge, frame, INTERFACE), curvature_functional(gauge, frame, INTERFACE), frame


def value(functional, field):
    return float((functional.weights * field(functional.points)).sum())


@each_gauge
def test_rigid_motions_are_not_read(gauge):
    strain, curvature, _ = both(gauge)
    for k in range(3):
        axis = np.eye(3)[k]
        assert value(strain, lambda x, axis=axis: np.tile(axis, (len(x), 1))) == pytest.approx(0, abs=1e-14)
        assert value(curvature, lambda x, axis=axis: np.tile(axis, (len(x), 1))) == pytest.approx(0, abs=1e-13)
        assert value(strain, lambda x, axis=axis: np.cross(axis, x)) == pytest.approx(0, abs=1e-13)
        assert value(curvature, lambda x, axis=axis: np.cross(axis, x)) == pytest.approx(0, abs=1e-12)


@each_gauge
def test_uniform_strain_is_read_along_the_grid(gauge):
    strain, _, frame = both(gauge)
    assert value(strain, lambda x: 0.01 * x) == pytest.approx(0.01, rel=1e-12)
    tensor = np.array([[0.03, 0.01, -0.02], [0.01, -0.01, 0.015], [-0.02, 0.015, 0.02]])
    ends = strain.points
    grid = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
    # Lines across a curved interface are not parallel
    assert value(strain, lambda x: x @ tensor) == pytest.approx(grid @ tensor @ grid, abs=3e-4)
    # The chord between two points of the curved interface is the grid's direction, nearly
    assert grid @ frame.along == pytest.approx(1, abs=2e-3)


@each_gauge
def test_strain_is_the_mean_over_length_and_width(gauge):
    """A strain that grows as t^2 across the grid is width^2 / 12 of it in the mean, and nothing at its middle line."""
    strain, _, frame = both(gauge)

    def field(x):
        s, t = (x - frame.site) @ frame.along, (x - frame.site) @ frame.across
        return (s * t**2)[:, None] * frame.along

    assert value(strain, field) == pytest.approx(gauge.width_mm**2 / 12, rel=2e-2)


@each_gauge
def test_a_quadratic_displacement_has_its_curvature_along_the_grid(gauge):
    _, curvature, frame = both(gauge)

    def bend(along, across, mixed):
        def field(x):
            s, t = (x - frame.site) @ frame.along, (x - frame.site) @ frame.across
            return (along * s**2 / 2 + across * t**2 / 2 + mixed * s * t)[:, None] * frame.normal

        return field

    assert value(curvature, bend(0.04, 0, 0)) == pytest.approx(0.04, rel=1e-10)
    assert value(curvature, bend(0, 0.04, 0)) == pytest.approx(0, abs=1e-12)
    assert value(curvature, bend(0, 0, 0.04)) == pytest.approx(0, abs=1e-12)
    assert value(curvature, bend(0.04, -0.3, 0.7)) == pytest.approx(0.04, rel=1e-9)
