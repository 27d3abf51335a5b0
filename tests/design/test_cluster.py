"""Studies on real processes: on this machine and of a scheduler, kills with -9, two studies on one store, ports."""

import json
import os
import re
import shutil
import signal
import sqlite3
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest
from killed_client import is_alive

from papilla.core.errors import InputError, PapillaError
from papilla.design import running
from papilla.design.cluster import Scheduler
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
    """Processes of a client that compute."""
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


# ---- Ports


def inodes(pid: int) -> set[str]:
    """The sockets that a process holds open."""
    found = set()
    for entry in Path(f"/proc/{pid}/fd").glob("*"):
        with suppress(OSError):
            found |= set(re.findall(r"socket:\[(\d+)\]", os.readlink(entry)))
    return found


def ports_of(parent: int) -> set[str]:
    """Where a process and those below it are reached, as the kernel writes it: TCP sockets that listen, all of UDP."""
    held = set().union(*(inodes(pid) for pid in (parent, *children(parent))))
    lines = {kind: Path("/proc/net", kind).read_text().splitlines()[1:] for kind in ("tcp", "tcp6", "udp", "udp6")}
    rows = [(kind, line.split()) for kind, some in lines.items() for line in some]
    return {f"{kind} {row[1]}" for kind, row in rows if row[9] in held and (row[3] == "0A" or kind.startswith("udp"))}


def command(*arguments: object) -> subprocess.Popen:
    """`papilla design` as a user runs it."""
    line = [sys.executable, "-m", "papilla", "design", *map(str, arguments)]
    return subprocess.Popen(line, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def watched(client: subprocess.Popen) -> tuple[set[str], set[int]]:
    """All ports that a client and its workers open until it ends, and the numbers of its workers."""
    ports, workers = set(), set()
    while client.poll() is None:
        ports |= ports_of(client.pid)
        workers |= set(workers_of(client.pid))
        time.sleep(0.02)
    return ports, workers


LISTENER = """
import socket, subprocess, sys
if len(sys.argv) < 2:
    sys.exit(subprocess.call([sys.executable, __file__, "below"]))
with socket.create_server(("127.0.0.1", 0)) as one, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
    other.bind(("127.0.0.1", 0))
    print("open", flush=True)
    sys.stdin.read()
"""


def test_a_port_of_a_process_below_is_found(tmp_path):
    """Otherwise the test below could not fail."""
    program = tmp_path / "listener.py"
    program.write_text(LISTENER)
    line = [sys.executable, str(program)]
    with subprocess.Popen(line, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as listener:
        assert listener.stdout.readline() == "open\n"
        assert sorted(port.split()[0] for port in ports_of(listener.pid)) == ["tcp", "udp"]
        listener.stdin.close()


def test_a_study_on_this_machine_opens_no_port(study_file, tmp_path):
    client = command(study_file, "--out", tmp_path / "out", "--workers", 2, "--json")
    ports, workers = watched(client)
    found = answer(client)
    assert (found["designs"], found["failed"], found["cost"]["workers"]) == (200, 0, 2)
    assert ports == set() and len(workers) == 2


# ---- A scheduler


@pytest.fixture(scope="module")
def certificates(tmp_path_factory):
    """Files of certificates of an authority for this cluster ("ours"), and of another one ("others")."""
    if shutil.which("openssl") is None:
        pytest.skip("certificates are made by openssl")
    folder = tmp_path_factory.mktemp("certificates")

    def openssl(*arguments: object) -> None:
        subprocess.run(["openssl", *map(str, arguments)], cwd=folder, check=True, capture_output=True)

    for name in ("ours", "others"):
        openssl("req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", 2, "-subj", f"/CN={name}",
                "-keyout", f"{name}-ca-key.pem", "-out", f"{name}-ca.pem")  # fmt: skip
        openssl("req", "-newkey", "rsa:2048", "-nodes", "-subj", "/CN=study",
                "-keyout", f"{name}-key.pem", "-out", f"{name}.csr")  # fmt: skip
        openssl("x509", "-req", "-in", f"{name}.csr", "-days", 2, "-CA", f"{name}-ca.pem",
                "-CAkey", f"{name}-ca-key.pem", "-CAcreateserial", "-out", f"{name}-cert.pem")  # fmt: skip
    return folder


def proofs(folder: Path, who: str, ending: str = "") -> list[str]:
    """Options that name authority, certificate and key, as papilla has them, or Dask (with "-file")."""
    files = {f"ca{ending}": f"{who}-ca.pem", "cert": f"{who}-cert.pem", "key": f"{who}-key.pem"}
    return [part for key, name in files.items() for part in (f"--tls-{key}", str(folder / name))]


@contextmanager
def dask_cluster(folder: Path, *options: str, workers: int = 2) -> Iterator[str]:
    """The address of a scheduler on loopback with some workers, as the how-to starts them."""
    dask, where, quiet = (
        [sys.executable, "-m", "dask"],
        folder / "scheduler.json",
        ("--dashboard-address", "127.0.0.1:0"),
    )
    shared = [*options, "--scheduler-file", str(where), *quiet]
    processes = []

    def start(*line: str) -> None:
        processes.append(subprocess.Popen([*dask, *line], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL))

    try:
        start("scheduler", "--host", "127.0.0.1", "--port", "0", *shared)
        wait_for(where.exists)
        for number in range(workers):
            start("worker", "--nthreads", "1", "--local-directory", str(folder / f"worker{number}"), *shared)
        yield json.loads(where.read_text())["address"]
    finally:
        for process in reversed(processes):
            process.terminate()
        for process in processes:
            process.wait(timeout=30)


def workers_at(scheduler: Scheduler) -> int:
    """Number of workers of a scheduler."""
    try:
        with running.pool(1, scheduler) as found:
            return found.workers
    except InputError:
        return 0


def test_a_scheduler_with_certificates(certificates, study_file, tmp_path):
    ours = {key: certificates / f"ours-{key}.pem" for key in ("ca", "cert", "key")}
    with dask_cluster(tmp_path, "--protocol", "tls", *proofs(certificates, "ours", "-file")) as address:
        assert address.startswith("tls://")
        wait_for(lambda: workers_at(Scheduler(address, **ours)) == 2)
        client = command(study_file, "--out", tmp_path / "out", "--scheduler", address, "--json",
                         *proofs(certificates, "ours"))  # fmt: skip
        ports, processes = watched(client)
        found = answer(client)
        assert (found["designs"], found["failed"], found["cost"]["workers"]) == (200, 0, 2)
        assert ports == set() and processes == set()
        # Who has no certificate of this authority, or speaks without encryption, is not answered
        plain = address.replace("tls://", "tcp://")
        for options in ([address, *proofs(certificates, "others")], [plain, "--insecure"]):
            refused = command(study_file, "--out", tmp_path / "no", "--scheduler", *options)
            _, said = refused.communicate(timeout=120)
            assert refused.returncode == 2 and "no Dask scheduler answers at " in said.splitlines()[-1]
        refused = command(study_file, "--out", tmp_path / "no", "--scheduler", plain)
        _, said = refused.communicate(timeout=120)
        assert refused.returncode == 2 and said.count("\n") == 1 and "whoever reaches it runs code as you" in said


@pytest.mark.parametrize("broken", ["ca", "cert", "key"])
def test_files_that_are_no_certificates_are_one_line(certificates, study_file, tmp_path, broken):
    ours = {key: certificates / f"ours-{key}.pem" for key in ("ca", "cert", "key")}
    for content in ("no certificate", None):
        bad = tmp_path / "bad.pem"
        bad.unlink(missing_ok=True)
        if content is not None:
            bad.write_text(content)
        with pytest.raises(PapillaError) as refused, running.pool(1, Scheduler("tls://h:1", **ours | {broken: bad})):
            pass
        assert "bad.pem" in str(refused.value) and "\n" not in str(refused.value)


def test_an_open_scheduler_serves_who_asks_for_it(study_file, tmp_path):
    with dask_cluster(tmp_path) as address:
        scheduler = Scheduler(address, insecure=True)
        wait_for(lambda: workers_at(scheduler) == 2)
        found = running.run(read_study(study_file), Store(tmp_path / "store.sqlite"), scheduler=scheduler)
        assert (found.workers, found.designs, found.failed) == (2, 200, 0) and "not encrypted" in found.how


# ---- Workers that are killed again and again


def test_designs_whose_worker_is_killed_each_time_say_so(study_file, tmp_path):
    path, store = tmp_path / "few.toml", tmp_path / "store.sqlite"
    path.write_text(study_file.read_text().replace("designs = 200", "designs = 8"))
    client = client_of(path, store)
    while client.poll() is None:
        for pid in workers_of(client.pid):
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        time.sleep(0.05)
    assert answer(client) == {"designs": 8, "reused": 0, "failed": 8}
    with sqlite3.connect(store) as connection:
        assert {row[0] for row in connection.execute("SELECT status FROM records")} == {"its worker was killed 4 times"}
