"""The wanted element size, the background grid that carries it, and what the mesher is given."""

import numpy as np
import pytest

from papilla.core.errors import InputError
from papilla.mesh import build, drawing
from papilla.mesh.body import body_of
from papilla.mesh.cells import paired_faces, positively_oriented, volumes
from papilla.mesh.drawing import grid_over, triangulations
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


@pytest.mark.parametrize(
    "near, far, grid", [(0.2, 1.0, 1.0), (0.7, 3.5, 1.0), (1.0, 5.0, 1.0), (2.0, 5.0, 2.0), (6, 6, 6)]
)
def test_largest_size_and_spacing_of_the_grid(near, far, grid):
    sizing = Sizing(APEX, near, 15.0)
    assert sizing.far_mm == pytest.approx(far) and sizing.grid_mm == grid


def test_cells_are_counted_by_the_volume_of_their_size():
    sizing = Sizing(APEX, 0.5, 15.0)
    at_apex = np.repeat(APEX[None] + [4, 0, 0], 40, axis=0)
    assert sizing.cell_count(at_apex, 2.0) == pytest.approx(2400 + 9.3 * 40 * 2.0 / 0.125)
    assert sizing.cell_count(at_apex + 1000, 2.0) == pytest.approx(2400 + 9.3 * 40 * 2.0 / 2.5**3)


@pytest.mark.parametrize("shift", [(0, 0, 0), (0.5, 0.5, 0.5), (-0.5, -0.5, -0.5), (0.3, -0.2, 0.0)])
def test_the_grid_fills_more_than_the_box(shift):
    low, high, spacing = np.array([0, -1, 2.0]), np.array([3.1, 1, 4.0]), 0.5
    points, tets = grid_over(low, high, spacing, np.array(shift))
    assert np.all(points.min(axis=0) <= low - spacing / 2 + 1e-12)
    assert np.all(points.max(axis=0) >= high + spacing / 2 - 1e-12)
    assert np.all(points.min(axis=0) == pytest.approx(low - spacing + spacing * np.array(shift)))
    assert np.all(np.ptp(points, axis=0) == pytest.approx([4.5, 3.0, 3.0]))
    volume = volumes(points, tets)
    assert volume == pytest.approx(np.full(len(tets), spacing**3 / 6)) and volume.sum() == pytest.approx(4.5 * 3 * 3)
    faces, cells = paired_faces(tets)
    rim = points[faces[cells[:, 1] < 0]]
    assert np.all(np.any(np.ptp(rim, axis=1) == 0, axis=1)), "cubes fit: only faces of the box are single"


def test_orientation_is_mended_where_it_is_wrong():
    points = np.vstack([np.zeros(3), np.eye(3)])
    tets = np.array([[0, 1, 2, 3], [0, 2, 1, 3]])
    found = positively_oriented(points, tets)
    assert found.tolist() == [[0, 1, 2, 3], [0, 1, 2, 3]] and tets[1].tolist() == [0, 2, 1, 3]


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


def test_the_soup_of_the_default_finger(given):
    soup = given(Finger.default(), 2.0)
    parts = triangulations(body_of(Finger.default()), 2.0)
    assert len(soup["vertices"]) == sum(len(vertices) for vertices, _ in parts)
    starts = np.cumsum([0] + [len(vertices) for vertices, _ in parts])
    for k, (vertices, triangles) in enumerate(parts):
        part = soup["triangles"][sum(len(t) for _, t in parts[:k]) :][: len(triangles)]
        assert np.array_equal(soup["vertices"][part], vertices[triangles])
        assert part.min() == starts[k] and part.max() == starts[k + 1] - 1
    assert soup["far_mm"] == 5.0
    diagonal = np.linalg.norm([24, 30, 20])
    assert soup["envelope"] == pytest.approx(0.05 * 2.0 / diagonal)
    assert given(Finger.default(), 0.5)["envelope"] == 1e-3, "never less"
    assert soup["grid_points"].min(axis=0).tolist() == [-2, -2, -2]
    angles = np.radians([0, 20, 40])
    sites = np.column_stack([21 * np.sin(angles), np.zeros(3), 17 * np.cos(angles)])
    assert soup["grid_sizes"] == pytest.approx(Sizing(APEX, 2.0, 15.0, sites)(soup["grid_points"]))


def test_a_variant_has_triangles_of_its_own_and_shifts_the_grid(given, finger_of, slab_shape):
    for finger in (Finger.default(), finger_of(slab_shape)):
        plain, one, again, two = (given(finger, 2.0, variant=variant) for variant in (0, 1, 1, 2))
        assert np.array_equal(one["vertices"], again["vertices"])
        for other in (one, two):
            shift = (other["grid_points"] - plain["grid_points"]) / 2.0
            assert np.ptp(shift, axis=0) == pytest.approx(np.zeros(3), abs=1e-12)
            assert np.all(np.abs(shift[0]) <= 0.5) and np.all(np.abs(shift[0]) > 1e-3)
        assert np.abs(one["vertices"] - two["vertices"]).max() > 0.1


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


@pytest.mark.parametrize("size, divisions", [(0.7, 28), (2.0, 21), (5.0, 9)])
def test_facets_follow_the_largest_radius_or_the_element_size(size, divisions):
    body = body_of(Finger.default())
    curved = [
        np.sum(np.abs(surface.level(vertices[triangles].reshape(-1, 3))).reshape(-1, 3).max(axis=1) < 1e-9)
        for surface, (vertices, triangles) in zip(body.surfaces.values(), triangulations(body, size), strict=True)
    ]
    assert curved[0] == divisions**2
    facet = max(30 / 18, 1.1 * size)
    assert curved == [max(6, round(np.pi / 2 * largest / facet)) ** 2 for largest in (30, 27, 16)]


def test_planes_of_the_quarters(finger_of, slab_shape):
    base = [(0, 0.0, -1, "mirror"), (1, 0.0, -1, "mirror"), (2, 0.0, -1, "base")]
    for finger, extra in ((Finger.default(), []), (finger_of(slab_shape), [(1, 5.0, 1, "end")])):
        body = body_of(finger)
        assert [(plane.axis, plane.value, plane.outward, plane.role) for plane in body.planes] == base + extra
        assert body.mirrors == ("x", "y") and body.apex.tolist() == [0, 0, 20]
        assert body.low.tolist() == [0, 0, 0] and body.high[[0, 2]].tolist() == [24, 20]
