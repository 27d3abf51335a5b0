"""Studies on real processes: a local Dask cluster, one on loopback, kills with -9, two studies on one store."""

import json
import os
import signal
import sqlite3
import subprocess
import sys
import time
from pathlib import Path

import pytest
from killed_client import is_alive, worker_ends_with

from papilla.core.errors import InputError, MissingExtraError
from papilla.design import running
from papilla.design.batch import version
from papilla.design.store import Store
from papilla.design.study import read_study

pytestmark = pytest.mark.slow

STUDY = """
name = "real"
objectives = ["sigma_sd"]
[free]
"outer.modulus_MPa" = [0.15, 0.36]
"gauges.lever_mm" = [-1.0, 0.0]
[couplings]
"inner.modulus_MPa" = "outer.modulus_MPa / 4"
[sampler]
designs = 200
"""


@pytest.fixture(scope="module")
def study_file(tmp_path_factory):
    """A study of one geometry, which is in the cache afterwards."""
    path = tmp_path_factory.mktemp("cluster") / "study.toml"
    path.write_text(STUDY)
    study = read_study(path)
    study.in_scene(study.finger)
    return path


PROGRAM = """
import json, sys
from pathlib import Path
from papilla.design.running import run
from papilla.design.store import Store
from papilla.design.study import read_study
done = run(read_study(Path(sys.argv[1])), Store(Path(sys.argv[2])), workers=1)
print(json.dumps({"designs": done.designs, "reused": done.reused, "failed": done.failed}))
"""


def client_of(path: Path, store: Path) -> subprocess.Popen:
    """A study that runs into a store, as a process of its own with one worker."""
    arguments = [sys.executable, "-c", PROGRAM, str(path), str(store)]
    return subprocess.Popen(arguments, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def answer(client: subprocess.Popen) -> dict:
    """What it says at its end."""
    told, said = client.communicate(timeout=900)
    assert client.returncode == 0, said
    return json.loads(told)


def stored(store: Path) -> int:
    """Designs in a store, while others write to it."""
    try:
        with sqlite3.connect(store) as connection:
            return connection.execute("SELECT count(*) FROM designs").fetchone()[0]
    except sqlite3.OperationalError:
        return 0


def wait_for(condition, seconds: float = 180.0) -> None:
    """Until it holds."""
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "nothing came"
        time.sleep(0.05)


def children(parent: int) -> list[int]:
    """Processes below a process."""
    found = []
    for entry in Path("/proc").glob("[0-9]*"):
        try:
            fields = (entry / "stat").read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if int(fields[1]) == parent:
            found += [int(entry.name), *children(int(entry.name))]
    return found


def workers_of(client: int) -> list[int]:
    """Processes of a client's cluster that compute."""
    lines = {
        pid: Path(f"/proc/{pid}/cmdline").read_bytes() for pid in children(client) if Path(f"/proc/{pid}").exists()
    }
    return [pid for pid, line in lines.items() if b"spawn_main" in line]


def test_a_killed_client_loses_at_most_what_is_in_flight_and_a_resume_repeats_nothing(study_file, tmp_path):
    store = tmp_path / "store.sqlite"
    client = client_of(study_file, store)
    wait_for(lambda: stored(store) > 0 or client.poll() is not None)
    orphans = children(client.pid)
    os.kill(client.pid, signal.SIGKILL)
    client.communicate()
    before = stored(store)
    assert 0 < before < 200
    wait_for(lambda: not any(is_alive(pid) for pid in orphans))
    assert answer(client_of(study_file, store)) == {"designs": 200, "reused": before, "failed": 0}


def test_a_killed_worker_is_replaced(study_file, tmp_path):
    store = tmp_path / "store.sqlite"
    client = client_of(study_file, store)
    wait_for(lambda: stored(store) > 0 or client.poll() is not None)
    killed = workers_of(client.pid)
    assert killed
    os.kill(killed[-1], signal.SIGKILL)
    assert answer(client) == {"designs": 200, "reused": 0, "failed": 0}


def test_two_studies_at_once_share_one_store(study_file, tmp_path):
    store = tmp_path / "shared.sqlite"
    for name in ("one", "two"):
        (tmp_path / f"{name}.toml").write_text(STUDY.replace('"real"', f'"{name}"'))
    clients = [client_of(tmp_path / f"{name}.toml", store) for name in ("one", "two")]
    assert [answer(client)["designs"] for client in clients] == [200, 200]
    with sqlite3.connect(store) as connection:
        assert connection.execute("SELECT count(*) FROM records").fetchone() == (200,)
        assert connection.execute("SELECT count(*) FROM designs").fetchone() == (400,)


def test_a_scheduler_with_two_workers_on_loopback(study_file, tmp_path):
    address = "tcp://127.0.0.1:18786"
    dask = [sys.executable, "-m", "dask"]
    processes = [subprocess.Popen([*dask, "scheduler", "--host", "127.0.0.1", "--port", "18786", "--no-dashboard"])]
    try:
        for _ in range(2):
            processes.append(subprocess.Popen([*dask, "worker", address, "--nthreads", "1", "--no-dashboard"]))
        wait_for(lambda: _workers(address) == 2)
        found = running.run(read_study(study_file), Store(tmp_path / "store.sqlite"), scheduler=address)
        assert (found.workers, found.designs, found.failed) == (2, 200, 0)
    finally:
        for process in processes:
            process.terminate()
        for process in processes:
            process.wait(timeout=30)


def _workers(address: str) -> int:
    from distributed import Client

    try:
        with Client(address, timeout=2) as client:
            return len(client.nthreads())
    except OSError:
        return 0


def test_workers_of_another_version_are_refused(study_file, tmp_path, monkeypatch):
    ours = version()
    monkeypatch.setattr(running, "version", lambda: "9.9.9 (other)")
    with pytest.raises(InputError, match="this client has 9.9.9") as refused:
        running.run(read_study(study_file), Store(tmp_path / "store.sqlite"), workers=1)
    assert ours in str(refused.value)


def test_without_dask_plain_processes_do_the_same_and_a_scheduler_needs_it(study_file, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    study = read_study(study_file)
    found = running.run(study, Store(tmp_path / "store.sqlite"), workers=1)
    assert "without Dask" in found.how and (found.designs, found.failed) == (200, 0)
    with pytest.raises(MissingExtraError, match=r"papilla\[cluster\]"), running.pool(1, "tcp://127.0.0.1:1"):
        pass


CLIENT = """
import os, sys, time
sys.modules["distributed"] = None
from papilla.design.running import pool
if __name__ == "__main__":
    with pool(1, None) as found:
        print(found.executor.submit(os.getpid).result(), flush=True)
        time.sleep(600)
"""


def test_plain_processes_end_with_a_client_that_is_killed(tmp_path):
    program = tmp_path / "client.py"
    program.write_text(CLIENT)
    assert worker_ends_with(program)
