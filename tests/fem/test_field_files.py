"""The field of a press as a file that other tools read."""

import meshio
import numpy as np
import pytest

from papilla.fem import Field
from papilla.fem.fields import save_field
from papilla.mesh import build
from papilla.model.finger import Finger


@pytest.fixture(scope="module")
def field():
    mesh = build(Finger.default())
    strain = np.arange(9 * len(mesh.tets), dtype=float).reshape(-1, 3, 3)
    strain += strain.transpose(0, 2, 1)
    return Field(mesh, 0.1 * mesh.points, strain, 2 * strain)


def test_it_comes_back_with_its_tensor_in_paraviews_order(field, tmp_path):
    save_field(field, tmp_path / "field.vtu")
    back = meshio.vtu.read(str(tmp_path / "field.vtu"))
    assert np.array_equal(back.points, field.mesh.points)
    assert np.array_equal(back.point_data["displacement_mm"], field.displacement)
    strain = back.cell_data["strain"][0]
    for k, (row, column) in enumerate(((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))):
        assert np.array_equal(strain[:, k], field.strain[:, row, column])
    assert np.array_equal(back.cell_data["stress_MPa"][0], 2 * strain)
    assert np.array_equal(back.cell_data["layer"][0], field.mesh.layer)
