"""The mesher's process: crash, hang and interruption become clear errors and leave no process behind."""

import os
import signal

import numpy as np
import pytest

from papilla.errors import MeshError
from papilla.mesh import tetwild
from papilla.mesh.tetwild import tetrahedralise

SOUP = {"vertices": np.zeros((4, 3))}
CRASH = "import sys\nprint('first')\nsys.exit('out of luck at triangle 7')\n"
HANG = "import os, sys, time\nopen(PLACE, 'w').write(str(os.getpid()))\ntime.sleep(600)\n"


@pytest.fixture
def worker(tmp_path, monkeypatch):
    """Installs source text as the mesher's worker."""

    def install(source):
        (tmp_path / "stand_in_worker.py").write_text(source)
        monkeypatch.setenv("PYTHONPATH", str(tmp_path))
        monkeypatch.setattr(tetwild, "WORKER", "stand_in_worker")

    return install


def assert_ended(pid_file):
    with pytest.raises(ProcessLookupError):
        os.kill(int(pid_file.read_text()), 0)


def test_crash_names_the_cause(worker):
    worker(CRASH)
    with pytest.raises(MeshError, match=r"mesher failed \(exit code 1\): first / out of luck at triangle 7") as caught:
        tetrahedralise(SOUP)
    assert "\n" not in str(caught.value)


def test_death_by_signal_is_named(worker):
    worker("import os, signal\nos.kill(os.getpid(), signal.SIGKILL)\n")
    with pytest.raises(MeshError, match="signal 9"):
        tetrahedralise(SOUP)


def test_success_without_a_mesh_is_an_error(worker):
    worker("pass\n")
    with pytest.raises(MeshError, match="it left no message"):
        tetrahedralise(SOUP)


def test_empty_mesh_is_an_error(worker):
    worker("import sys, numpy as np\nnp.savez(sys.argv[2], points=np.zeros((0, 3)), tets=np.zeros((0, 4), int))\n")
    with pytest.raises(MeshError, match="no tetrahedra"):
        tetrahedralise(SOUP)


def test_hang_is_stopped(worker, tmp_path):
    worker(HANG.replace("PLACE", repr(str(tmp_path / "pid"))))
    with pytest.raises(MeshError, match="did not finish within 1 s"):
        tetrahedralise(SOUP, timeout_s=1.0)
    assert_ended(tmp_path / "pid")


def test_ctrl_c_ends_the_child(worker, tmp_path):
    worker(HANG.replace("PLACE", repr(str(tmp_path / "pid"))))

    def interrupt(_line):
        if (tmp_path / "pid").exists() and (tmp_path / "pid").read_text():
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        tetrahedralise(SOUP, interrupt)
    assert_ended(tmp_path / "pid")


def test_nothing_is_left_behind(worker, tmp_path, monkeypatch):
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(scratch))
    worker("open('__tracked_surface.stl', 'w').close()\nraise SystemExit(3)\n")
    before = set(os.listdir())
    with pytest.raises(MeshError):
        tetrahedralise(SOUP)
    assert list(scratch.iterdir()) == [] and set(os.listdir()) == before


def test_heartbeat(worker):
    worker("import time\ntime.sleep(1.2)\nraise SystemExit(3)\n")
    lines = []
    with pytest.raises(MeshError):
        tetrahedralise(SOUP, lines.append)
    assert lines and all(line.startswith("meshing, ") and line.endswith(" s") for line in lines)
