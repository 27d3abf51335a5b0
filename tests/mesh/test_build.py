"""Meshes of the analytic shapes: volumes, boundaries, exact surfaces, exact mirrors."""

import numpy as np
import pytest

from papilla.core.errors import InputError, MeshError
from papilla.mesh import BONE_LAYER, BOUNDARY_NAMES, INNER_LAYER, OUTER_LAYER, LayeredMesh, build
from papilla.mesh.cells import components, paired_faces, volumes
from papilla.mesh.finishing import refuse_unusable
from papilla.mesh.surfaces import Ellipsoid, EllipticCylinder
from papilla.model.finger import Dome, Finger, Slab

ELLIPSOID_VOLUMES = 2 / 3 * np.pi * np.array([24 * 30 * 20, 21 * 27 * 17, 10 * 16 * 6])


def layer_volume(mesh, layer):
    return volumes(mesh.points, mesh.tets)[mesh.layer == layer].sum()


def area_vector(points, triangles):
    corners = points[triangles]
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]).sum(axis=0) / 2


def faces_as_set(faces):
    return {tuple(face) for face in np.sort(faces, axis=1).tolist()}


def outer_faces(mesh):
    faces, cells = paired_faces(mesh.tets)
    return faces[cells[:, 1] < 0]


def test_dome_layer_volumes(dome):
    # Measured at this size: -0.3 % and -0.6 %, because chords cut ellipsoids.
    outer, interface, bone = ELLIPSOID_VOLUMES
    assert layer_volume(dome, OUTER_LAYER) == pytest.approx(outer - interface, rel=0.008)
    assert layer_volume(dome, INNER_LAYER) == pytest.approx(interface - bone, rel=0.012)
    assert not np.any(dome.layer == BONE_LAYER)


def test_slab_layer_volumes(slab):
    area = np.pi / 2 * np.array([24 * 20, 21 * 17, 10 * 6])
    assert layer_volume(slab, OUTER_LAYER) == pytest.approx(10 * (area[0] - area[1]), rel=0.008)
    assert layer_volume(slab, INNER_LAYER) == pytest.approx(10 * (area[1] - area[2]), rel=0.008)
    assert slab.points[:, 1].min() == -5 and slab.points[:, 1].max() == 5


@pytest.mark.parametrize("name", ["dome", "dome_with_bone", "slab"])
def test_cells_are_positive_connected_and_used(name, request):
    mesh = request.getfixturevalue(name)
    assert volumes(mesh.points, mesh.tets).min() > 0
    assert components(paired_faces(mesh.tets)[1], len(mesh.tets)).max() == 0
    assert np.array_equal(np.unique(mesh.tets), np.arange(len(mesh.points)))


@pytest.mark.parametrize("name", ["dome", "dome_with_bone", "slab"])
def test_vertices_lie_exactly_on_their_surfaces(name, request):
    mesh = request.getfixturevalue(name)
    if name == "slab":
        skin, interface, bone = (EllipticCylinder(axes, 10.0) for axes in ((24, 20), (21, 17), (10, 6)))
    else:
        skin, interface, bone = (Ellipsoid(axes) for axes in ((24, 30, 20), (21, 27, 17), (10, 16, 6)))
    on = {key: mesh.points[np.unique(faces)] for key, faces in mesh.boundaries.items()}
    assert np.abs(skin.level(on["skin"])).max() < 1e-12
    assert np.abs(interface.level(on["interface"])).max() < 1e-12
    raised = on["base"][on["base"][:, 2] > 0]
    assert len(raised) == 0 if name == "dome_with_bone" else np.abs(bone.level(raised)).max() < 1e-12


def test_skin_and_base_close_the_dome(dome):
    named = np.vstack([dome.boundaries["skin"], dome.boundaries["base"]])
    assert faces_as_set(named) == faces_as_set(outer_faces(dome))
    assert len(faces_as_set(named)) == len(named)
    assert np.abs(area_vector(dome.points, named)).max() < 1e-9
    assert np.all(dome.points[dome.boundaries["skin"]].mean(axis=1)[:, 2] > 0)


@pytest.mark.parametrize("name", ["dome", "dome_with_bone", "slab"])
def test_boundaries_point_outwards(name, request):
    mesh = request.getfixturevalue(name)
    for boundary in ("skin", "interface"):
        corners = mesh.points[mesh.boundaries[boundary]]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        outwards = corners.mean(axis=1)
        if name == "slab":
            outwards = outwards * [1, 0, 1]
        assert np.einsum("ki,ki->k", normals, outwards).min() > 0
    assert area_vector(mesh.points, mesh.boundaries["base"])[2] < 0


def test_interface_separates_the_layers(dome):
    faces, cells = paired_faces(dome.tets)
    inner = cells[:, 1] >= 0
    between = faces[inner][dome.layer[cells[inner, 0]] != dome.layer[cells[inner, 1]]]
    assert faces_as_set(between) == faces_as_set(dome.boundaries["interface"])


@pytest.mark.parametrize("name", ["dome", "slab"])
@pytest.mark.parametrize("axis", [0, 1])
def test_mesh_is_its_own_mirror_image_to_the_bit(name, axis, request):
    mesh = request.getfixturevalue(name)
    image = mesh.points.copy()
    image[:, axis] = 0 - image[:, axis]
    known = {tuple(point): number for number, point in enumerate(mesh.points.tolist())}
    number = np.array([known[tuple(point)] for point in image.tolist()])
    assert faces_as_set(number[mesh.tets]) == faces_as_set(mesh.tets)
    for key in BOUNDARY_NAMES:
        assert faces_as_set(number[mesh.boundaries[key]]) == faces_as_set(mesh.boundaries[key])


@pytest.mark.parametrize("name", ["dome", "slab"])
def test_cell_is_a_quarter(name, request):
    mesh = request.getfixturevalue(name)
    cell = mesh.cell()
    assert mesh.mirrors == ("x", "y") and cell.mirrors == ()
    assert 4 * len(cell.tets) == len(mesh.tets)
    assert cell.points[:, :2].min() == 0
    assert 4 * volumes(cell.points, cell.tets).sum() == pytest.approx(volumes(mesh.points, mesh.tets).sum(), rel=1e-13)
    for key in BOUNDARY_NAMES:
        assert 4 * len(cell.boundaries[key]) == len(mesh.boundaries[key])
        assert cell.boundaries[key].min() >= 0


@pytest.mark.parametrize("size", [0.0, -1.0, float("nan"), float("inf"), "fine", 0.01, 50.0])
def test_size_out_of_range_is_refused(size):
    with pytest.raises(InputError, match="size_mm"):
        build(Finger.default(), size)


def two_tets(points):
    tets = np.array([[0, 1, 2, 3], [4, 5, 6, 7]])
    return LayeredMesh(points, tets, [0, 0], dict.fromkeys(BOUNDARY_NAMES, np.empty((0, 3), int)), 1.0)


def test_separate_parts_and_flat_cells_are_refused():
    corner = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    apart = np.vstack([corner, corner + 5])
    with pytest.raises(MeshError, match="2 separate parts"):
        refuse_unusable(two_tets(apart))
    apart[7, 2] = 5
    with pytest.raises(MeshError, match="1 of 2 tetrahedra are flat"):
        refuse_unusable(two_tets(apart))
    apart[7, 2] = 4
    with pytest.raises(MeshError, match="1 of 2 tetrahedra are flat or inverted"):
        refuse_unusable(two_tets(apart))


@pytest.mark.parametrize(
    "shape",
    [
        Dome((1e300, 30.0, 20.0), (21.0, 27.0, 17.0), (10.0, 16.0, 6.0)),
        Dome((0.2, 0.2, 0.2), (0.1, 0.1, 0.1), (0.05, 0.05, 0.05)),
        Slab((24.0, 20.0), (21.0, 17.0), (10.0, 6.0), depth=1e9),
    ],
)
def test_a_finger_that_was_hardly_meant_in_mm_is_refused_at_once(shape, finger_of):
    with pytest.raises(InputError, match=r"^longest side .* \(mm\) must lie between 1 and 1000, got [\d.e+]+$"):
        build(finger_of(shape), 1.0)
