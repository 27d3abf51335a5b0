"""Studies on real processes: kills with -9, two studies on one store, open ports, schedulers with certificates."""

import json
import os
import re
import shutil
import signal
import socket
import sqlite3
import subprocess
import sys
import time
from contextlib import closing, contextmanager, suppress
from pathlib import Path

import pytest
from killed_client import is_alive

from papilla.core.errors import PapillaError
from papilla.design import running
from papilla.design.cluster import Scheduler
from papilla.design.study import read_study

pytestmark = pytest.mark.slow


@pytest.fixture
def real(study_file):
    """A study of one geometry, which is in the cache afterwards."""
    path = study_file(("designs = 12", "designs = 200"), ("[0.1, 0.6]", "[0.15, 0.36]"), own=True)
    study = read_study(path)
    study.in_scene(study.finger)
    return path


def command(*arguments: object) -> subprocess.Popen:
    """`papilla design` as a user runs it."""
    line = [sys.executable, "-m", "papilla", "design", *map(str, arguments)]
    return subprocess.Popen(line, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def answer(client: subprocess.Popen) -> dict:
    """What it says at its end."""
    told, said = client.communicate(timeout=900)
    assert client.returncode == 0, said
    return json.loads(told)


def counts(client: subprocess.Popen) -> list[int]:
    """Designs of a study that ends, those that it did not have to run, and those that failed."""
    found = answer(client)
    return [found[name] for name in ("designs", "reused", "failed")]


def stored(store: Path, what: str = "count(*) FROM designs") -> object:
    """A cell of a store, while others write to it; 0 before there is any."""
    try:
        with closing(sqlite3.connect(store)) as connection:
            return connection.execute(f"SELECT {what}").fetchone()[0]
    except sqlite3.OperationalError:
        return 0


def wait_for(condition) -> None:
    """Until it holds."""
    end = time.monotonic() + 180
    while not condition():
        assert time.monotonic() < end, "nothing came"
        time.sleep(0.05)


def children(parent: int) -> list[int]:
    """Processes below a process."""
    found = []
    for entry in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            if int((entry / "stat").read_text().rpartition(")")[2].split()[1]) == parent:
                found += [int(entry.name), *children(int(entry.name))]
    return found


def workers_of(client: int) -> list[int]:
    """Processes of a client that compute."""
    found = []
    for pid in children(client):
        with suppress(OSError):
            found += [pid] * (b"spawn_main" in Path(f"/proc/{pid}/cmdline").read_bytes())
    return found


def ports_of(parent: int) -> set[str]:
    """Where a process and those below it are reached, as the kernel writes it: TCP sockets that listen, all of UDP."""
    held = set()
    for link in (link for pid in (parent, *children(parent)) for link in Path(f"/proc/{pid}/fd").glob("*")):
        with suppress(OSError):
            held |= set(re.findall(r"socket:\[(\d+)\]", os.readlink(link)))
    rows = [(kind, line.split()) for kind in ("tcp", "tcp6", "udp", "udp6")
            for line in Path("/proc/net", kind).read_text().splitlines()[1:]]  # fmt: skip
    return {f"{kind} {row[1]}" for kind, row in rows if row[9] in held and (row[3] == "0A" or kind.startswith("udp"))}


def watched(client: subprocess.Popen) -> tuple[set[str], set[int]]:
    """All ports that a client and its workers open until it ends, and the numbers of its workers."""
    ports, workers = set(), set()
    while client.poll() is None:
        ports |= ports_of(client.pid)
        workers |= set(workers_of(client.pid))
        time.sleep(0.02)
    return ports, workers


def test_a_killed_client_loses_what_is_in_flight_and_a_killed_worker_is_replaced(real, tmp_path):
    line = real, "--out", tmp_path / "out", "--workers", 1, "--json"
    store = tmp_path / "out" / "store.sqlite"
    client = command(*line)
    wait_for(lambda: stored(store) > 0 or client.poll() is not None)
    orphans = children(client.pid)
    os.kill(client.pid, signal.SIGKILL)
    client.communicate()
    before = stored(store)
    assert 0 < before < 200
    wait_for(lambda: not any(is_alive(pid) for pid in orphans))
    again = command(*line, "--resume")
    wait_for(lambda: workers_of(again.pid))
    os.kill(workers_of(again.pid)[-1], signal.SIGKILL)
    assert counts(again) == [200, before, 0]


def test_two_studies_at_once_share_one_store_and_open_no_port(real, tmp_path):
    with socket.create_server(("127.0.0.1", 0)), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        assert {port.split()[0] for port in ports_of(os.getpid())} >= {"tcp", "udp"}
    clients, text = [], real.read_text()
    for name in ("one", "two"):
        path = tmp_path / f"{name}.toml"
        path.write_text(text.replace('"made up"', f'"{name}"\nstore = "{tmp_path / "shared.sqlite"}"'))
        clients.append(command(path, "--out", tmp_path / name, "--workers", 1, "--json"))
    ports, workers = watched(clients[0])
    assert [answer(client)["designs"] for client in clients] == [200, 200] and ports == set() and len(workers) == 1
    assert stored(tmp_path / "shared.sqlite", "count(*) FROM records") == 200
    assert stored(tmp_path / "shared.sqlite") == 400


def test_designs_whose_worker_is_killed_each_time_say_so(study_file, tmp_path):
    client = command(study_file(("designs = 12", "designs = 8"), own=True), "--out", tmp_path, "--workers", 1)
    while client.poll() is None:
        for pid in workers_of(client.pid):
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        time.sleep(0.05)
    assert client.communicate() and client.returncode != 0
    what = "count(*) FROM records WHERE status = 'its worker was killed 4 times'"
    assert stored(tmp_path / "store.sqlite", what) == 8


@pytest.fixture(scope="module")
def certificates(tmp_path_factory):
    """Files of certificates of an authority for this cluster ("ours"), and of another one ("others")."""
    if shutil.which("openssl") is None:
        pytest.skip("certificates are made by openssl")
    folder = tmp_path_factory.mktemp("certificates")
    for name in ("ours", "others"):
        key = "-newkey", "rsa:2048", "-nodes"
        of_authority = "-CA", f"{name}-ca.pem", "-CAkey", f"{name}-ca-key.pem", "-CAcreateserial"
        for line in (
            ("req", "-x509", *key, "-subj", f"/CN={name}", "-keyout", f"{name}-ca-key.pem", "-out", f"{name}-ca.pem"),
            ("req", *key, "-subj", "/CN=study", "-keyout", f"{name}-key.pem", "-out", f"{name}.csr"),
            ("x509", "-req", "-in", f"{name}.csr", *of_authority, "-out", f"{name}-cert.pem"),
        ):
            subprocess.run(["openssl", *line], cwd=folder, check=True, capture_output=True)
    return folder


def proofs(folder: Path, who: str, ending: str = "") -> list[str]:
    """Options that name authority, certificate and key, as papilla has them, or Dask (with "-file")."""
    files = {f"ca{ending}": f"{who}-ca.pem", "cert": f"{who}-cert.pem", "key": f"{who}-key.pem"}
    return [part for key, name in files.items() for part in (f"--tls-{key}", str(folder / name))]


@contextmanager
def dask_cluster(folder: Path, *options: str):
    """The address of a scheduler on loopback with a worker, as the how-to starts them."""
    where = folder / "scheduler.json"
    shared = [*options, "--scheduler-file", str(where), "--dashboard-address", "127.0.0.1:0"]
    lines = (
        ("scheduler", "--host", "127.0.0.1", "--port", "0"),
        ("worker", "--nthreads", "1", "--local-directory", str(folder / "worker")),
    )
    processes = []
    try:
        for line in lines:
            quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
            processes.append(subprocess.Popen([sys.executable, "-m", "dask", *line, *shared], **quiet))
            wait_for(where.exists)
        yield json.loads(where.read_text())["address"]
    finally:
        for process in reversed(processes):
            process.terminate()
            process.wait(timeout=30)


def test_a_scheduler_serves_who_has_its_certificates_alone(certificates, real, tmp_path):
    with dask_cluster(tmp_path, "--protocol", "tls", *proofs(certificates, "ours", "-file")) as address:
        assert address.startswith("tls://")
        options = "--out", tmp_path / "out", "--json", "--scheduler", address, *proofs(certificates, "ours")
        client = command(real, *options)
        ports, processes = watched(client)
        assert counts(client) == [200, 0, 0] and ports == set() and processes == set()
        plain = address.replace("tls://", "tcp://")
        for options, said in (
            ([address, *proofs(certificates, "others")], "no Dask scheduler answers at "),
            ([plain, "--insecure"], "no Dask scheduler answers at "),
            ([plain], "whoever reaches it runs code as you"),
        ):
            refused = command(real, "--out", tmp_path / "no", "--scheduler", *options)
            last = refused.communicate(timeout=120)[1].splitlines()[-1]
            assert refused.returncode == 2 and said in last


@pytest.mark.parametrize("broken", ["ca", "cert", "key"])
def test_files_that_are_no_certificates_are_one_line(certificates, tmp_path, broken):
    ours = {key: certificates / f"ours-{key}.pem" for key in ("ca", "cert", "key")}
    (tmp_path / "bad.pem").write_text("no certificate")
    for name in ("bad.pem", "absent.pem"):
        scheduler = Scheduler("tls://h:1", **ours | {broken: tmp_path / name})
        with pytest.raises(PapillaError, match=f"^.*{name}.*$") as refused, running.pool(1, scheduler):
            pass
        assert "\n" not in str(refused.value)
