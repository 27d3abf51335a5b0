"""The ends of the link: what a sensor and a display are made of and what they leave behind, in one process."""

import json
import os

import numpy as np
import pytest
from free_ports import free_ports


@pytest.mark.parametrize(
    "option, value, said",
    [
        ("--parameters-rate", 0.5, "--parameters-rate must lie between 1 and 1000"),
        ("--parameters-rate", 1001, "--parameters-rate must lie between 1 and 1000"),
        ("--seconds", 0, "--seconds must be greater than 0"),
    ],
)
def test_bad_numbers_are_refused(refused, option, value, said):
    assert said in refused("telepresence", "sensor", option, value)


@pytest.mark.skipif(os.name != "posix", reason="modes of POSIX files")
@pytest.mark.parametrize("mode", [0o640, 0o604, 0o620, 0o666])
def test_a_key_that_others_can_use_is_refused(papilla, refused, tmp_path, mode):
    key = tmp_path / "link.key"
    key.write_text("a secret of two ends\n")
    key.chmod(mode)
    said = refused("telepresence", "sensor", "--key-file", "link.key", "--seconds", 0.01)
    assert "others can read or write link.key" in said and "chmod 600" in said
    key.chmod(0o600)
    ports = [f"127.0.0.1:{port}" for port in free_ports(2)]
    way = ("--listen", ports[0], "--peer", ports[1])
    answer = papilla("telepresence", "sensor", *way, "--key-file", "link.key", "--seconds", 0.01)
    assert answer.code == 0 and "encrypted" not in answer.err


@pytest.mark.parametrize(
    "content, told", [(b"short", "16 bytes"), (b"k" * 5000, "more than 4096 bytes"), (None, "cannot read")]
)
def test_a_key_of_a_wrong_size_names_its_file(refused, tmp_path, content, told):
    key = tmp_path / "link.key"
    if content is None:
        key.mkdir(0o700)
    else:
        key.write_bytes(content)
        key.chmod(0o600)
    said = refused("telepresence", "display", "--key-file", "link.key", "--seconds", 0.01)
    assert told in said and "link.key" in said


def test_to_another_machine_it_is_said_that_nothing_is_encrypted(papilla, tmp_path):
    (tmp_path / "link.key").write_text("a secret of two ends\n")
    (tmp_path / "link.key").chmod(0o600)
    way = ("--listen", f"0.0.0.0:{free_ports(1)[0]}", "--peer", "192.0.2.1:9")
    answer = papilla("telepresence", "sensor", *way, "--key-file", "link.key", "--seconds", 0.01)
    assert answer.code == 0
    assert "messages to 192.0.2.1:9 are signed, not encrypted: whoever is on the way can read them" in answer.err


def test_addresses_must_differ(refused):
    said = refused("telepresence", "sensor", "--listen", "127.0.0.1:5000", "--peer", "127.0.0.1:5000")
    assert "--listen and --peer must differ, got 127.0.0.1:5000 twice" in said
    assert "--peer must be HOST:PORT" in refused("telepresence", "sensor", "--peer", "here")
    assert "--listen must be HOST:PORT" in refused("telepresence", "sensor", "--listen", "here")


@pytest.fixture
def way():
    """Options of two ends that know each other."""
    one, other = (f"127.0.0.1:{port}" for port in free_ports(2))
    return {"sensor": ("--listen", one, "--peer", other), "display": ("--listen", other, "--peer", one)}


def test_a_sensor_alone_tells_its_periods_and_what_it_sent(papilla, way):
    scene = ("--wavelength", 2, "--amplitude", 40, "--noise", 1.5, "--seed", 5, "--components", 3)
    answer = papilla("telepresence", "sensor", *way["sensor"], *scene, "--seconds", 0.5, "--json")
    assert answer.code == 0, answer.err
    found = json.loads(answer.out)
    assert found["periods"] + found["missed"] == pytest.approx(500, abs=5)
    assert found["received"]["accepted"] == 0 and found["sent"] > 0 and found["bytes_sent"] > 10 * found["sent"]
    assert found["round_trip_ms"] is None is found["clock_offset_ms"]
    assert "no display has sent a message" in answer.err
    said = papilla("telepresence", "sensor", *way["sensor"], "--seconds", 0.1).out
    assert " missed; " in said and said.endswith(" 0 received, 0 dropped\n")


def test_a_display_alone_writes_a_row_for_each_period(papilla, way, tmp_path):
    hand = ("--speed", 50, "--strokes", 0, "--force", 0.25, "--seconds", 0.3, "--out", "shown.csv")
    answer = papilla("telepresence", "display", *way["display"], *hand, "--json")
    assert answer.code == 0, answer.err
    rows = np.genfromtxt(tmp_path / "shown.csv", delimiter=",", names=True)
    assert len(rows) == json.loads(answer.out)["periods"]
    np.testing.assert_allclose(np.diff(rows["position_mm"]), 50 * np.diff(rows["t_s"]), atol=1e-6)
    assert (rows["displacement_um"] == 0).all(), "nothing was told"


def test_what_a_log_lacks_is_said(papilla, refused, way, tmp_path):
    time = np.arange(200) / 1000
    np.savetxt(tmp_path / "log.csv", np.column_stack([time, time]), delimiter=",", header="t_s,g1", comments="")
    played = ("telepresence", "sensor", *way["sensor"], "--log", "log.csv")
    assert "log.csv: the sensor's side needs a wavelength" in refused(*played)
    for option in (("--thickness", 5), ("--sweep", "s.csv")):
        assert "--sweep and --thickness need --calibration" in refused(*played, *option)
