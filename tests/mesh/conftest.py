"""Coarse meshes, made once, and a cache of each test's own."""

import subprocess

import numpy as np
import pytest

from papilla.core.errors import MeshError
from papilla.mesh.drawing import drawn
from papilla.model.finger import Dome, Finger, Gauge, Layer, Slab

COARSE_MM = 2.5


AT_APEX = (Gauge("g1", x_mm=0.0),)


def a_finger(shape, bone=None, gauges=AT_APEX) -> Finger:
    return Finger("test", shape, Layer(0.136), Layer(0.034), gauges, bone=bone)


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("PAPILLA_CACHE", str(tmp_path / "cache"))


@pytest.fixture
def no_mesher(monkeypatch):
    """Nothing is drawn: a build that asks for the mesher ends there."""

    def refuse(*_, **__):
        raise MeshError("the mesher was called")

    monkeypatch.setattr("papilla.core.seams.start", refuse)


@pytest.fixture
def worker(tmp_path, monkeypatch):
    """Function that puts a program in the place of the mesher and the readers: source text, which sees their folder."""

    def install(source):
        program = tmp_path / "stand_in_worker.py"
        program.write_text(source)

        def start(command, **options):
            return subprocess.Popen([*command[:-2], str(program), command[-1]], **options)

        monkeypatch.setattr("papilla.core.seams.start", start)

    return install


@pytest.fixture
def free(monkeypatch):
    """Set the free memory in bytes."""
    return lambda number: monkeypatch.setattr("papilla.core.seams.free_bytes", lambda: number)


@pytest.fixture(scope="session")
def finger_of():
    """Makes a finger of a shape; `bone` and `gauges` may be given."""
    return a_finger


@pytest.fixture(scope="session")
def dome_shape() -> Dome:
    return Dome((24.0, 30.0, 20.0), (21.0, 27.0, 17.0), (10.0, 16.0, 6.0))


@pytest.fixture(scope="session")
def slab_shape() -> Slab:
    return Slab((24.0, 20.0), (21.0, 17.0), (10.0, 6.0), depth=10.0)


@pytest.fixture(scope="session")
def dome(dome_shape):
    return drawn(a_finger(dome_shape), COARSE_MM)


@pytest.fixture(scope="session")
def dome_with_bone(dome_shape):
    return drawn(a_finger(dome_shape, bone=Layer(3000.0, 0.35)), COARSE_MM)


@pytest.fixture(scope="session")
def slab(slab_shape):
    return drawn(a_finger(slab_shape), COARSE_MM)


@pytest.fixture(scope="session")
def half_ellipsoid():
    """Vertices and triangles of a closed half ellipsoid with the given semi-axes."""
    from papilla.mesh.drawing import merge, quarter_ellipsoid
    from papilla.mesh.surfaces import Ellipsoid

    def make(axes, divisions):
        vertices, triangles = quarter_ellipsoid(Ellipsoid(axes), divisions)
        corners = np.abs(vertices[triangles])
        outside = triangles[~(np.all(corners[:, :, 0] < 1e-9, axis=1) | np.all(corners[:, :, 1] < 1e-9, axis=1))]
        return merge([(vertices * [sx, sy, 1], outside) for sx in (1, -1) for sy in (1, -1)])

    return make


@pytest.fixture(scope="session")
def write_surface():
    """Writes vertices and triangles to a surface file through VTK and returns its name."""
    import pyvista

    def write(path, vertices, triangles):
        faces = np.hstack([np.full((len(triangles), 1), 3), triangles]).ravel()
        pyvista.PolyData(np.asarray(vertices, dtype=float), faces).save(path)
        return str(path)

    return write
