"""Damaged logs and maps of every kind: an answer or one line, in bounded time and memory; nothing is left behind."""

import gzip
import random
import shutil
import signal
import sys
import tempfile
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from mutations import mutations

from papilla.core.errors import PapillaError
from papilla.logs import TimeLogFile, read_presses
from papilla.logs.log_map import Column, LogMap
from papilla.logs.proposal import propose
from papilla.model.specimen import Block

pytestmark = pytest.mark.slow

COUNT = 1000
"""Number of damaged copies of each file."""
SECONDS, MEMORY_BYTES = 30, 4 * 2**30
"""Time in which an input must be answered or refused, a hundred times the usual one, and memory that it may take."""

TIME_LOG = "t_s,g1,g2,force_N,velocity_mm_s\n" + "".join(
    f"{k / 1e3:.3f},{10 + k % 7}.5,{-3 * k}e-1,0.{k % 9}1,40\n" for k in range(40)
)
FOREIGN_LOG = '"Zeit";"Fz [N]";"ch1 (mV/V)";wer\n' + "".join(f"{k},5;0,{k};1,{k}e-3;a\n" for k in range(30))
BENCH_LOG = "force_N,modulus_MPa,g1,g2,indentation_mm,specimen,thickness_mm\n" + "".join(
    f"0.{k},0.1,{10 * k},{-3 * k},0.{k}5,block,8\n" for k in range(1, 9)
)
MAP = """decimal = "."
header_line = 1
speed_mm_s = 40.0
air_s = [0.0, 0.01]
[columns]
t_s = { column = "t_s", unit = "s" }
force_N = { column = "force_N", unit = "gf" }
g1 = { column = "g1", unit = "counts", bits = 16, span_V = 5.0, amplification = 500.0, excitation_V = 2.5, gauge_factor = 2.1 }
g2 = { column = "g2", unit = "mV/V", gauge_factor = 2.1, active_arms = 1 }
"""  # noqa: E501
OF_LISTS = LogMap({"t_s": Column("t", "s"), "g1": Column("state[1]", "microstrain"), "g2": Column("ch", "strain")})
OF_TOPICS = LogMap(
    {"g1": Column("data[1]", "microstrain", topic="/gauges"), "force_N": Column("wrench.force.z", "gf", topic="/ft")}
)


def parquet_file(path):
    pyarrow = pytest.importorskip("pyarrow")
    from pyarrow.parquet import write_table

    columns = {"t": np.arange(30) / 1e3, "state": [[k, k + 1.0, 2.0] for k in range(30)], "ch": np.arange(30)}
    columns |= {"who": ["a", "b", None] * 10, "load": np.arange(30, dtype=np.float32)}
    write_table(pyarrow.table(columns), path, row_group_size=20)
    return path


def bag(path, kind):
    """A small ROS 1 bag, MCAP file, or the database of a ROS 2 bag, as rosbags writes it."""
    pytest.importorskip("rosbags")
    from rosbags.rosbag1 import Writer as Writer1
    from rosbags.rosbag2 import StoragePlugin
    from rosbags.rosbag2 import Writer as Writer2
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC if kind == "bag" else Stores.ROS2_HUMBLE)
    types = store.types
    array, layout = types["std_msgs/msg/Float64MultiArray"], types["std_msgs/msg/MultiArrayLayout"]
    wrench, vector = types["geometry_msgs/msg/Wrench"], types["geometry_msgs/msg/Vector3"]
    plugin = {"storage_plugin": StoragePlugin.MCAP if kind == "mcap" else StoragePlugin.SQLITE3}
    writer = Writer1(path.with_suffix(".bag")) if kind == "bag" else Writer2(path, version=9, **plugin)
    with writer as target:
        for topic, made in {"/gauges": array, "/ft": types["geometry_msgs/msg/WrenchStamped"]}.items():
            connection = target.add_connection(topic, made.__msgtype__, typestore=store)
            for k in range(10):
                message = array(layout([], 0), np.array([k, -2.0 * k]))
                if topic == "/ft":
                    stamp = types["builtin_interfaces/msg/Time"](k, 5)
                    head = types["std_msgs/msg/Header"](
                        **({"seq": k} if kind == "bag" else {}), stamp=stamp, frame_id="f"
                    )
                    message = made(head, wrench(vector(0.0, 0.0, 1.0 * k), vector(0.0, 0.0, 0.0)))
                serialize = store.serialize_ros1 if kind == "bag" else store.serialize_cdr
                target.write(connection, 10**15 + k * 10**6, serialize(message, made.__msgtype__))
    if kind == "bag":
        return path.with_suffix(".bag")
    (file,) = path.glob(f"*.{kind}")
    return shutil.move(file, path.with_suffix(f".{kind}"))


def answered(function, path, **how):
    """1 for an answer; 0 for a refusal, which is one bounded line."""
    try:
        function(path, **how)
    except PapillaError as refused:
        said = str(refused)
        assert said and "\n" not in said and said.isprintable() and len(said) < 2000, said
        return 0
    return 1


def rows_of(path, log_map=None):
    """A time log block by block, as `papilla estimate` reads it."""
    with TimeLogFile(path, log_map=log_map) as log:
        return sum(map(len, log.blocks()))


def proposed(path):
    """The text of a proposed map."""
    return propose(path).to_toml()


def stop(*_):
    raise AssertionError(f"no answer within {SECONDS} s")


@contextmanager
def guarded(folder, monkeypatch):
    """Within the block nothing takes longer than `SECONDS` at once (call the yielded function before each input) or
    more memory than `MEMORY_BYTES` (Linux), and no file is left where relative names and temporary files lead."""
    (folder / "temporary").mkdir()
    tempfile.tempdir = str(folder / "temporary")
    monkeypatch.chdir(folder)
    before = sorted(folder.rglob("*"))
    if not sys.platform.startswith("linux"):
        yield lambda: None
    else:
        import resource

        usual, handler = resource.getrlimit(resource.RLIMIT_AS), signal.signal(signal.SIGALRM, stop)
        taken = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (taken + MEMORY_BYTES, usual[1]))
        try:
            yield lambda: signal.alarm(SECONDS)
        finally:
            signal.alarm(0)
            signal.signal(signal.SIGALRM, handler)
            resource.setrlimit(resource.RLIMIT_AS, usual)
    tempfile.tempdir = None
    assert sorted(folder.rglob("*")) == before, "files were left behind"


def fuzz(folder, monkeypatch, content, name, *readings, count=COUNT, pack=bytes):
    """Damaged copies of a content go through each reading: (function, options). Both ends occur: some are answered, and
    some are refused."""
    path, answers = folder / name, []
    path.write_bytes(pack(content))
    for function, how in readings:
        assert answered(function, path, **how), "the undamaged file is read"
    with guarded(folder, monkeypatch) as again:
        for number, damaged in enumerate(mutations(random.Random(name), content, count)):
            path.write_bytes(pack(damaged) if number % 4 else pack(content)[: 20 + number] + damaged)
            for function, how in readings:
                again()
                answers.append(answered(function, path, **how))
    assert 0 < sum(answers) < len(answers)


def test_damaged_time_logs(tmp_path, monkeypatch):
    fuzz(tmp_path, monkeypatch, TIME_LOG.encode(), "log.csv", (rows_of, {}), (proposed, {}))


def test_damaged_foreign_logs(tmp_path, monkeypatch):
    by_map = LogMap({"g1": Column("ch1 (mV/V)", "mV/V", gauge_factor=2.0), "t_s": Column("Zeit", "ms")})
    fuzz(tmp_path, monkeypatch, FOREIGN_LOG.encode(), "lab.csv", (rows_of, {"log_map": by_map}), (proposed, {}))


def test_damaged_presses_of_a_bench(tmp_path, monkeypatch):
    fuzz(tmp_path, monkeypatch, BENCH_LOG.encode(), "bench.csv", (read_presses, {"mixed": Block(1.0, 10.0)}))


def test_packed_damaged_logs(tmp_path, monkeypatch):
    fuzz(tmp_path, monkeypatch, TIME_LOG.encode(), "log.csv.gz", (rows_of, {}), pack=gzip.compress)


def test_damaged_packed_logs(tmp_path, monkeypatch):
    fuzz(tmp_path, monkeypatch, gzip.compress(TIME_LOG.encode(), mtime=0), "log.csv.gz", (rows_of, {}))


def test_damaged_maps(tmp_path, monkeypatch):
    log = tmp_path / "log.csv"
    log.write_text(TIME_LOG)

    def read(path):
        return rows_of(log, LogMap.load(path))

    fuzz(tmp_path, monkeypatch, MAP.encode(), "map.toml", (read, {}))


def test_damaged_parquet_files(tmp_path, monkeypatch):
    content = parquet_file(tmp_path / "a.parquet").read_bytes()
    fuzz(tmp_path, monkeypatch, content, "log.parquet", (rows_of, {"log_map": OF_LISTS}), (proposed, {}))


@pytest.mark.parametrize("kind", ["bag", "mcap", "db3"])
def test_damaged_bags(tmp_path, monkeypatch, kind):
    content = bag(tmp_path / "recorded", kind).read_bytes()
    fuzz(
        tmp_path,
        monkeypatch,
        content,
        f"log.{kind}",
        (rows_of, {"log_map": OF_TOPICS}),
        (proposed, {}),
        count=COUNT // 2,
    )


def test_damaged_index_of_a_folder(tmp_path, monkeypatch):
    bag(tmp_path / "recorded", "db3")
    folder = tmp_path / "recorded"
    shutil.move(tmp_path / "recorded.db3", folder / "recorded.db3")
    content = (folder / "metadata.yaml").read_bytes()

    def read(path):
        shutil.copy(path, folder / "metadata.yaml")
        return rows_of(folder, OF_TOPICS)

    fuzz(tmp_path, monkeypatch, content, "metadata.yaml", (read, {}), count=COUNT // 2)
