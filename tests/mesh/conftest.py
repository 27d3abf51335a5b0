"""A cache of each test's own, and what stands in for the mesher."""

import subprocess

import numpy as np
import pytest

from papilla.core.errors import MeshError
from papilla.model.finger import Finger, Gauge, Layer


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
    """Makes a finger of a shape, with a gauge at its apex; `bone` may be given."""

    def make(shape, bone=None) -> Finger:
        return Finger("test", shape, Layer(0.136), Layer(0.034), (Gauge("g1", x_mm=0.0),), bone=bone)

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
