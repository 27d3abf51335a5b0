"""ROS 1 and 2 bags and MCAP files, written by rosbags, are read through a map that names topic and field."""

from pathlib import Path

import numpy as np
import pytest

from papilla.core.errors import FileFormatError, InputError
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


def test_rubbish_and_a_missing_extra_are_one_line(tmp_path, monkeypatch):
    (tmp_path / "a.bag").write_bytes(b"#ROSBAG V2.0\n" + bytes(100))
    with pytest.raises(FileFormatError, match="a.bag is no bag that rosbags can read"):
        read_time_log(tmp_path / "a.bag", log_map=mapped())
    monkeypatch.setitem(__import__("sys").modules, "rosbags.highlevel", None)
    with pytest.raises(InputError, match=r"bags need rosbags: pip install papilla\[robotics\]"):
        read_time_log(tmp_path / "a.bag", log_map=mapped())
