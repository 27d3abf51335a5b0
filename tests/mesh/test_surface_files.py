"""Surface files of the user: read exactly, refused with one clear line, meshed like the shape they copy."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from papilla.core.errors import FileFormatError
from papilla.mesh import INNER_LAYER, OUTER_LAYER, build
from papilla.mesh.body import surfaces_of
from papilla.mesh.cells import volumes
from papilla.mesh.drawing import merge, quarter_ellipsoid
from papilla.mesh.surface_files import read_closed
from papilla.mesh.surfaces import Ellipsoid
from papilla.model.finger import DEFAULT_FINGER, Finger, Layer

AXES = {"outer": (24.0, 30.0, 20.0), "interface": (21.0, 27.0, 17.0), "bone": (10.0, 16.0, 6.0)}


def half_ellipsoid(axes, divisions):
    """Vertices and triangles of a closed half ellipsoid with the given semi-axes."""
    vertices, triangles = quarter_ellipsoid(Ellipsoid(axes), divisions)
    corners = np.abs(vertices[triangles])
    outside = triangles[~np.any(np.all(corners[:, :, :2] < 1e-9, axis=1), axis=1)]
    return merge([(vertices * [sx, sy, 1], outside) for sx in (1, -1) for sy in (1, -1)])


@pytest.fixture
def files(tmp_path, write_surface):
    """Names of the three surface files of the default dome."""

    def make(suffix=".stl", divisions=14):
        return tuple(
            write_surface(tmp_path / f"{name}{suffix}", *half_ellipsoid(axes, divisions)) for name, axes in AXES.items()
        )

    return make


def refused(path, pattern):
    with pytest.raises(FileFormatError, match=pattern) as caught:
        read_closed(path)
    assert "\n" not in str(caught.value) and path in str(caught.value)


def test_inside_out_triangles_are_turned(tmp_path, write_surface):
    vertices, triangles = half_ellipsoid(AXES["outer"], 8)
    mixed = np.where(np.arange(len(triangles))[:, None] % 3 == 0, triangles[:, ::-1], triangles)
    again = read_closed(write_surface(tmp_path / "mixed.ply", vertices, mixed))
    assert np.linalg.det(again[0][again[1]]).sum() / 6 == pytest.approx(2 / 3 * np.pi * 24 * 30 * 20, rel=0.03)


def test_a_file_is_read_once_for_its_content_and_a_reader_that_crashes_cannot_read_it(files, worker):
    first = read_closed(files()[0])
    worker("import os, signal\nos.kill(os.getpid(), signal.SIGKILL)\n")
    again = read_closed(files()[0])
    assert np.array_equal(first[0], again[0]) and np.array_equal(first[1], again[1])
    refused(files()[1], r"interface\.stl: not a readable \.stl file$")


@pytest.mark.parametrize("suffix", [".stl", ".ply", ".vtp"])
@pytest.mark.parametrize("content", [b"", b"this is a shopping list\n" * 20, bytes(range(256)) * 4, 0.999, 0.6])
def test_garbage_and_a_truncated_file_are_one_line(files, suffix, content, capfd):
    """VTK's readers of binary PLY and VTP end the process on some of these."""
    path = Path(files(suffix, divisions=6)[0])
    whole = path.read_bytes()
    path.write_bytes(content if isinstance(content, bytes) else whole[: int(content * len(whole))])
    refused(str(path), "holds no triangles|not a readable|is flat|not finite|open|another unit|not a manifold")
    assert capfd.readouterr() == ("", "")


@pytest.mark.slow
def test_the_example_that_ships_is_meshed_once_its_files_lie_beside_it(tmp_path, write_surface):
    text = DEFAULT_FINGER.with_name("surfaces_finger.toml").read_text(encoding="utf-8")
    bone = "[bone]\nmodulus_MPa = 3000.0\nnu = 0.35"
    (tmp_path / "whole.toml").write_text(text.replace("# " + bone.replace("\n", "\n# "), bone), encoding="utf-8")
    assert Finger.load(tmp_path / "whole.toml").bone == Layer(3000.0, 0.35)
    (tmp_path / "finger.toml").write_text(text, encoding="utf-8")
    for name, axes in zip(("skin", "interface", "bone"), AXES.values(), strict=True):
        write_surface(tmp_path / f"{name}.stl", *half_ellipsoid(axes, 28))
    finger = Finger.load(tmp_path / "finger.toml")
    mesh = build(finger, 2.0)
    # Kept by content: another name and other moduli are the same mesh
    assert build(replace(finger, name="other", outer=Layer(0.2)), 2.0).sha256 == mesh.sha256
    outer, interface, bone = (2 / 3 * np.pi * np.prod(axes) for axes in AXES.values())
    volume = volumes(mesh.points, mesh.tets)
    assert volume.min() > 0 and mesh.mirrors == () and set(mesh.layer) == {OUTER_LAYER, INNER_LAYER}
    assert volume[mesh.layer == OUTER_LAYER].sum() == pytest.approx(outer - interface, rel=0.01)
    assert volume[mesh.layer == INNER_LAYER].sum() == pytest.approx(interface - bone, rel=0.01)
    surfaces = surfaces_of(finger)
    for name in ("skin", "interface"):
        on = mesh.points[np.unique(mesh.boundaries[name])]
        assert np.abs(surfaces[name].level(on)).max() < 1e-9


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
        (dented, "intersects itself near"),
        (twice, "more than one piece"),
    ],
)
def test_a_surface_that_bounds_no_body_is_one_line(tmp_path, write_surface, spoilt, message):
    refused(write_surface(tmp_path / "spoilt.stl", *spoilt(*half_ellipsoid(AXES["outer"], 8))), message)
