"""Processes of the mesher and the readers: what goes wrong there is one clear error, and nothing is left behind."""

import os
import select
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from papilla.core.errors import MeshError
from papilla.mesh import child
from papilla.mesh.child import tetrahedralise

SOUP = {"vertices": np.zeros((4, 3))}


@pytest.fixture
def hanging(tmp_path):
    """Source of a worker that never ends, and the pipe that tells its process and folder, and closes when it ends."""
    os.mkfifo(tmp_path / "alive")
    source = (
        "import os, threading\n"
        f"pipe = open({str(tmp_path / 'alive')!r}, 'w')\n"
        "print(os.getpid(), os.getcwd(), file=pipe, flush=True)\n"
        "threading.Event().wait()\n"
    )
    pipe = os.open(tmp_path / "alive", os.O_RDONLY | os.O_NONBLOCK)
    yield source, pipe
    os.close(pipe)


def line_of(pipe) -> str:
    select.select([pipe], [], [])
    os.set_blocking(pipe, True)
    return os.read(pipe, 4096).decode()


def wait_for_end(pipe) -> None:
    os.set_blocking(pipe, True)
    while os.read(pipe, 4096):
        pass


@pytest.mark.parametrize(
    ("end", "message"),
    [
        (
            "print('first')\nsys.exit('out of luck at triangle 7')",
            r"\(exit code 1\): first / out of luck at triangle 7",
        ),
        ("os.kill(os.getpid(), signal.SIGKILL)", "signal 9"),
    ],
)
def test_a_crash_names_the_cause_and_leaves_nothing_behind(worker, tmp_path, end, message):
    told = tmp_path / "folder.txt"
    stray = f"open('__tracked_surface.stl', 'w').close()\nopen({str(told)!r}, 'w').write(os.getcwd())\n"
    worker(f"import os, signal, sys\n{stray}{end}\n")
    before = set(os.listdir())
    with pytest.raises(MeshError, match=f"mesher failed .*{message}") as caught:
        tetrahedralise(SOUP)
    assert "\n" not in str(caught.value)
    assert not Path(told.read_text()).exists() and set(os.listdir()) == before


POINTS, TETS = "points=np.ones((4, 3))", "tets=np.zeros((2, 4), int)"


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        (POINTS, "tets of shape"),
        (TETS, "points of shape"),
        (f"points=np.ones((4, 2)), {TETS}", r"points of shape \(4, 2\)"),
        (f"points=np.full((4, 3), np.nan), {TETS}", "not finite"),
        (f"{POINTS}, tets=np.zeros((2, 3), int)", r"tets of shape \(2, 3\)"),
        (f"{POINTS}, tets=np.zeros((2, 4))", "not whole numbers"),
        (f"{POINTS}, tets=np.full((2, 4), 4)", "corner that is not among its 4 points"),
        (f"{POINTS}, tets=np.full((2, 4), -1)", "corner that is not among"),
        (f"{POINTS}, tets=np.zeros((0, 4), int)", "no tetrahedra"),
    ],
)
def test_what_a_child_returns_is_checked(worker, arrays, message):
    worker(f"import numpy as np\nnp.savez('output.npz', {arrays})\n")
    with pytest.raises(MeshError, match=f"the mesher returned .*{message}") as caught:
        tetrahedralise(SOUP)
    assert "\n" not in str(caught.value)


def test_hang_is_stopped(worker, hanging):
    source, pipe = hanging
    worker(source)
    with pytest.raises(MeshError, match="did not finish within 0 s"):
        tetrahedralise(SOUP, timeout_s=0.0)
    wait_for_end(pipe)


def test_ctrl_c_ends_the_child(worker, hanging):
    source, pipe = hanging
    worker(source)
    folders = []

    def interrupt(_line):
        folders.append(Path(line_of(pipe).split()[1]))
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        tetrahedralise(SOUP, interrupt)
    wait_for_end(pipe)
    assert not folders[0].exists()


PARENT = """
import sys
import numpy as np
import subprocess
from papilla.core import seams
from papilla.mesh import child
seams.start = lambda command, **options: subprocess.Popen([*command[:-2], sys.argv[1], command[-1]], **options)
child.tetrahedralise({"vertices": np.zeros((4, 3))})
"""


@pytest.mark.skipif(sys.platform != "linux", reason="Linux alone kills a child whose parent has died")
@pytest.mark.parametrize("name", ["SIGTERM", "SIGHUP", "SIGKILL", "SIGINT"])
def test_a_killed_parent_leaves_no_child(name, worker, hanging, tmp_path):
    source, pipe = hanging
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    worker("from papilla.mesh.worker import end_with_parent\nend_with_parent()\n" + source)
    environment = {**os.environ, "TMPDIR": str(scratch), "PYTHONPATH": str(Path(child.__file__).parents[2])}
    command = [sys.executable, "-c", PARENT, str(tmp_path / "stand_in_worker.py")]
    number = getattr(signal, name)
    # Under nohup, and in the background of a script, signals are ignored, and a child inherits that
    heard = (lambda: signal.signal(number, signal.SIG_DFL)) if name != "SIGKILL" else None
    parent = subprocess.Popen(
        command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, preexec_fn=heard
    )
    _, folder = line_of(pipe).split()
    assert Path(folder).parent == scratch
    parent.send_signal(number)
    parent.communicate()
    assert parent.returncode != 0
    wait_for_end(pipe)
    worker("raise SystemExit(3)")  # The next call removes the folder, too
    assert subprocess.run(command, env=environment, capture_output=True, check=False).returncode != 0
    assert list(scratch.iterdir()) == []
