"""Gauges between the sites of the grid."""

import math

import numpy as np
import pytest

from papilla.core.errors import InputError
from papilla.design.places import Places, foil_of, half_length, moved
from papilla.model.finger import Finger, Gauge

SHAPE = Finger.default().shape
FOIL = foil_of(Finger.default().gauges)


def tensor_field(gauge: Gauge) -> float:
    """Strain along a gauge of a symmetric tensor field with the mirrors of a press at the apex."""
    a, s, turn = math.radians(gauge.angle_deg), gauge.y_mm / half_length(SHAPE), math.radians(gauge.direction_deg)
    xx, yy, xy = math.cos(3 * a) + s * s, math.cos(2 * a) - s**2, 0.3 * math.sin(2 * a) * math.sin(2 * s)
    c, s = math.cos(turn), math.sin(turn)
    return c * c * xx + s * s * yy + 2 * s * c * xy


@pytest.mark.parametrize(
    "angle, y, turn", [(11.0, 3.3, 20.0), (-37.0, 3.3, 20.0), (5.0, -9.0, 90.0), (-22.0, -14.0, -50.0)]
)
def test_a_gauge_is_a_sum_of_sites_in_every_quadrant_and_direction(angle, y, turn):
    places, gauge = Places.whole(FOIL), Gauge("g", angle_deg=angle, y_mm=y, direction_deg=turn)
    felt = np.array([tensor_field(site) for site in places.gauges(SHAPE)])
    assert felt @ places.weights([gauge], SHAPE) == pytest.approx([tensor_field(gauge)], abs=2e-4)


def test_gauges_outside_and_turned_ones_in_a_row_are_refused():
    with pytest.raises(InputError, match="outside the places"):
        Places.row(FOIL).weights([Gauge("far", angle_deg=70.0)], SHAPE)
    with pytest.raises(InputError, match="turned"):
        Places.row(FOIL).weights([Gauge("turned", angle_deg=7.0, direction_deg=30.0)], SHAPE)
    with pytest.raises(InputError, match="one length_mm"):
        foil_of([Gauge("a", angle_deg=0.0), Gauge("b", angle_deg=1.0, length_mm=1.0)])


def test_a_gauge_moves_by_millimetres():
    for angle in (0.0, 40.0):
        there = moved(Gauge("g", angle_deg=angle), SHAPE, 0.1).angle_deg
        ends = [
            np.array([SHAPE.interface[0] * math.sin(t), SHAPE.interface[2] * math.cos(t)])
            for t in np.radians([angle, there])
        ]
        assert np.linalg.norm(ends[1] - ends[0]) == pytest.approx(0.1, rel=1e-2)
