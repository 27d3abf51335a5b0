"""Shipped meshes moved into other fingers: pinned, exact on their surfaces, refined where it is needed, or refused."""

from dataclasses import replace
from hashlib import sha256

import numpy as np
import pytest

from papilla.core.errors import MeshError
from papilla.fem import FingerModel, press
from papilla.mesh import BONE, DEFAULT_SIZE_MM, build, builder, drawing, quality
from papilla.mesh.body import body_of
from papilla.mesh.builder import SIZES_MM, VARIANTS, WORST, morphed, path_of, relative_sizes
from papilla.mesh.cells import TaggedCells, components, mean_ratio, paired_faces, volumes
from papilla.mesh.refining import bisected
from papilla.mesh.sizing import asked
from papilla.model.finger import Dome, Finger, Layer, Slab
from papilla.model.specimen import Block

PINNED = {
    0: "ceb274e87c76d8b46b5104d75d1b1d7c187d23494896a0291017770d70f7d6a3",
    1: "c3c29423ac729bf3d5b4b242cdc03e20c19243fb1f573798f33ca33df2457ba0",
    2: "d6ee09c00b6772d87eaa077abdde3d2fcab9145d53b8fa399d2b12f3b756a6c4",
    3: "58deb2edd1e69e78ec19838c6a8894b58440f4442a237b2fcaa734cf4971c8c1",
    4: "21cc7fae1012081422d5eacde921b07f4d887d4f495f485f19d9769d0ce5ca7e",
}
OWN = Dome((24.0, 24.0, 18.0), (22.0, 22.0, 16.0), (9.0, 9.0, 7.0))
SHAPES = {
    "own": OWN,
    "half": Dome((12.0, 15.0, 10.0), (10.5, 13.5, 8.5), (5.0, 8.0, 3.0)),
    "double": Dome((48.0, 60.0, 40.0), (42.0, 54.0, 34.0), (20.0, 32.0, 12.0)),
    "thin skin": Dome((24.0, 30.0, 20.0), (22.5, 28.5, 18.5), (10.0, 16.0, 6.0)),
    "thick skin": Dome((24.0, 30.0, 20.0), (19.0, 25.0, 15.0), (10.0, 16.0, 6.0)),
    "high bone": Dome((24.0, 30.0, 20.0), (21.0, 27.0, 17.0), (10.0, 16.0, 14.0)),
    "narrow": Dome((18.0, 30.0, 20.0), (15.0, 27.0, 17.0), (8.0, 16.0, 6.0)),
    "slab": Slab((24.0, 20.0), (22.0, 18.0), (10.0, 6.0), depth=14.0),
    "shallow slab": Slab((24.0, 20.0), (21.0, 17.0), (10.0, 6.0), depth=2.0),
}
STORED_COUNTS = (659, 2548)
STORED_TETS = "01595eaee5ffde12211ab003b808fc1011fd0738b911b04345d286ad43d1428e"
STORED_SD = 19989.885306432614
STORED = [
    [0.0, 0.0, 7.0],
    [3.7834321405061995, 4.363610948845543, 17.471049028549523],
    [10.246898193172875, 19.016370340636374, 3.0318408546746656],
    [18.186529619914577, 10.98496076900842, 4.151241720424163],
    [1.2358706658228822, 2.036453199343751, 17.911116203663457],
    [0.0, 12.524064171122994, 0.0],
]


@pytest.fixture(autouse=True)
def no_mesher(monkeypatch):
    def refuse(*args, **kwargs):
        raise MeshError("the mesher was called")

    monkeypatch.setattr(drawing, "tetrahedralise", refuse)


def shaped(shape, **changes) -> Finger:
    return replace(Finger.default(), shape=shape, **changes)


@pytest.mark.parametrize("variant", range(VARIANTS))
def test_default_finger_gets_a_pinned_mesh(variant, tmp_path):
    mesh = build(Finger.default(), variant=variant)
    assert mesh.sha256 == PINNED[variant]
    assert mesh.size_mm == DEFAULT_SIZE_MM and mesh.mirrors == ("x", "y")
    assert not (tmp_path / "cache").exists()
    figures = quality(mesh)
    assert figures["mean_ratio_min"] > 0.2
    total = 2 / 3 * np.pi * (24 * 30 * 20 - 10 * 16 * 6)
    assert sum(figures["volume_mm3"].values()) == pytest.approx(total, rel=0.003)


def test_moduli_do_not_change_the_mesh():
    stiffer = replace(Finger.default(), outer=replace(Finger.default().outer, modulus=1.0))
    assert build(stiffer).sha256 == PINNED[0]


def test_shipped_files_are_small_and_all_there():
    paths = [path_of(kind, size, k) for kind, sizes in SIZES_MM.items() for size in sizes for k in range(VARIANTS)]
    assert sum(path.stat().st_size for path in paths) < 6e6
    assert {path.name for path in builder.FOLDER.iterdir()} == {path.name for path in paths}


@pytest.mark.parametrize("kind, size", [(kind, size) for kind, sizes in SIZES_MM.items() for size in sizes])
def test_no_cell_of_a_shipped_mesh_is_halved(kind, size):
    """The finger that it was drawn for gets it as it is, whatever its variant."""
    finger = builder._reference_finger(kind)
    body, sizing = asked(finger, size)
    for variant in range(VARIANTS):
        assert builder._fitted(kind, body, sizing, variant)[1] == f"shipped mesh of {size:g} mm, not moved"


@pytest.mark.parametrize("name", SHAPES)
def test_a_moved_mesh_is_sound_and_lies_on_its_surfaces(name):
    finger = shaped(SHAPES[name])
    size = 1.4 if name != "half" else 1.0
    mesh = build(finger, size, variant=2)
    body, sizing = asked(finger, size)
    cell = mesh.cell()
    assert volumes(cell.points, cell.tets).min() > 0 and mean_ratio(cell.points, cell.tets).min() >= WORST
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


def test_an_elastic_bone_is_moved_too():
    mesh = build(shaped(OWN, bone=Layer(3000.0, 0.35)), 1.4)
    cells = mesh.tets[mesh.layer == BONE]
    assert volumes(mesh.points, cells).sum() == pytest.approx(2 / 3 * np.pi * 9 * 9 * 7, rel=0.03)
    assert np.all(mesh.points[np.unique(mesh.boundaries["base"])][:, 2] == 0)


def test_gauges_elsewhere_keep_the_mesh_unless_they_need_smaller_cells():
    default, said = build(Finger.default()).cell(), []
    near = replace(Finger.default(), gauges=(replace(Finger.default().gauges[1], angle_deg=-22.0),))
    kept = build(near, progress=said.append).cell()
    assert np.array_equal(kept.tets, default.tets) and np.abs(kept.points - default.points).max() < 1e-12
    assert said == ["shipped mesh of 0.7 mm, not moved; worst mean ratio 0.39"]
    far = replace(Finger.default(), gauges=(replace(Finger.default().gauges[0], angle_deg=55.0, y_mm=9.0),))
    finer = build(far, progress=said.append).cell()
    assert len(finer.tets) > len(default.tets) and "cells halved for their size" in said[1]
    body, sizing = asked(far, 0.7)
    middles = finer.points[finer.tets].mean(axis=1)
    there = np.linalg.norm(middles - sizing.sites[0], axis=1) < 1.5
    assert relative_sizes(finer.points, finer.tets, sizing)[there].max() < 1.5


@pytest.mark.parametrize(
    "shape",
    [
        Dome((50.0, 10.0, 10.0), (48.0, 8.0, 8.0), (40.0, 4.0, 3.0)),
        Dome((24.0, 30.0, 20.0), (23.9, 29.9, 17.0), (10.0, 16.0, 6.0)),
    ],
)
def test_what_moving_makes_poor_is_drawn_and_said(shape):
    said = []
    with pytest.raises(MeshError, match="the mesher was called"):
        build(shaped(shape), 2.0, progress=said.append)
    assert "below 0.15: the mesher makes a new one" in said[0]


def test_a_mesh_that_cannot_be_used_is_drawn_again(monkeypatch, no_mesher):
    """The cube that the mesher gives in place of the finger has no inner layer: drawn five times, then an error."""
    draws, said = [], []

    def cube(soup, progress):
        draws.append(soup)
        return np.vstack([np.zeros(3), np.eye(3)]), np.array([[0, 1, 2, 3]])

    monkeypatch.setattr(drawing, "tetrahedralise", cube)
    with pytest.raises(MeshError, match=r"got no tetrahedra.*\(5 meshes were drawn\)"):
        drawing.drawn(Finger.default(), 2.0, progress=said.append)
    assert len(draws) == 5 and len(said) == 4 and said[0].startswith("mesh 1 of at most 5 cannot be used")


def test_the_same_design_gives_the_stored_coordinates():
    """Computed on another machine: what the map and the halving give hangs on no draw, thread or library."""
    cell = build(shaped(OWN), 2.0, variant=1).cell()
    assert (len(cell.points), len(cell.tets)) == STORED_COUNTS
    sampled = cell.points[:: len(cell.points) // 5]
    assert sampled == pytest.approx(np.array(STORED), abs=1e-9)
    assert sha256(cell.tets.astype("<i8").tobytes()).hexdigest() == STORED_TETS


def test_the_same_design_gives_the_stored_sd():
    finger = shaped(OWN, ridges=None)
    reduced = FingerModel(finger, build(finger, 2.0, variant=1)).reduce()
    found = press(reduced, Block(0.3, thickness=10.0), force=0.4, fidelity="contact", friction=0.0)
    assert found.sd == pytest.approx(STORED_SD, rel=1e-9)


def test_the_map_takes_each_surface_to_its_own_and_is_smooth_between():
    """Along a ray the image moves outwards without a jump, in the direction of the ray's own, and planes stay."""
    origin, target = (body_of(shaped(shape)) for shape in (Finger.default().shape, SHAPES["high bone"]))
    rng = np.random.default_rng(3)
    rays = np.abs(rng.normal(size=(200, 3)))
    rays[:50, 0] = rays[50:80, 1] = 0
    skin = origin.surfaces["skin"].project(rays)
    steps = np.linspace(0.05, 1, 200)
    images = np.array([morphed(step * skin, origin, target) for step in steps])
    assert np.all((images == 0) == (skin == 0)), "mirror planes"
    for name in origin.surfaces:
        on = origin.surfaces[name].project(rays)
        image = morphed(on, origin, target)
        assert np.abs(target.surfaces[name].level(image)).max() < 1e-12
    jumps = np.linalg.norm(np.diff(images, axis=0), axis=2)
    assert jumps.max() < 4 * np.median(jumps)
    level = np.array([np.linalg.norm(image / target.surfaces["skin"].semi_axes, axis=1) for image in images])
    assert np.all(np.diff(level, axis=0) > 0)


def test_halving_leaves_no_hanging_vertex_and_keeps_volume_layer_and_faces():
    mesh = build(Finger.default(), 2.8).cell()
    cells = builder.tagged(mesh, body_of(Finger.default()))
    rng = np.random.default_rng(5)
    for share in (0.003, 0.2, 1.0):
        finer = bisected(cells, rng.random(len(cells.tets)) < share)
        assert len(finer.tets) > len(cells.tets) and volumes(finer.points, finer.tets).min() > 0
        faces, owners = paired_faces(finer.tets)
        rim = {tuple(face) for face in np.sort(faces[owners[:, 1] < 0], axis=1).tolist()}
        named = [*finer.on_plane, finer.on_surface["skin"], finer.on_surface["bone"]]
        assert rim == {tuple(face) for face in np.sort(np.vstack(named), axis=1).tolist()}
        between = finer.layer[owners[:, 0]] != np.where(owners[:, 1] < 0, 9, finer.layer[owners[:, 1]])
        inside = between & (owners[:, 1] >= 0)
        shared = {tuple(face) for face in np.sort(faces[inside], axis=1).tolist()}
        assert shared == {tuple(face) for face in np.sort(finer.on_surface["interface"], axis=1).tolist()}
        for layer in (0, 1):
            before, after = (volumes(c.points, c.tets)[c.layer == layer].sum() for c in (cells, finer))
            assert after == pytest.approx(before, rel=1e-12)
        worst = [mean_ratio(c.points, c.tets).min() for c in (cells, finer)]
        assert worst[1] > 0.4 * worst[0]


def test_halving_nothing_gives_the_same_cells():
    cells = TaggedCells(np.vstack([np.zeros(3), np.eye(3)]), np.array([[0, 1, 2, 3]]), np.zeros(1), {}, ())
    assert bisected(cells, np.array([False])) is cells
    halves = bisected(cells, np.array([True]))
    assert len(halves.tets) == 2 and volumes(halves.points, halves.tets) == pytest.approx([1 / 12, 1 / 12])
