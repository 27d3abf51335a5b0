"""Faces, components, volumes and quality figures of small meshes that can be counted by hand."""

from dataclasses import replace

import numpy as np
import pytest

from papilla.mesh import BOUNDARY_NAMES, INNER_LAYER, OUTER_LAYER, LayeredMesh
from papilla.mesh.cells import FACES_OF_TET, components, paired_faces, volumes
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
    for face, owner in zip(faces, cells[:, 0], strict=True):
        assert tuple(face) in {tuple(tet) for tet in TWO[owner][FACES_OF_TET].tolist()}
    assert {tuple(sorted(face)) for face in faces.tolist()} == {
        tuple(sorted(face)) for tet in TWO for face in tet[FACES_OF_TET].tolist()
    }


def test_cells_without_a_common_face_are_components():
    apart = np.array([[0, 1, 2, 3], [4, 5, 6, 7], [5, 4, 6, 8]])
    assert components(paired_faces(apart)[1], 3).tolist() == [0, 1, 1]
    assert components(paired_faces(TWO)[1], 2).tolist() == [0, 0]


def layered(layer=(OUTER_LAYER, INNER_LAYER)) -> LayeredMesh:
    boundaries = {"skin": [[0, 2, 1]], "interface": [[1, 2, 3]], "base": [[4, 2, 1]]}
    return LayeredMesh(PAIR, TWO, np.array(layer), {name: np.array(faces) for name, faces in boundaries.items()}, 1.5)


def test_two_mirrors_make_four_of_each_cell_and_one_of_each_point_on_a_plane():
    whole = mirrored(layered(), ("x", "y"))
    assert len(whole.tets) == 8 and len(whole.points) == 5 + 2 + 3
    assert np.array_equal(whole.points[:5], PAIR) and np.array_equal(whole.tets[:2], TWO)
    assert volumes(whole.points, whole.tets) == pytest.approx([1 / 6, 1 / 3] * 4)
    assert (
        whole.layer.tolist() == [OUTER_LAYER, INNER_LAYER] * 4 and whole.mirrors == ("x", "y") and whole.size_mm == 1.5
    )
    for name in BOUNDARY_NAMES:
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
