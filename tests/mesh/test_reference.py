"""Shipped meshes moved into other fingers: sound, exact on their surfaces, of the size asked for, and halved."""

from dataclasses import replace

import numpy as np
import pytest

from papilla.core.errors import MeshError
from papilla.mesh import DEFAULT_SIZE_MM, build, builder, quality
from papilla.mesh.body import body_of
from papilla.mesh.builder import SHIPPED_VARIANTS, SIZES_MM, WORST_MEAN_RATIO, morphed, relative_sizes
from papilla.mesh.cells import components, mean_ratio, paired_faces, volumes
from papilla.mesh.refining import bisected
from papilla.mesh.sizing import asked
from papilla.model.finger import Dome, Finger, Slab

SHAPES = {
    "half": Dome((12.0, 15.0, 10.0), (10.5, 13.5, 8.5), (5.0, 8.0, 3.0)),
    "high bone": Dome((24.0, 30.0, 20.0), (21.0, 27.0, 17.0), (10.0, 16.0, 14.0)),
    "narrow": Dome((18.0, 30.0, 20.0), (15.0, 27.0, 17.0), (8.0, 16.0, 6.0)),
    "shallow slab": Slab((24.0, 20.0), (21.0, 17.0), (10.0, 6.0), depth=2.0),
    "skin a third of an element thick": Dome((24.0, 30.0, 20.0), (23.4, 29.4, 19.4), (10.0, 16.0, 6.0)),
    "semi-axes of 1 mm": Dome((1.0, 1.25, 0.83), (0.875, 1.125, 0.708), (0.417, 0.667, 0.25)),
    "semi-axes of 500 mm": Dome((400.0, 500.0, 333.0), (350.0, 450.0, 283.0), (167.0, 267.0, 100.0)),
    "axes of ratio 5, flat": Dome((50.0, 50.0, 10.0), (45.0, 45.0, 8.0), (20.0, 20.0, 3.0)),
}
SIZES = {"half": 1.0, "skin a third of an element thick": 2.0, "axes of ratio 5, flat": 2.0} | {
    "semi-axes of 1 mm": 0.1, "semi-axes of 500 mm": 40.0
}  # fmt: skip
pytestmark = pytest.mark.usefixtures("no_mesher")


def shaped(shape, **changes) -> Finger:
    return replace(Finger.default(), shape=shape, **changes)


@pytest.mark.parametrize("variant", range(SHIPPED_VARIANTS))
def test_the_default_finger_gets_a_shipped_mesh_as_it_is_whatever_its_moduli(variant, tmp_path):
    default, said = Finger.default(), []
    for size in SIZES_MM["dome"]:
        assert build(default, size, variant=variant, progress=said.append).size_mm == size
    mesh = build(default, variant=variant)
    assert build(replace(default, outer=replace(default.outer, modulus=1.0)), variant=variant).sha256 == mesh.sha256
    assert mesh.size_mm == DEFAULT_SIZE_MM and mesh.mirrors == ("x", "y")
    assert said == [] and not (tmp_path / "cache").exists()
    figures = quality(mesh)
    assert figures["mean_ratio_min"] > 0.2
    total = 2 / 3 * np.pi * (24 * 30 * 20 - 10 * 16 * 6)
    assert sum(figures["volume_mm3"].values()) == pytest.approx(total, rel=0.003)


@pytest.mark.parametrize("name", SHAPES)
def test_a_moved_mesh_is_sound_and_lies_on_its_surfaces(name):
    finger, size = shaped(SHAPES[name], ridges=None), SIZES.get(name, 1.4)
    if name == "semi-axes of 1 mm":
        grid = {"length_mm": 0.1, "width_mm": 0.1, "backing_mm": (0.2, 0.2)}
        finger = replace(finger, gauges=tuple(replace(gauge, **grid) for gauge in finger.gauges))
    mesh = build(finger, size, variant=2)
    body, sizing = asked(finger, size)
    cell = mesh.cell()
    assert volumes(cell.points, cell.tets).min() > 0 and mean_ratio(cell.points, cell.tets).min() >= WORST_MEAN_RATIO
    assert components(paired_faces(mesh.tets)[1], len(mesh.tets)).max() == 0
    for surface in ("skin", "interface"):
        on = mesh.points[np.unique(mesh.boundaries[surface])]
        assert np.abs(body.surfaces[surface].level(on)).max() < 1e-11
        assert np.abs(body.surfaces[surface].level(mesh.middles)).min(initial=1) < 1e-11
    near = np.linalg.norm(cell.points[cell.tets].mean(axis=1) - body.apex, axis=1).argsort()[:200]
    size_there = relative_sizes(cell.points, cell.tets, sizing)[near]
    assert np.median(size_there) < 1.3 and size_there.max() < 1.5
    shape, quarter = finger.shape, np.pi / 6
    volume = (np.prod(shape.outer) - np.prod(shape.bone)) * quarter
    if isinstance(shape, Slab):
        volume *= 1.5 * shape.depth / 2
    assert volumes(cell.points, cell.tets).sum() == pytest.approx(volume, rel=0.01)


def test_the_map_takes_each_surface_to_its_own_and_moves_outwards_between():
    origin, target = (body_of(shaped(shape)) for shape in (Finger.default().shape, SHAPES["high bone"]))
    rays = np.abs(np.random.default_rng(3).normal(size=(200, 3)))
    rays[:50, 0] = rays[50:80, 1] = 0
    skin = origin.surfaces["skin"].project(rays)
    images = np.array([morphed(step * skin, origin, target) for step in np.linspace(0.05, 1, 200)])
    assert np.all((images == 0) == (skin == 0)), "mirror planes"
    for name, surface in origin.surfaces.items():
        image = morphed(surface.project(rays), origin, target)
        assert np.abs(target.surfaces[name].level(image)).max() < 1e-12
    level = np.linalg.norm(images / target.surfaces["skin"].semi_axes, axis=2)
    assert np.all(np.diff(level, axis=0) > 0)


def as_set(faces):
    return {tuple(face) for face in np.sort(faces, axis=1).tolist()}


def test_halving_leaves_no_hanging_vertex_and_keeps_volume_layer_and_faces():
    mesh = build(Finger.default(), 2.8).cell()
    cells = builder.tagged(mesh, body_of(Finger.default()))
    rng = np.random.default_rng(5)
    for share in (0.003, 0.2, 1.0):
        finer = bisected(cells, rng.random(len(cells.tets)) < share)
        assert len(finer.tets) > len(cells.tets) and volumes(finer.points, finer.tets).min() > 0
        faces, owners = paired_faces(finer.tets)
        named = [*finer.on_plane, finer.on_surface["skin"], finer.on_surface["bone"]]
        assert as_set(faces[owners[:, 1] < 0]) == as_set(np.vstack(named))
        between = (owners[:, 1] >= 0) & (finer.layer[owners[:, 0]] != finer.layer[owners[:, 1]])
        assert as_set(faces[between]) == as_set(finer.on_surface["interface"])
        for layer in (0, 1):
            before, after = (volumes(c.points, c.tets)[c.layer == layer].sum() for c in (cells, finer))
            assert after == pytest.approx(before, rel=1e-12)
        assert mean_ratio(finer.points, finer.tets).min() > 0.4 * mean_ratio(cells.points, cells.tets).min()


@pytest.mark.parametrize(
    "shape",
    [
        Dome((24.0, 30.0, 20.0), (23.9, 29.9, 19.9), (10.0, 16.0, 6.0)),  # Skin a twentieth of an element thick
        Dome((24.0, 30.0, 20.0), (21.0, 27.0, 17.0), (20.0, 26.0, 16.0)),  # Inner layer of half an element
        Dome((10.0, 50.0, 20.0), (8.0, 45.0, 17.0), (4.0, 20.0, 6.0)),
    ],
)
def test_what_no_shipped_mesh_reaches_goes_to_the_mesher_with_a_line(shape):
    said = []
    with pytest.raises(MeshError, match="the mesher was called"):
        build(shaped(shape, ridges=None), 2.0, progress=said.append)
    assert said[0].startswith("shipped mesh of ") and said[0].endswith("below 0.15: the mesher makes a new one")


def test_gauges_at_the_rim_get_the_cells_that_they_need():
    default, said = Finger.default(), []
    first, *others, last = default.gauges
    finger = replace(default, gauges=(replace(first, angle_deg=-85.0), *others, replace(last, angle_deg=85.0)))
    mesh = build(finger, 1.0, progress=said.append)
    cell, (_, sizing) = mesh.cell(), asked(finger, 1.0)
    assert said[0].startswith("shipped mesh of 1 mm, not moved")
    there = np.linalg.norm(cell.points[cell.tets].mean(axis=1) - np.abs(sizing.sites[0]), axis=1) < 2.0
    assert there.any()
    assert relative_sizes(cell.points, cell.tets, sizing)[there].max() < 1.5
