"""Three surfaces and how they lie in each other: an answer where each is inside the one before, one line elsewhere."""

from itertools import permutations

import numpy as np
import pytest

from papilla.core.errors import FileFormatError
from papilla.mesh import BONE_LAYER, INNER_LAYER, OUTER_LAYER, build
from papilla.mesh.body import surfaces_of
from papilla.mesh.cells import volumes
from papilla.model.finger import Layer, Surfaces

NAMES = ("skin", "interface", "bone")
SIZE_MM = 1.5


def box(low, high):
    """A box of twelve triangles."""
    corners = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)])
    sides = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    triangles = [corner for a, b, c, d in sides for corner in ((a, b, c), (a, c, d))]
    return np.array(low) + corners * np.subtract(high, low), np.array(triangles)


def ball(axes, centre):
    import pyvista

    sphere = pyvista.Icosphere(nsub=2)
    return np.asarray(sphere.points, float) * axes + centre, sphere.regular_faces


SKIN = box([-12, -12, 0], [12, 12, 12])
INTERFACE = box([-9, -9, 0], [9, 9, 9])
BONE_BOX = box([-4, -4, 0], [4, 4, 5])


def crossed():
    """A skin whose top is a valley at z = 4 along a diagonal, and an interface with a ridge at z = 8 across it."""
    skin, interface = box([-12, -12, 0], [12, 12, 12]), box([-8, -8, 0], [8, 8, 8])
    skin[0][[4, 7], 2] = 4
    interface[0][[4, 7], 2] = 2
    interface[1][2:4] = (4, 5, 6), (5, 7, 6)
    return skin, interface, BONE_BOX


def lifted(part, z):
    return part[0] + [0, 0, z], part[1]


@pytest.fixture(autouse=True)
def own_cache(tmp_path_factory, monkeypatch):
    """The cache of this module: each surface is read by one child process."""
    monkeypatch.setenv("PAPILLA_CACHE", str(tmp_path_factory.getbasetemp() / "nested"))


@pytest.fixture
def finger(tmp_path, write_surface, finger_of):
    """A finger from three surfaces (vertices and triangles), the skin first."""

    def make(*parts, **more):
        files = [write_surface(tmp_path / f"{name}.stl", *part) for name, part in zip(NAMES, parts, strict=True)]
        return finger_of(Surfaces(*files), **more)

    return make


@pytest.mark.parametrize(
    ("parts", "named", "message"),
    [
        ((SKIN, box([-13, -13, 0], [13, 13, 13]), BONE_BOX), "interface", "around it"),
        ((SKIN, box([-5, -5, 1], [15, 5, 9]), BONE_BOX), "interface", "reaches out by 3 mm"),
        ((SKIN, SKIN, BONE_BOX), "interface", "at least .* away"),
        ((SKIN, box([-9, -9, 0], [9, 9, 12]), BONE_BOX), "interface", "at least .* away"),
        ((SKIN, INTERFACE, box([-9, -4, 2], [4, 4, 6])), "bone", "0 mm are left at"),
        ((SKIN, INTERFACE, box([-4, -4, 2], [4, 4, 10])), "bone", "reaches out by 1 mm"),
        ((SKIN, lifted(INTERFACE, 1), BONE_BOX), "bone", "its base reaches beyond"),
        ((SKIN, INTERFACE, ball((3, 3, 3), (0, 0, 3))), "bone", "touches the base .* in a point"),
        ((SKIN, ball((8, 8, 8), (0, 0, 2)), BONE_BOX), "interface", "reaches below the base"),
        ((SKIN, INTERFACE, lifted(BONE_BOX, 9.5)), "bone", "0.5 mm away from it"),
        (crossed(), "interface", "they cross near"),
        ((ball((12, 12, 12), (0, 0, 12)), lifted(INTERFACE, 6), BONE_BOX), "skin", "no flat base"),
    ],
)
def test_surfaces_that_are_not_nested_are_one_line(finger, parts, named, message):
    with pytest.raises(FileFormatError, match=rf"{named}\.stl: .*({message})") as caught:
        build(finger(*parts), SIZE_MM)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("order", [order for order in permutations(range(3)) if order != (0, 1, 2)])
@pytest.mark.parametrize("clear_mm", [0.0, 1.5])
def test_files_in_a_wrong_order_are_one_line(finger, order, clear_mm):
    parts = SKIN, lifted(INTERFACE, clear_mm), lifted(BONE_BOX, 2 * clear_mm)
    with pytest.raises(FileFormatError, match=r"but around it: the order is outer, interface, bone|no flat base"):
        build(finger(*(parts[number] for number in order)), SIZE_MM)


@pytest.mark.slow
@pytest.mark.parametrize("elastic", [False, True])
@pytest.mark.parametrize("lift_mm", [None, 0.4, 1.5])
def test_surfaces_clear_of_the_base_are_meshed_exactly(finger, lift_mm, elastic):
    interface = INTERFACE if lift_mm is None else ball((8, 8, 4.5), (0, 0, 4.5 + lift_mm))
    parts = SKIN, interface, ball((3, 3, 1.5), (0, 0, 3.0 + (lift_mm or 0)))
    design = finger(*parts, bone=Layer(3000.0, 0.35) if elastic else None)
    mesh = build(design, SIZE_MM)
    volume = volumes(mesh.points, mesh.tets)
    skin, interface, bone = (np.linalg.det(points[triangles]).sum() / 6 for points, triangles in parts)
    layers = {OUTER_LAYER: skin - interface, INNER_LAYER: interface - bone} | ({BONE_LAYER: bone} if elastic else {})
    assert volume.min() > 0 and set(mesh.layer) == set(layers)
    for layer, expected in layers.items():
        assert volume[mesh.layer == layer].sum() == pytest.approx(expected, rel=0.02)
    held = mesh.points[np.unique(mesh.boundaries["base"])]
    on_bone = np.abs(surfaces_of(design)["bone"].level(held)) < 1e-9
    assert np.all((held[:, 2] == 0) | on_bone) and np.any(held[:, 2] == 0)
    assert np.any(on_bone) != elastic, "a rigid bone is held, wherever it is"
