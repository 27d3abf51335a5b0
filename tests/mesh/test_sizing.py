"""The wanted element size, the background grid that carries it, and what the mesher is given."""

import numpy as np
import pytest

from papilla.core.errors import InputError
from papilla.mesh import build, drawing
from papilla.mesh.body import body_of
from papilla.mesh.drawing import triangulations
from papilla.mesh.sizing import Sizing
from papilla.model.finger import Finger

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
    at_a_gauge = Sizing(APEX, 0.7, 15.0, sites=APEX + away[1:2])(APEX + away)
    assert at_a_gauge[1] == pytest.approx(1.6 * 0.7) and np.all(at_a_gauge <= expected)
    assert at_a_gauge[[0, 4]] == pytest.approx(expected[[0, 4]], rel=1e-12)


class AskedError(Exception):
    """Raised in the mesher's place, with what it was given."""


@pytest.fixture
def given(monkeypatch):
    """What the mesher is given for a finger, size and variant."""

    def ask(command, *, cwd, **_):
        with np.load(cwd / "input.npz") as arrays:
            raise AskedError({name: arrays[name] for name in arrays.files})

    monkeypatch.setattr("papilla.core.seams.start", ask)

    def of(*arguments, **more):
        with pytest.raises(AskedError) as asked:
            drawing.drawn(*arguments, **more)
        return asked.value.args[0]

    return of


@pytest.mark.parametrize("variant", [1, 2])
def test_a_variant_triangulates_the_same_body(variant, finger_of, slab_shape):
    for finger in (Finger.default(), finger_of(slab_shape)):
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


@pytest.mark.parametrize("size, accepted", [(0.101, True), (0.099, False), (4.99, True), (5.01, False)])
def test_sizes_from_a_200th_to_a_quarter_of_the_height(size, accepted, given, free):
    free(10**15)
    if accepted:
        given(Finger.default(), size)
    else:
        with pytest.raises(InputError, match="size_mm of a finger 20 mm tall must lie between 0.1 and 5, got"):
            build(Finger.default(), size)
