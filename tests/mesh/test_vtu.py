"""VTU files that are no layered mesh are refused with one clear line."""

import meshio
import numpy as np
import pytest

from papilla.errors import FileAccessError, FileFormatError
from papilla.mesh.vtu import load, save


def test_missing_file(tmp_path):
    with pytest.raises(FileAccessError, match="no.vtu"):
        load(tmp_path / "no.vtu")


@pytest.mark.parametrize("content", ["", "shopping list", "<VTKFile></VTKFile>"])
def test_garbage(tmp_path, content):
    path = tmp_path / "garbage.vtu"
    path.write_text(content)
    with pytest.raises(FileFormatError, match=r"garbage\.vtu is not a readable VTU file") as caught:
        load(path)
    assert "\n" not in str(caught.value)


def test_truncated(dome, tmp_path):
    path = tmp_path / "cut.vtu"
    save(dome, path)
    path.write_bytes(path.read_bytes()[:-5000])
    with pytest.raises(FileFormatError, match=r"cut\.vtu"):
        load(path)


def test_foreign_mesh(tmp_path):
    path = tmp_path / "foreign.vtu"
    cells = [("tetra", np.array([[0, 1, 2, 3]]))]
    points = np.vstack([np.zeros(3), np.eye(3)])
    meshio.vtu.write(str(path), meshio.Mesh(points, cells))
    with pytest.raises(FileFormatError, match="no cell data layer, boundary, size_mm, mirrors"):
        load(path)
    data = {key: [np.array([0])] for key in ("layer", "boundary", "size_mm", "mirrors")}
    meshio.vtu.write(str(path), meshio.Mesh(points, cells, cell_data=data))
    with pytest.raises(FileFormatError, match="lacks tetrahedra or one of skin, interface, base"):
        load(path)


def test_other_format_is_refused(dome, tmp_path):
    with pytest.raises(FileFormatError, match=r"\.vtu"):
        save(dome, tmp_path / "mesh.msh")
    assert not (tmp_path / "mesh.msh").exists()


def test_unwritable_folder(dome, tmp_path):
    with pytest.raises(FileAccessError, match="mesh.vtu"):
        save(dome, tmp_path / "none" / "mesh.vtu")
