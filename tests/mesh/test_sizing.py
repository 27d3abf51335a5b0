"""The wanted element size, the memory that it takes, and the triangulations that the mesher is given."""

import re

import numpy as np
import pytest

from papilla.core.errors import InputError, MemoryEstimateError
from papilla.mesh import build
from papilla.mesh.body import body_of
from papilla.mesh.drawing import triangulations
from papilla.mesh.sizing import Sizing, asked
from papilla.model.finger import Finger, Slab

APEX = np.array([0.0, 0.0, 20.0])


def test_size_grows_with_the_distance_from_the_apex():
    """size_mm up to 0.37 patch radii, then 5.4 sizes more a radius, 1.4 times as fast downwards, up to 5 sizes; 0.6 of
    it in the middle, and 1.6 at a gauge."""
    sizing = Sizing(APEX, 0.7, 15.0)
    away = np.array([[5.5, 0, 0], [0, 10, 0], [0, 0, -10], [3, 4, -5], [60, 0, 0]])
    distance = np.array([5.5, 10, 14, np.sqrt(25 + 49), 60]) / 15
    expected = 0.7 * np.minimum(5.0, np.maximum(1.0, 1 + 5.4 * (distance - 0.37)))
    assert sizing(APEX + away) == pytest.approx(expected, rel=1e-12)
    middle = APEX + np.array([[0, 0, 0], [1.9, 0, 0], [0, 1.5 * 0.13 * 15, 0]])
    assert sizing(middle) == pytest.approx([0.42, 0.42, 0.56])
    assert sizing(APEX + away)[-1] == sizing.far_mm == 3.5
    with_gauge = Sizing(APEX, 0.7, 15.0, sites=APEX + away[1:2])
    beside = APEX + [[0, 11.4, 0], [0, 12.25, 0], [0, 13.0, 0]]
    assert with_gauge(beside) == pytest.approx(0.7 * (1.6 + 5.4 * np.array([0, 0.05, 0.1])))
    at_a_gauge = with_gauge(APEX + away)
    assert at_a_gauge[1] == pytest.approx(1.6 * 0.7) and np.all(at_a_gauge <= expected)
    assert at_a_gauge[[0, 4]] == pytest.approx(expected[[0, 4]], rel=1e-12)


@pytest.mark.parametrize("variant", [1, 2])
def test_a_variant_triangulates_the_same_body(variant, finger_of):
    for finger in (Finger.default(), finger_of(Slab((24.0, 20.0), (21.0, 17.0), (10.0, 6.0)))):
        body = body_of(finger)
        for surface, (vertices, triangles), (moved, same) in zip(
            body.surfaces.values(), *(triangulations(body, 2.0, number) for number in (0, variant)), strict=True
        ):
            assert np.array_equal(triangles, same)
            curved = np.abs(surface.level(vertices)) < 1e-9
            assert np.abs(surface.level(moved[curved])).max() < 1e-9
            assert np.array_equal(moved == 0, vertices == 0)
            assert moved.max(axis=0) == pytest.approx(vertices.max(axis=0), rel=1e-12)
            area = [np.cross(*(v[triangles[:, k]] - v[triangles[:, 0]] for k in (1, 2))) for v in (vertices, moved)]
            assert np.all((area[0] * area[1]).sum(axis=1) > 0), "no triangle turns over"


@pytest.mark.parametrize("size", [0.099, 5.01, 0.0, -1.0, float("nan"), float("inf"), "fine"])
def test_sizes_from_a_200th_to_a_quarter_of_the_height(size, free):
    free(10**15)
    asked(Finger.default(), 0.101)
    asked(Finger.default(), 4.99)
    with pytest.raises(InputError, match="^size_mm .*(between 0.1 and 5, got|greater than 0|finite|a number)"):
        build(Finger.default(), size)


@pytest.mark.parametrize("left", [1e9, 8e9, 64e9])
def test_the_size_that_is_named_would_fit_and_a_finer_one_would_not(left, free, no_mesher):
    free(left)
    message = r"^factorising a mesh of about \d,\d{3},\d{3} tetrahedra \(size_mm 0.1\) needs about \d+ GiB of memory, "
    with pytest.raises(MemoryEstimateError, match=message + r"[\d.]+ GiB (is|are) free: ") as refused:
        build(Finger.default(), 0.1)
    size = float(re.search(r": mesh with size_mm >= ([\d.]+) \(--size-mm of ", str(refused.value)).group(1))
    asked(Finger.default(), size)
    with pytest.raises(MemoryEstimateError):
        asked(Finger.default(), 0.93 * size)
