"""Faces, components, volumes and quality figures of small meshes that can be counted by hand."""

from dataclasses import replace

import numpy as np
import pytest

from papilla.mesh import BOUNDARY_NAMES, INNER_LAYER, OUTER_LAYER, LayeredMesh
from papilla.mesh.cells import FACES_OF_TET, components, dihedral_angles, mean_ratio, paired_faces, quality, volumes
from papilla.mesh.layered import mirrored, pack, unpack

CORNER = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
PAIR = np.vstack([CORNER, [[1, 1, 1.0]]])
TWO = np.array([[0, 1, 2, 3], [4, 2, 1, 3]])
"""Two cells that share the face 1, 2, 3."""


def test_the_shared_face_has_two_cells_and_every_face_stands_once():
    faces, cells = paired_faces(TWO)
    assert len(faces) == 7 and np.sum(cells[:, 1] >= 0) == 1
    shared = cells[:, 1] >= 0
    assert set(faces[shared][0].tolist()) == {1, 2, 3} and cells[shared][0].tolist() == [0, 1]
    assert all(
        face in TWO[owner][FACES_OF_TET].tolist() for face, owner in zip(faces.tolist(), cells[:, 0], strict=True)
    )
    assert {tuple(sorted(face)) for face in faces.tolist()} == {
        tuple(sorted(face)) for tet in TWO for face in tet[FACES_OF_TET].tolist()
    }
    # Cells without a common face are components
    apart = np.array([[0, 1, 2, 3], [4, 5, 6, 7], [5, 4, 6, 8]])
    assert components(paired_faces(apart)[1], 3).tolist() == [0, 1, 1]
    assert components(paired_faces(TWO)[1], 2).tolist() == [0, 0]

    many = 2**20 + 5
    assert len(paired_faces([[0, many, many + 1, many + 2], [1, many, many + 1, many + 3]])[0]) == 8
    assert np.sum(paired_faces([[0, many, many + 1, many + 2], [1, many, many + 1, many + 2]])[1] >= 0) == 8


def layered() -> LayeredMesh:
    boundaries = {"skin": np.array([[0, 2, 1]]), "interface": np.array([[1, 2, 3]]), "base": np.array([[4, 2, 1]])}
    return LayeredMesh(PAIR, TWO, np.array([OUTER_LAYER, INNER_LAYER]), boundaries, 1.5)


def test_two_mirrors_make_four_of_each_cell_and_one_of_each_point_on_a_plane():
    whole = mirrored(layered(), ("x", "y"))
    assert len(whole.tets) == 8 and len(whole.points) == 5 + 2 + 3
    assert np.array_equal(whole.points[:5], PAIR) and np.array_equal(whole.tets[:2], TWO)
    assert volumes(whole.points, whole.tets) == pytest.approx([1 / 6, 1 / 3] * 4)
    assert whole.layer.tolist() == [OUTER_LAYER, INNER_LAYER] * 4
    assert whole.mirrors == ("x", "y") and whole.size_mm == 1.5
    for name in BOUNDARY_NAMES:
        assert len(whole.boundaries[name]) == 4 * len(layered().boundaries[name])
    skin = whole.points[whole.boundaries["skin"]]
    normals = np.cross(skin[:, 1] - skin[:, 0], skin[:, 2] - skin[:, 0])
    assert np.all(normals[:, 2] < 0), "they still point out"
    assert np.array_equal(whole.cell().points, PAIR) and np.array_equal(whole.cell().tets, TWO)
    assert unpack(pack(whole)).sha256 == whole.sha256


def test_a_scaled_mesh_has_longer_edges_and_a_straight_one_no_bent_ones():
    bent = replace(layered(), edges=np.array([[1, 2]]), middles=np.array([[0.6, 0.6, 0.0]]))
    longer = mirrored(bent, ("x",)).scaled(3.0)
    assert longer.size_mm == 4.5 and longer.mirrors == ("x",)
    assert longer.middles == pytest.approx(np.array([[1.8, 1.8, 0], [-1.8, 1.8, 0]]))
    assert volumes(longer.points, longer.tets) == pytest.approx([4.5, 9.0] * 2)
    assert np.array_equal(longer.cell().middles, 3 * bent.middles)
    assert np.array_equal(longer.points[longer.edges].mean(axis=1), [[1.5, 1.5, 0], [-1.5, 1.5, 0]])
    assert longer.straight().edges.shape == (0, 2) and longer.straight().middles.shape == (0, 3)


def test_each_part_of_a_mesh_counts_in_its_hash():
    mesh = replace(layered(), edges=np.array([[0, 1]]), middles=np.array([[0.5, 0.1, 0.0]]))
    arrays, odd = pack(mesh), {"mirrors": np.array("xy"), "layer": mesh.layer[::-1]}
    hashes = {unpack(arrays | {name: odd[name] if name in odd else arrays[name] + 1}).sha256 for name in arrays}
    assert len(hashes - {mesh.sha256}) == len(arrays)


CORNERS = np.array([[0, 0, 0], [3, 0, 0], [0, 4, 0], [0, 0, 12], [0, 0, -6]], float) + [100.0, 50.0, -20.0]
TETS = np.array([[0, 1, 2, 3], [0, 2, 1, 4]])


def test_figures_of_two_cells():
    found = quality(replace(layered(), points=CORNERS, tets=TETS))
    assert (found["cells"], found["points"]) == (2, 5)
    assert found["volume_mm3"] == pytest.approx({"outer": 24, "inner": 12})
    assert found["edge_min_mm"] == pytest.approx(3) and found["edge_max_mm"] == pytest.approx(np.hypot(4, 12))
    # Squared edges: 9 + 16 + 25 below, then those to the tip
    ratios = [12 * (3 * v) ** (2 / 3) / squares for v, squares in ((24, 50 + 144 + 153 + 160), (12, 50 + 36 + 45 + 52))]
    assert mean_ratio(CORNERS, TETS) == pytest.approx(ratios)
    assert found["mean_ratio_min"] == pytest.approx(min(ratios))
    assert found["mean_ratio_mean"] == pytest.approx(np.mean(ratios))
    # Three right angles each; the others by the sloping face's normal (1/3, 1/4, 1/h)
    sloping = [np.array([1 / 3, 1 / 4, 1 / h]) for h in (12, 6)]
    angles = np.concatenate([np.degrees(np.arccos(n / np.linalg.norm(n))) for n in sloping])
    assert found["dihedral_min_deg"] == pytest.approx(angles.min())
    assert found["dihedral_max_deg"] == pytest.approx(90)
    expected = np.sort(np.append(angles, [90] * 6).reshape(-1))
    assert np.sort(dihedral_angles(CORNERS, TETS).ravel()) == pytest.approx(expected)
    assert volumes(CORNERS, TETS[:, [1, 0, 2, 3]]) == pytest.approx([-24, -12])
    assert mean_ratio(CORNERS, TETS[:, [1, 0, 2, 3]]) == pytest.approx(-mean_ratio(CORNERS, TETS))
