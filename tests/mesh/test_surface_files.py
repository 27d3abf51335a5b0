"""Surface files of the user: read exactly, refused with one clear line, meshed like the shape they copy."""

import re
import shutil
from dataclasses import replace

import numpy as np
import pytest

from papilla.core.errors import FileAccessError, FileFormatError, InputError, PapillaError
from papilla.mesh import INNER, OUTER, build
from papilla.mesh.body import facet_deviation, surfaces_of
from papilla.mesh.cells import volumes
from papilla.mesh.drawing import drawn
from papilla.mesh.surface_files import read_closed, read_nested
from papilla.mesh.surfaces import Ellipsoid, TriangleSurface
from papilla.model.finger import DEFAULT_FINGER, Finger, Gauge, Layer, Surfaces

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


@pytest.mark.slow
@pytest.mark.parametrize("suffix", [".stl", ".ply", ".vtp"])
def test_formats(suffix, files):
    skin = read_nested(files(suffix))[0]
    exact = Ellipsoid(AXES["outer"])
    assert np.abs(exact.level(skin.vertices[skin.vertices[:, 2] > 0.1])).max() < 1e-5
    corners = skin.vertices[skin.triangles]
    assert np.linalg.det(corners).sum() / 6 == pytest.approx(2 / 3 * np.pi * 24 * 30 * 20, rel=0.01)


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


@pytest.mark.parametrize("divisions", [10, 20, 40])
def test_facets_deviate_by_what_they_cut_off(divisions, half_ellipsoid):
    vertices, triangles = half_ellipsoid(AXES["outer"], divisions)
    surface = TriangleSurface(vertices, triangles, 0.0, 1e-5)
    apex = np.array([0, 0, 20.0])
    centres = vertices[triangles].mean(axis=1)
    size = np.linalg.norm(vertices[triangles] - centres[:, None], axis=2).max(axis=1)
    near = np.linalg.norm(centres - apex, axis=1) <= 8 + size
    cut_off = -Ellipsoid(AXES["outer"]).level(centres[near]).min()
    assert facet_deviation(surface, apex, 8.0) == pytest.approx(cut_off, rel=0.1)
    assert facet_deviation(surface, np.array([0, 0, -5.0]), 1.0) == 0.0, "the base is flat"
    assert facet_deviation(Ellipsoid(AXES["outer"]), apex, 8.0) == 0.0


def test_height_has_no_gaps_on_edges_and_vertices(files):
    surface = read_nested(files())[0]
    upper = surface.vertices[surface.vertices[:, 2] > 0.1]
    assert np.abs(surface.height(upper[:, :2]) - upper[:, 2]).max() < 1e-6


def test_inside_out_triangles_are_turned(tmp_path, half_ellipsoid, write_surface):
    vertices, triangles = half_ellipsoid(AXES["outer"], 8)
    triangles = triangles.copy()
    triangles[::3] = triangles[::3, ::-1]
    path = write_surface(tmp_path / "mixed.ply", vertices, triangles)
    again = read_closed(path)
    assert np.linalg.det(again[0][again[1]]).sum() / 6 == pytest.approx(2 / 3 * np.pi * 24 * 30 * 20, rel=0.03)


def test_missing_file(tmp_path):
    with pytest.raises(FileAccessError, match=re.escape(str(tmp_path / "no.stl"))):
        read_closed(str(tmp_path / "no.stl"))


def test_folder_instead_of_file(tmp_path):
    (tmp_path / "folder.stl").mkdir()
    with pytest.raises(FileAccessError, match=re.escape("folder.stl")):
        read_closed(str(tmp_path / "folder.stl"))


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


def test_names_that_no_file_can_have():
    with pytest.raises(FileAccessError, match=r"cannot read surface file a\\0\.stl: embedded null"):
        read_closed("a\0.stl")


@pytest.mark.parametrize("suffix", [".stl", ".ply", ".vtp"])
@pytest.mark.parametrize("content", [b"", b"this is a shopping list\n" * 20, bytes(range(256)) * 4])
def test_garbage(tmp_path, suffix, content, capfd):
    path = tmp_path / f"garbage{suffix}"
    path.write_bytes(content)
    refused(str(path), "holds no triangles|not a readable|is flat|not finite|open")
    assert capfd.readouterr() == ("", "")


def test_unknown_suffix(tmp_path):
    (tmp_path / "dome.obj").write_text("v 0 0 0\n")
    refused(str(tmp_path / "dome.obj"), r"\.stl, \.ply, \.vtp")


def test_open_surface(tmp_path, half_ellipsoid, write_surface):
    vertices, triangles = half_ellipsoid(AXES["outer"], 6)
    refused(write_surface(tmp_path / "open.stl", vertices, triangles[5:]), "is open: .* edges")


def test_non_manifold_surface(tmp_path, half_ellipsoid, write_surface):
    vertices, triangles = half_ellipsoid(AXES["outer"], 6)
    fin = [[*triangles[0][:2], len(vertices)], [*triangles[0][1::-1], len(vertices)]]
    path = write_surface(tmp_path / "fin.stl", np.vstack([vertices, [0, 0, 40]]), np.vstack([triangles, fin]))
    refused(path, "not a manifold|is open")


def test_flat_surface(tmp_path, write_surface):
    flat = np.array([[0, 0, 0], [20, 0, 0], [0, 20, 0.0], [5, 5, 0]])
    refused(write_surface(tmp_path / "flat.stl", flat, [[0, 1, 3], [1, 2, 3], [2, 0, 3], [0, 2, 1]]), "is flat")


@pytest.mark.parametrize("scale", [0.001, 1000.0])
def test_wrong_units(tmp_path, half_ellipsoid, write_surface, scale):
    vertices, triangles = half_ellipsoid(AXES["outer"], 6)
    refused(write_surface(tmp_path / "metre.stl", scale * vertices, triangles), "another unit")


def test_self_intersection(tmp_path, half_ellipsoid, write_surface):
    vertices, triangles = half_ellipsoid(AXES["outer"], 8)
    vertices = vertices.copy()
    vertices[vertices[:, 2].argmax(), 2] = -5.0
    refused(write_surface(tmp_path / "dented.stl", vertices, triangles), "intersects itself near")


def test_two_pieces(tmp_path, half_ellipsoid, write_surface):
    vertices, triangles = half_ellipsoid(AXES["bone"], 6)
    both = np.vstack([vertices, vertices + [60, 0, 0]])
    path = write_surface(tmp_path / "two.stl", both, np.vstack([triangles, triangles + len(vertices)]))
    refused(path, "more than one piece")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("axes", "wrong"),
    [
        ({"interface": (21.0, 27.0, 21.0)}, "interface"),
        ({"interface": (24.0, 30.0, 20.0)}, "interface"),
        ({"interface": (25.0, 27.0, 17.0)}, "interface"),
        ({"bone": (22.0, 16.0, 6.0)}, "bone"),
        ({"outer": (10.0, 12.0, 9.0)}, "interface"),
    ],
)
def test_wrong_nesting(files, axes, wrong):
    paths = files(**axes)
    refused(paths, rf"{wrong}\.stl: (is not inside|its base reaches beyond)", read=read_nested)


def test_swapped_files(files):
    outer, interface, bone = files()
    refused((interface, outer, bone), r"outer\.stl: is not inside .*interface\.stl", read=read_nested)


def test_interface_below_the_base(files, tmp_path, half_ellipsoid, write_surface):
    outer, interface, bone = files()
    vertices, triangles = half_ellipsoid(AXES["interface"], 8)
    low = write_surface(tmp_path / "low.stl", vertices - [0, 0, 1], triangles)
    refused((outer, low, bone), r"low\.stl: reaches below the base", read=read_nested)


def test_no_flat_base(tmp_path, files, write_surface):
    _, interface, bone = files()
    spike = np.array([[60, 0, 40], [-60, 60, 40], [-60, -60, 40], [0, 0, -60.0]])
    path = write_surface(tmp_path / "spike.stl", spike, [[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]])
    refused((path, interface, bone), "no flat base", read=read_nested)


def test_gauge_off_the_interface(files, finger_of):
    finger = finger_of(Surfaces(*files()), gauges=(Gauge("g1", x_mm=0.0), Gauge("g2", x_mm=21.5)))
    with pytest.raises(InputError, match=r"gauge g2 lies outside the interface"):
        surfaces_of(finger)


def test_finger_beside_the_origin(tmp_path, half_ellipsoid, write_surface, finger_of):
    moved = []
    for name, axes in AXES.items():
        vertices, triangles = half_ellipsoid(axes, 8)
        moved.append(write_surface(tmp_path / f"{name}.stl", vertices + [100, 0, 0], triangles))
    finger = finger_of(Surfaces(*moved), gauges=(Gauge("g1", x_mm=100.0),))
    with pytest.raises(InputError, match="nothing above x = 0, y = 0"):
        build(finger, 2.5)


def test_missing_file_stops_the_build(files, finger_of):
    outer, interface, _ = files()
    with pytest.raises(PapillaError, match=r"gone\.stl"):
        build(finger_of(Surfaces(outer, interface, "gone.stl")), 2.5)


@pytest.mark.slow
def test_the_example_that_ships_is_meshed_once_its_files_lie_beside_it(tmp_path, half_ellipsoid, write_surface):
    example = DEFAULT_FINGER.with_name("surfaces_finger.toml")
    shutil.copy(example, tmp_path)
    for name, axes in zip(("skin", "interface", "bone"), AXES.values(), strict=True):
        write_surface(tmp_path / f"{name}.stl", *half_ellipsoid(axes, 8))
    finger = Finger.load(tmp_path / example.name)
    assert finger.shape == Surfaces(*(str(tmp_path / f"{name}.stl") for name in ("skin", "interface", "bone")))
    mesh = build(finger, 4.0)
    assert set(mesh.layer) == {OUTER, INNER} and volumes(mesh.points, mesh.tets).min() > 0
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
    assert volume[mesh.layer == OUTER].sum() == pytest.approx(outer - interface, rel=0.01)
    assert volume[mesh.layer == INNER].sum() == pytest.approx(interface - bone, rel=0.01)
    surfaces = surfaces_of(finger)
    for name in ("skin", "interface"):
        on = mesh.points[np.unique(mesh.boundaries[name])]
        assert np.abs(surfaces[name].level(on)).max() < 1e-9
    base = mesh.points[np.unique(mesh.boundaries["base"])]
    raised = base[:, 2] > 0
    assert np.abs(surfaces["bone"].level(base[raised])).max() < 1e-9 and np.any(~raised)
