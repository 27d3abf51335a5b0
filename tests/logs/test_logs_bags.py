"""ROS 1 and 2 bags and MCAP files, written by rosbags, are read through a map that names topic and field."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from papilla.core import seams
from papilla.core.errors import FileAccessError, FileFormatError, MemoryEstimateError
from papilla.logs import read_time_log
from papilla.logs.log_map import Column, LogMap
from papilla.logs.proposal import propose

rosbags = pytest.importorskip("rosbags")
START = 1_700_000_000_000_000_000


def write(path: Path, kind: str) -> Path:
    """Gauges at 1 kHz, a force every 4 ms that begins after 2 ms; the force counts up."""
    from rosbags.rosbag1 import Writer as Writer1
    from rosbags.rosbag2 import StoragePlugin
    from rosbags.rosbag2 import Writer as Writer2
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC if kind == "bag" else Stores.ROS2_HUMBLE)
    types = store.types
    array, layout = types["std_msgs/msg/Float64MultiArray"], types["std_msgs/msg/MultiArrayLayout"]
    header, time = types["std_msgs/msg/Header"], types["builtin_interfaces/msg/Time"]
    wrench, vector = types["geometry_msgs/msg/Wrench"], types["geometry_msgs/msg/Vector3"]
    stamped = types["geometry_msgs/msg/WrenchStamped"]
    plugin = {"storage_plugin": StoragePlugin.MCAP} if kind == "mcap" else {}
    writer = Writer1(path.with_suffix(".bag")) if kind == "bag" else Writer2(path, version=9, **plugin)
    with writer as bag:
        topics = {
            name: bag.add_connection(name, made.__msgtype__, typestore=store)
            for name, made in {"/gauges": array, "/ft": stamped}.items()
        }
        for k in range(40):
            now = START + k * 1_000_000
            messages = [("/gauges", array(layout([], 0), np.array([k, -2.0 * k])))]
            if k % 4 == 2:
                head = {"seq": k} if kind == "bag" else {}
                own = header(**head, stamp=time(now // 10**9, now % 10**9), frame_id="ft")
                forces = wrench(vector(0.0, 0.0, 100.0 + k), vector(0.0, 0.0, 0.0))
                messages.append(("/ft", stamped(own, forces)))
            for topic, message in messages:
                name = topics[topic].msgtype
                data = store.serialize_ros1(message, name) if kind == "bag" else store.serialize_cdr(message, name)
                bag.write(topics[topic], now, data)
    return path.with_suffix(".bag") if kind == "bag" else path


def mapped(topic="/ft", column="wrench.force.z"):
    gauges = {f"g{n + 1}": Column(f"data[{n}]", "microstrain", topic="/gauges") for n in range(2)}
    return LogMap({**gauges, "force_N": Column(column, "gf", topic=topic)}, path=Path("map.toml"))


@pytest.mark.parametrize("kind", ["bag", "db3", "mcap"])
def test_topics_become_columns_and_the_slower_one_is_held(tmp_path, kind):
    path = write(tmp_path / "recorded", kind)
    found = read_time_log(path, log_map=mapped())
    np.testing.assert_allclose(found.t_s, np.arange(40) / 1000, atol=1e-12)
    np.testing.assert_array_equal(found.readings, np.arange(40)[:, None] * [1.0, -2.0])
    expected = np.where(np.arange(40) < 2, np.nan, 100 + (np.arange(40) - 2) // 4 * 4 + 2.0)
    np.testing.assert_allclose(found.force_N, expected * 9.80665e-3)
    assert "rows are the messages of /gauges" in found.report.notes
    assert "of /ft each row has the latest value" in found.report.notes
    guessed = {guess.name: guess.meant for guess in propose(path).guesses}
    expected = {"t_s": "t_s", "/gauges:data[0]": "g1", "/gauges:data[1]": "g2", "/ft:wrench.force.z": "force_N"}
    expected |= {"/ft:wrench.force.x": "tangential_N", "/ft:wrench.torque.y": "", "/ft:header.stamp": ""}
    assert expected.items() <= guessed.items()
    (tmp_path / "proposed.toml").write_text(propose(path).to_toml())
    again = read_time_log(path, log_map=tmp_path / "proposed.toml")
    np.testing.assert_array_equal(again.readings, found.readings)
    np.testing.assert_allclose(again.force_N, found.force_N)


def test_more_numbers_than_memory_holds_are_refused_before_they_are_read(tmp_path, monkeypatch):
    """40 messages of two gauges and 10 of a force, each with a time: 140 numbers of a hundred bytes."""
    path = write(tmp_path / "recorded", "bag")
    monkeypatch.setattr(seams, "free_bytes", lambda: 13_900)
    with pytest.raises(MemoryEstimateError, match=f"reading 140 numbers of {path} .* name fewer fields in a map"):
        read_time_log(path, log_map=mapped())
    monkeypatch.setattr(seams, "free_bytes", lambda: 14_100)
    assert len(read_time_log(path, log_map=mapped())) == 40


def test_a_single_mcap_file_and_a_stamp_as_the_time(tmp_path):
    write(tmp_path / "recorded", "mcap")
    (file,) = (tmp_path / "recorded").glob("*.mcap")
    columns = {"g1": Column("wrench.force.z", "microstrain", topic="/ft")}
    log_map = LogMap({"t_s": Column("header.stamp", "s", topic="/ft"), **columns})
    np.testing.assert_allclose(read_time_log(file, log_map=log_map).t_s, 2e-3 + 4e-3 * np.arange(10), atol=1e-9)


@pytest.mark.parametrize(
    "log_map, said",
    [
        (mapped(topic="/fts"), "map.toml: the log .* has no topic '/fts'; did you mean /ft?"),
        (mapped(column="wrench.force.zz"), "has no field of /ft 'wrench.force.zz'; did you mean wrench.force.z?"),
        (mapped(topic="/camera"), r"has no topic '/camera' \(found /ft, /gauges\)|\(found /gauges, /ft\)"),
        (None, r"column t_s|no gauge column"),
    ],
)
def test_what_a_bag_lacks_is_named_with_the_nearest(tmp_path, log_map, said):
    path = write(tmp_path / "recorded", "db3")
    with pytest.raises(FileFormatError, match=said):
        read_time_log(path, log_map=log_map)


def test_rubbish_and_a_missing_extra_are_one_line(tmp_path):
    (tmp_path / "a.bag").write_bytes(b"#ROSBAG V2.0\n" + bytes(100))
    with pytest.raises(FileFormatError, match="a.bag is no bag that rosbags can read"):
        read_time_log(tmp_path / "a.bag", log_map=mapped())
    code = "import sys; sys.modules['rosbags.highlevel'] = None; from papilla.cli.main import run; run(sys.argv[1:])"
    command = [sys.executable, "-c", code, "log", "map", "a.bag", "--out", "m.toml"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 2 and "bags need rosbags: pip install papilla[robotics]" in done.stderr


# ---- Bags that cannot be used


def bag(path: Path, kind: str, *topics: tuple[str, str, str, list[bytes]]) -> Path:
    """A bag of topics (name, type, definition, raw messages a millisecond apart)."""
    from rosbags.rosbag1 import Writer as Writer1
    from rosbags.rosbag2 import StoragePlugin
    from rosbags.rosbag2 import Writer as Writer2

    if kind == "bag":
        path = path.with_suffix(".bag")
    with Writer1(path) if kind == "bag" else Writer2(path, version=9, storage_plugin=StoragePlugin.MCAP) as target:
        for topic, name, definition, messages in topics:
            connection = target.add_connection(topic, name, msgdef=definition, **digest(name, definition, kind))
            for number, raw in enumerate(messages):
                target.write(connection, START + number * 1_000_000, raw)
    return path


def digest(name: str, definition: str, kind: str) -> dict[str, str]:
    """The hash of a definition, any for one that is no definition."""
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.EMPTY)
    try:
        store.register(get_types_from_msg(definition, name) if len(definition) < 1000 else {})
        return {"md5sum": store.generate_msgdef(name)[1]} if kind == "bag" else {"rihs01": store.hash_rihs01(name)}
    except Exception:  # noqa: BLE001 - whatever the parser raises
        return {"md5sum": "0" * 32} if kind == "bag" else {"rihs01": "RIHS01_0"}


CDR = b"\x00\x01\x00\x00"
"""Four bytes before each message of ROS 2: little-endian."""


def text(content: bytes, kind: str) -> bytes:
    """A raw message of one string."""
    raw = content + b"\0" * (kind != "bag")
    return CDR * (kind != "bag") + len(raw).to_bytes(4, "little") + raw


@pytest.fixture
def sound(tmp_path):
    """A raw message and the definition of one number, which is read."""
    return ("/force", "std_msgs/msg/Float64", "float64 data\n", [np.float64(k).tobytes() for k in range(5)])


@pytest.mark.parametrize("kind", ["bag", "mcap"])
def test_topics_without_numbers_are_named(tmp_path, kind):
    said = [(f"/{name}", "std_msgs/msg/String", "string data\n", [text(b"go", kind)]) for name in ("cmd", "log")]
    path = bag(tmp_path / "a", kind, *said)
    for read in (read_time_log, propose):
        with pytest.raises(FileFormatError) as caught:
            read(path)
        assert (
            str(caught.value) == f"{path}: no numbers in these topics: /cmd (std_msgs/String), /log (std_msgs/String)"
        )


@pytest.mark.parametrize("kind", ["bag", "mcap"])
def test_a_topic_that_cannot_be_decoded_is_named_where_it_is_needed(tmp_path, sound, kind):
    """Its messages are shorter than its definition says. The other topic is read, with a remark."""
    topic, name, definition, raws = sound
    whole = (topic, name, definition, raws if kind == "bag" else [CDR + raw for raw in raws])
    short = ("/broken", "lab_msgs/msg/Two", "float64 a\nfloat64 b\n", [whole[3][1]] * 3)
    path = bag(tmp_path / "a", kind, whole, short)
    read = {"g1": Column("data", "microstrain", topic="/force")}
    found = read_time_log(path, log_map=LogMap(read))
    np.testing.assert_array_equal(found.readings[:, 0], range(5))
    (note,) = [note for note in found.report.notes if "decode" in note]
    assert note.startswith(f"cannot decode topic /broken of {path}: ")
    assert any("/broken" in question for question in propose(path).open_questions)
    with pytest.raises(FileFormatError, match=f"/broken cannot be used: cannot decode topic /broken of {path}: "):
        read_time_log(path, log_map=LogMap({**read, "force_N": Column("a", "N", topic="/broken")}))
    with pytest.raises(FileFormatError, match="^cannot decode topic /broken of"):
        read_time_log(bag(tmp_path / "b", kind, short), log_map=LogMap(read))


def test_a_message_that_breaks_off_later_is_named_with_its_topic(tmp_path, sound):
    topic, name, definition, raws = sound
    path = bag(tmp_path / "a", "bag", (topic, name, definition, [*raws, raws[0][:3]]))
    with pytest.raises(FileFormatError, match=f"^cannot decode topic /force of {path}: "):
        read_time_log(path, log_map=LogMap({"g1": Column("data", "microstrain", topic="/force")}))


@pytest.mark.parametrize(
    "definition, why",
    [
        ("string[1000000000] names\n", "1000000000 members of fixed arrays"),
        ("lab_msgs/P[3000] a\nlab_msgs/P[3000] b\n" + "=" * 80 + "\nMSG: lab_msgs/P\nuint8 x\n", "6000 members"),
        ("uint8 x\n" * 2**16, "its definition has 524288 characters"),
        ("?!\n", "Could not parse"),
        ("uint8 x\nimport os\nos.abort()\n", "Could not parse"),
    ],
    ids=["huge array", "huge arrays of messages", "long", "none", "program"],
)  # fmt: skip
def test_a_definition_that_would_keep_the_decoder_busy_is_refused(tmp_path, definition, why):
    path = bag(tmp_path / "a", "bag", ("/x", "lab_msgs/msg/X", definition, [b"\0"]))
    with pytest.raises(FileFormatError, match=f"^cannot decode topic /x of {path}: .*{why}") as caught:
        read_time_log(path, log_map=mapped())
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 1000


def test_brackets_inside_brackets_of_a_definition_are_refused(tmp_path):
    """On each pair of them the parser spends 64 times the time."""
    from rosbags.rosbag2 import Writer

    idl = "module lab_msgs { module msg { struct X { uint8 a[" + "(" * 9 + "3" + ")" * 9 + "]; }; }; };"
    with Writer(tmp_path / "a", version=9) as target:
        connection = target.add_connection("/x", "lab_msgs/msg/X", msgdef="uint8 x\n", rihs01="RIHS01_0")
        target.write(connection, START, CDR + b"\0")
    import sqlite3

    (file,) = (tmp_path / "a").glob("*.db3")
    with sqlite3.connect(file) as database:
        database.execute("UPDATE message_definitions SET encoding = 'ros2idl', encoded_message_definition = ?", [idl])
    database.close()
    with pytest.raises(FileFormatError, match="cannot decode topic /x of .*brackets inside brackets"):
        read_time_log(file, log_map=mapped())


@pytest.mark.slow
def test_a_chunk_does_not_unpack_without_end(tmp_path, sound):
    """A bag whose packed chunk is exchanged for one of as many bytes that unpacks to 272 MiB of zeros."""
    import bz2

    from rosbags.rosbag1 import Writer

    topic, name, definition, _ = sound
    path = tmp_path / "a.bag"
    noise = np.random.default_rng(1).bytes(8000)
    packed = Writer(path)
    packed.set_compression(Writer.CompressionFormat.BZ2)
    with packed as target:
        connection = target.add_connection(topic, name, msgdef=definition, **digest(name, definition, "bag"))
        for number in range(1000):
            target.write(connection, START + number * 1_000_000, noise[8 * number : 8 * number + 8])
    content = path.read_bytes()
    at = content.index(b"BZh")
    packer, bomb = bz2.BZ2Compressor(), b""
    for _ in range(17):
        bomb += packer.compress(bytes(2**24))
    bomb += packer.flush()
    assert at + len(bomb) < len(content)
    path.write_bytes(content[:at] + bomb + content[at + len(bomb) :])
    with pytest.raises(FileFormatError, match=f"^{path}: a chunk unpacks to more than"):
        read_time_log(path, log_map=LogMap({"g1": Column("data", "microstrain", topic="/force")}))


def test_a_bag_is_a_regular_file(tmp_path):
    import os

    with pytest.raises(FileAccessError, match=r"cannot read .*none\.bag: No such file"):
        read_time_log(tmp_path / "none.bag", log_map=mapped())
    if hasattr(os, "mkfifo"):
        os.mkfifo(tmp_path / "a.mcap")
        with pytest.raises(FileAccessError, match=r"a\.mcap: it is not a regular file"):
            read_time_log(tmp_path / "a.mcap", log_map=mapped())
