"""Surface files of the user: read exactly, refused with one clear line, meshed like the shape they copy."""

import shutil
from dataclasses import replace

import numpy as np
import pytest

from papilla.core.errors import FileFormatError
from papilla.mesh import INNER_LAYER, OUTER_LAYER, build
from papilla.mesh.body import surfaces_of
from papilla.mesh.cells import volumes
from papilla.mesh.drawing import drawn
from papilla.mesh.surface_files import read_closed, read_nested
from papilla.mesh.surfaces import Ellipsoid
from papilla.model.finger import DEFAULT_FINGER, Finger, Layer, Surfaces

AXES = {"outer": (24.0, 30.0, 20.0), "interface": (21.0, 27.0, 17.0), "bone": (10.0, 16.0, 6.0)}
DIVISIONS = 14


@pytest.fixture
def files(tmp_path, half_ellipsoid, write_surface):
    """Names of the three surface files of the default dome; keyword arguments replace semi-axes."""

    def make(suffix=".stl", divisions=DIVISIONS, **axes):
        return tuple(
            write_surface(tmp_path / f"{name}{suffix}", *half_ellipsoid(axes.get(name, AXES[name]), divisions))
            for name in AXES
        )

    return make


def refused(path, pattern, read=read_closed):
    with pytest.raises(FileFormatError, match=pattern) as caught:
        read(path)
    assert "\n" not in str(caught.value)
    names = path if isinstance(path, tuple) else (path,)
    assert any(name in str(caught.value) for name in names)


def test_surface_answers_like_the_ellipsoid_it_copies(files):
    surfaces = dict(zip(AXES, read_nested(files()), strict=True))
    random = np.random.default_rng(3)
    points = random.uniform([-20, -25, 1], [20, 25, 25], (300, 3))
    for name, surface in surfaces.items():
        exact = Ellipsoid(AXES[name])
        foot = surface.project(points)
        assert np.abs(surface.level(foot)).max() < 1e-9
        level = surface.level(points)
        near = (np.abs(level) < 1) & (points[:, 2] > 3)
        assert level[near] == pytest.approx(exact.level(points[near]), abs=0.15)
        xy = points[:, :2] * 0.3
        assert surface.height(xy) == pytest.approx(exact.height(xy), abs=0.1)
        outside = 1.02 * np.array([[exact.axes[0], 0.0], [0.0, exact.axes[1]]])
        assert np.all(np.isnan(surface.height(outside)))
        up = exact.project(points[points[:, 2] > 5])
        up = up[up[:, 2] > 0.2 * exact.axes[2]]
        assert np.einsum("ki,ki->k", surface.normal(up), exact.normal(up)).min() > np.cos(np.radians(4))


def test_inside_out_triangles_are_turned(tmp_path, half_ellipsoid, write_surface):
    vertices, triangles = half_ellipsoid(AXES["outer"], 8)
    triangles = triangles.copy()
    triangles[::3] = triangles[::3, ::-1]
    path = write_surface(tmp_path / "mixed.ply", vertices, triangles)
    again = read_closed(path)
    assert np.linalg.det(again[0][again[1]]).sum() / 6 == pytest.approx(2 / 3 * np.pi * 24 * 30 * 20, rel=0.03)


@pytest.mark.slow
@pytest.mark.parametrize("suffix", [".stl", ".ply", ".vtp"])
@pytest.mark.parametrize("kept", [0.999, 0.6, 0.1])
def test_a_truncated_file_is_one_line(tmp_path, suffix, kept, half_ellipsoid, write_surface, capfd):
    """VTK's readers of binary PLY and VTP end the process on some of these."""
    path = tmp_path / f"cut{suffix}"
    write_surface(path, *half_ellipsoid(AXES["outer"], 6))
    content = path.read_bytes()
    path.write_bytes(content[: int(kept * len(content))])
    refused(str(path), r"holds no triangles|not a readable|is open|not finite|mm; a |another unit|not a manifold")
    assert capfd.readouterr() == ("", "")


HOSTILE_PLY = """ply
format binary_little_endian 1.0
element vertex {vertices}
property float x
property float y
property float z
element face {faces}
property list uchar int vertex_indices
end_header
"""


@pytest.mark.slow
@pytest.mark.parametrize("vertices, faces", [(3, 1), (2_000_000_000, 1), (3, 2_000_000_000), (-5, 1), (3, -5)])
@pytest.mark.parametrize("corner", [b"\x03" + b"\xff" * 12, b"\xff" + b"\x7f" * 12, b"\x03" + bytes([9, 9, 9, 9] * 3)])
def test_a_hostile_file_is_one_line(tmp_path, vertices, faces, corner):
    path = tmp_path / "hostile.ply"
    path.write_bytes(HOSTILE_PLY.format(vertices=vertices, faces=faces).encode() + bytes(36) + corner)
    refused(str(path), r"holds no triangles|not a readable \.ply file|not finite|is flat|is open")


def test_a_reader_that_crashes_is_a_file_that_cannot_be_read(files, worker):
    worker("import os, signal\nos.kill(os.getpid(), signal.SIGKILL)\n")
    refused(files()[0], r"outer\.stl: not a readable \.stl file$")


def test_a_file_is_read_once_for_its_content(files, monkeypatch):
    first, path = read_closed(files()[0]), files()[0]
    monkeypatch.setattr("papilla.core.seams.start", lambda *_, **__: pytest.fail("it was read again"))
    again = read_closed(path)
    assert np.array_equal(first[0], again[0]) and np.array_equal(first[1], again[1])


@pytest.mark.parametrize("suffix", [".stl", ".ply", ".vtp"])
@pytest.mark.parametrize("content", [b"", b"this is a shopping list\n" * 20, bytes(range(256)) * 4])
def test_garbage(tmp_path, suffix, content, capfd):
    path = tmp_path / f"garbage{suffix}"
    path.write_bytes(content)
    refused(str(path), "holds no triangles|not a readable|is flat|not finite|open")
    assert capfd.readouterr() == ("", "")


@pytest.mark.slow
def test_the_example_that_ships_is_meshed_once_its_files_lie_beside_it(tmp_path, half_ellipsoid, write_surface):
    example = DEFAULT_FINGER.with_name("surfaces_finger.toml")
    shutil.copy(example, tmp_path)
    for name, axes in zip(("skin", "interface", "bone"), AXES.values(), strict=True):
        write_surface(tmp_path / f"{name}.stl", *half_ellipsoid(axes, 8))
    finger = Finger.load(tmp_path / example.name)
    assert finger.shape == Surfaces(*(str(tmp_path / f"{name}.stl") for name in ("skin", "interface", "bone")))
    mesh = build(finger, 4.0)
    assert set(mesh.layer) == {OUTER_LAYER, INNER_LAYER} and volumes(mesh.points, mesh.tets).min() > 0
    # With the commented table, too, and kept by content: another name and other moduli are the same mesh
    whole = example.read_text(encoding="utf-8").replace("# [bone]\n# modulus_MPa = 3000.0\n# nu = 0.35", BONE)
    assert BONE in whole
    (tmp_path / "other.toml").write_text(whole, encoding="utf-8")
    assert Finger.load(tmp_path / "other.toml").bone == Layer(3000.0, 0.35)
    renamed = replace(finger, name="other", outer=Layer(0.2))
    assert build(renamed, 4.0).sha256 == mesh.sha256


BONE = "[bone]\nmodulus_MPa = 3000.0\nnu = 0.35"


@pytest.mark.slow
def test_files_of_the_dome_give_its_mesh(files, finger_of):
    finger = finger_of(Surfaces(*files(divisions=28)))
    mesh = drawn(finger, 2.0)
    outer, interface, bone = (2 / 3 * np.pi * np.prod(axes) for axes in AXES.values())
    volume = volumes(mesh.points, mesh.tets)
    assert volume.min() > 0 and mesh.mirrors == ()
    assert volume[mesh.layer == OUTER_LAYER].sum() == pytest.approx(outer - interface, rel=0.01)
    assert volume[mesh.layer == INNER_LAYER].sum() == pytest.approx(interface - bone, rel=0.01)
    surfaces = surfaces_of(finger)
    for name in ("skin", "interface"):
        on = mesh.points[np.unique(mesh.boundaries[name])]
        assert np.abs(surfaces[name].level(on)).max() < 1e-9
    base = mesh.points[np.unique(mesh.boundaries["base"])]
    raised = base[:, 2] > 0
    assert np.abs(surfaces["bone"].level(base[raised])).max() < 1e-9 and np.any(~raised)


def fin(vertices, triangles):
    edge = triangles[0]
    more = [[*edge[:2], len(vertices)], [*edge[1::-1], len(vertices)]]
    return np.vstack([vertices, [0, 0, 40]]), np.vstack([triangles, more])


def dented(vertices, triangles):
    lowest = np.arange(len(vertices)) == vertices[:, 2].argmax()
    return np.where(lowest[:, None] & [False, False, True], -5.0, vertices), triangles


def twice(vertices, triangles):
    return np.vstack([vertices / 3, vertices / 3 + [60, 0, 0]]), np.vstack([triangles, triangles + len(vertices)])


@pytest.mark.parametrize(
    ("spoilt", "message"),
    [
        (lambda v, t: (v, t[5:]), "is open: .* edges"),
        (fin, "not a manifold|is open"),
        (lambda v, t: (v * [1, 1, 0], t), "is flat|not a manifold"),
        (lambda v, t: (1e-3 * v, t), "another unit"),
        (lambda v, t: (1e3 * v, t), "another unit"),
        (dented, "intersects itself near"),
        (twice, "more than one piece"),
    ],
    ids=["open", "fin", "flat", "in m", "in um", "dented", "two pieces"],
)
def test_a_surface_that_bounds_no_body_is_one_line(tmp_path, half_ellipsoid, write_surface, spoilt, message):
    refused(write_surface(tmp_path / "spoilt.stl", *spoilt(*half_ellipsoid(AXES["outer"], 8))), message)
