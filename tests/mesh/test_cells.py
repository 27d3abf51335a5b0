"""Faces, components, volumes and quality figures of small meshes that can be counted by hand."""

from dataclasses import replace

import numpy as np
import pytest

from papilla.mesh import BONE, BOUNDARIES, INNER, OUTER, LayeredMesh, quality
from papilla.mesh.cells import (
    FACES_OF_TET,
    compact,
    components,
    dihedral_angles,
    edge_lengths,
    edges_of,
    mean_ratio,
    paired_faces,
    places,
    volumes,
)
from papilla.mesh.layered import mirrored, pack, unpack

CORNER = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
PAIR = np.vstack([CORNER, [[1, 1, 1.0]]])
TWO = np.array([[0, 1, 2, 3], [4, 2, 1, 3]])
"""Two cells that share the face 1, 2, 3."""


def test_faces_point_out_of_their_cell():
    tet = np.array([[0, 1, 2, 3]])
    assert volumes(CORNER, tet).tolist() == [pytest.approx(1 / 6)]
    for opposite, face in enumerate(FACES_OF_TET):
        a, b, c = CORNER[face]
        assert np.dot(np.cross(b - a, c - a), a - CORNER[opposite]) > 0


def test_the_shared_face_has_two_cells_and_every_face_stands_once():
    faces, cells = paired_faces(TWO)
    assert len(faces) == 7 and np.sum(cells[:, 1] >= 0) == 1
    shared = cells[:, 1] >= 0
    assert set(faces[shared][0].tolist()) == {1, 2, 3} and cells[shared][0].tolist() == [0, 1]
    for face, owner in zip(faces, cells[:, 0], strict=True):
        assert tuple(face) in {tuple(tet) for tet in TWO[owner][FACES_OF_TET].tolist()}
    assert {tuple(sorted(face)) for face in faces.tolist()} == {
        tuple(sorted(face)) for tet in TWO for face in tet[FACES_OF_TET].tolist()
    }


def test_cells_without_a_common_face_are_components():
    apart = np.array([[0, 1, 2, 3], [4, 5, 6, 7], [5, 4, 6, 8]])
    assert components(paired_faces(apart)[1], 3).tolist() == [0, 1, 1]
    assert components(paired_faces(TWO)[1], 2).tolist() == [0, 0]


def test_compact_leaves_out_what_no_cell_uses():
    points, tets = compact(np.vstack([[[9, 9, 9.0]], PAIR, [[8, 8, 8.0]]]), TWO + 1)
    assert np.array_equal(points, PAIR) and np.array_equal(tets, TWO)


def test_mean_ratio_and_angles_follow_the_published_formula():
    flat = CORNER * [1, 1, 0.3]
    edges = np.array([1, 1, 0.09, 2, 1.09, 1.09])
    assert mean_ratio(flat, np.array([[0, 1, 2, 3]])) == pytest.approx(12 * (3 * 0.05) ** (2 / 3) / edges.sum())
    slope = np.degrees(np.arccos(1 / np.sqrt(1 + 2 / 0.3**-2)))
    angles = np.sort(dihedral_angles(flat, np.array([[0, 1, 2, 3]]))[0])
    assert angles[3:] == pytest.approx([90, 90, 90])
    normal = np.array([0.3, 0.3, 1]) / np.linalg.norm([0.3, 0.3, 1])
    assert angles[:3] == pytest.approx(np.degrees(np.arccos([normal[2], normal[0], normal[1]])).tolist()) and slope > 0


def layered(layer=(OUTER, INNER)) -> LayeredMesh:
    boundaries = {"skin": [[0, 2, 1]], "interface": [[1, 2, 3]], "base": [[4, 2, 1]]}
    return LayeredMesh(PAIR, TWO, np.array(layer), {name: np.array(faces) for name, faces in boundaries.items()}, 1.5)


def test_quality_figures_of_two_cells():
    figures = quality(layered((INNER, BONE)))
    assert figures["cells"] == 2 and figures["points"] == 5
    regular, corner = 1.0, 12 * 0.5 ** (2 / 3) / 9
    found = sorted(mean_ratio(PAIR, TWO))
    assert volumes(PAIR, TWO) == pytest.approx([1 / 6, 1 / 3]) and found == pytest.approx([corner, regular], rel=1e-12)
    assert figures["mean_ratio_min"] == pytest.approx(corner)
    assert figures["mean_ratio_mean"] == pytest.approx((corner + regular) / 2)
    assert figures["edge_min_mm"] == 1.0 and figures["edge_max_mm"] == pytest.approx(np.sqrt(2))
    assert figures["dihedral_min_deg"] == pytest.approx(np.degrees(np.arccos(1 / np.sqrt(3))))
    assert figures["dihedral_max_deg"] == pytest.approx(90)
    assert figures["volume_mm3"] == {"inner": pytest.approx(1 / 6), "bone": pytest.approx(1 / 3)}


def test_two_mirrors_make_four_of_each_cell_and_one_of_each_point_on_a_plane():
    whole = mirrored(layered(), ("x", "y"))
    assert len(whole.tets) == 8 and len(whole.points) == 5 + 2 + 3
    assert np.array_equal(whole.points[:5], PAIR) and np.array_equal(whole.tets[:2], TWO)
    assert volumes(whole.points, whole.tets) == pytest.approx([1 / 6, 1 / 3] * 4)
    assert whole.layer.tolist() == [OUTER, INNER] * 4 and whole.mirrors == ("x", "y") and whole.size_mm == 1.5
    for name in BOUNDARIES:
        assert len(whole.boundaries[name]) == 4 * len(layered().boundaries[name])
    skin = whole.points[whole.boundaries["skin"]]
    normals = np.cross(skin[:, 1] - skin[:, 0], skin[:, 2] - skin[:, 0])
    assert np.all(normals[:, 2] < 0), "they still point out"
    assert np.array_equal(whole.cell().points, PAIR) and np.array_equal(whole.cell().tets, TWO)
    again = unpack(pack(whole))
    assert again.sha256 == whole.sha256 and again.mirrors == whole.mirrors


def test_each_part_of_a_mesh_counts_in_its_hash():
    mesh = replace(layered(), edges=np.array([[0, 1]]), middles=np.array([[0.5, 0.1, 0.0]]))
    arrays = pack(mesh)
    hashes = {mesh.sha256}
    for name, array in arrays.items():
        changed = arrays | {name: np.array("xy") if name == "mirrors" else array + (1 if name != "layer" else 0)}
        if name == "layer":
            changed = arrays | {"layer": array[::-1]}
        hashes.add(unpack(changed).sha256)
    assert len(hashes) == 1 + len(arrays)


def test_a_simplex_is_found_whatever_the_order_of_its_vertices():
    among = np.array([[7, 2, 9], [0, 1, 2], [9, 8, 0]])
    wanted = np.array([[[2, 1, 0], [9, 7, 2]], [[0, 8, 9], [7, 2, 8]]])
    assert places(wanted, among, 10).tolist() == [[1, 0], [2, -1]]
    assert places(np.array([[1, 0], [0, 9], [9, 9]]), np.array([[0, 1], [8, 9]]), 10).tolist() == [0, -1, -1]


def test_edges_of_triangles_and_cells():
    assert edges_of(np.array([[4, 7, 5]])).tolist() == [[[4, 7], [7, 5], [5, 4]]]
    corners = np.array([[0, 0, 0], [3, 0, 0], [0, 4, 0], [0, 0, 12]], float)
    assert edge_lengths(corners, np.arange(4)[None])[0] == pytest.approx([3, 4, 12, 5, np.sqrt(153), np.sqrt(160)])
