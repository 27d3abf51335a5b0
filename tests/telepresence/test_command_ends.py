"""The ends of the link: what a sensor and a display are made of and what they leave behind, in one process."""

import io
import json
import os
import sys
from contextlib import contextmanager
from threading import Event, Thread

import numpy as np
import pytest
from free_ports import free_ports
from spring_calibration import FORCE, calibration

from papilla.telepresence import Address, Component, Endpoint, GratingTexture, HandMotion, Soft, TouchLog
from papilla.telepresence.messages import Force, HandReading, Length, Modulus, Parameters, Ratio, lines_of, quantity


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
    assert answer.code == 0 and "encrypted" not in answer.err and "no display has sent a message" in answer.err
    assert answer.out.endswith(" 0 received, 0 dropped\n"), "no round trip"


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


@contextmanager
def peer(options, make):
    """Yields the endpoint of the other end, which sends a message a hundred times a second, and what it heard."""
    with Endpoint(*(Address.of(options[place], "--peer") for place in (1, 3))) as endpoint:
        over, heard = Event(), []

        def talk():
            while not over.wait(0.01):
                endpoint.send(make)
                heard.extend(endpoint.receive())

        thread = Thread(target=talk)
        thread.start()
        try:
            yield endpoint, heard
        finally:
            over.set()
            thread.join()
            for _ in range(5):
                heard.extend(endpoint.receive())


def test_a_display_tells_what_it_received_and_keeps_what_it_showed(papilla, way, tmp_path):
    lines, modulus, ratio = lines_of((Component(1.5, 50.0),)), quantity(Modulus, 0.3, 0.02), quantity(Ratio, 0.4, 0.03)
    hand = ("--speed", 60, "--strokes", 0, "--force", 0.3, "--seconds", 1, "--out", "shown.csv")
    with peer(way["sensor"], lambda header: Parameters(header, 0, lines, modulus, ratio)) as (sensor, heard):
        answer = papilla("telepresence", "display", *way["display"], *hand, "--json")
    assert answer.code == 0, answer.err
    found = json.loads(answer.out)
    assert 0 < found["received"]["accepted"] <= sensor.sent and 0 < len(heard) <= found["sent"] <= 255
    assert 0 < found["round_trip_ms"] < 1000
    assert abs(found["clock_offset_ms"]) <= 0.5 * found["round_trip_ms"], "both have the same clock"
    for name in ("work_ms", "busy_ms"):
        half = 0.5 * found["periods"] * found[name]["p50"]
        assert found["periods"] * 1e-3 < half < 1100 and found[name]["p50"] <= found[name]["p99.9"], name
    rows = np.genfromtxt(tmp_path / "shown.csv", delimiter=",", names=True)
    assert len(rows) == found["periods"] and (rows["displacement_um"][rows["gain"] == 0] == 0).all()
    np.testing.assert_allclose(np.diff(rows["position_mm"]), 60 * np.diff(rows["t_s"]), atol=1e-6)
    shown = rows[rows["gain"] == 1]
    assert len(shown) > 20 and (shown["wavelength_mm"] == 1.5).all()
    # 40 Hz, where the actuator is flat: 150 V for 55 um about the middle
    np.testing.assert_allclose(rows["drive_V"], 75 + rows["displacement_um"] * 150 / 55, atol=0.01)
    assert np.abs(shown["displacement_um"]).max() == pytest.approx(50 * 0.238, rel=0.1)
    assert (tmp_path / "shown.csv").read_text().endswith(",0.3,0.02,ok,,,,0.4,0.03,ok,,,\n"), "nobody sent an area"
    last = heard[-1].message
    assert 0.18 <= last.force.value <= 0.42 and np.isclose(rows["position_mm"], last.position.value).any()


def test_a_terminal_sees_one_line_that_is_written_over_four_times_a_second(papilla, way, monkeypatch):
    place, force = quantity(Length, 12.34), quantity(Force, 0.25)
    monkeypatch.setenv("COLUMNS", "60")
    with peer(way["display"], lambda header: HandReading(header, place, force)) as (display, heard):
        monkeypatch.setattr(sys, "stderr", type("Terminal", (io.StringIO,), {"isatty": lambda self: True})())
        answer = papilla("telepresence", "sensor", *way["sensor"], "--seconds", 1.2)
        written = sys.stderr.getvalue()
    assert answer.code == 0 and written.endswith("\n") and written.count("\n") == 1
    lines = written.removesuffix("\n").split("\r\x1b[2K")[1:]
    assert 3 <= len(lines) <= 6 and max(map(len, lines)) == 59
    time, state = lines[-1].split(" s  ")
    assert float(time) > 0.7 and state.startswith("wavelength held; hand at 12.3 mm, 0.25 N; "), "it stands still"
    assert 0 < len(heard) <= 3 + 1.2 * 50, "messages a second"
    received = int(answer.out.split(" received")[0].split()[-1])
    assert 0 < received <= display.sent and "; shortest round trip " in answer.out


def test_a_log_that_is_played_tells_what_its_columns_allow(papilla, way, tmp_path):
    """Rows of a finger that presses by 0.5 N and strokes a grating of 1.5 mm."""
    made = calibration()
    made.save(tmp_path / "c.json")
    force, modulus = (grid.ravel() for grid in np.meshgrid(np.geomspace(*FORCE, 5), np.geomspace(0.02, 5, 5)))
    presses = np.column_stack([force, modulus, 60 * force**0.6 * modulus**-0.2])
    np.savetxt(tmp_path / "s.csv", presses, delimiter=",", header="force_N,modulus_MPa,contact_area_mm2", comments="")
    touch, rng = TouchLog(GratingTexture(1.5), 1.0, Soft(made, 0.3, 0.4)), np.random.default_rng(0)
    motion, rows = HandMotion(100.0, 1.5), []
    for now in (np.arange(450) / 1000).tolist():
        place, later = float(motion.place_mm(now)), float(motion.place_mm(now + 0.001))
        rows.append((now, *touch.row(place, 1000 * (later - place), 0.5, rng.standard_normal(7).tolist())))
    names = ",".join(["t_s", *(f"g{k}" for k in range(1, 6)), "force_N", "position_mm", "tangential_N"])
    np.savetxt(tmp_path / "log.csv", rows, delimiter=",", header=names, comments="")
    softness = ("--calibration", "c.json", "--sweep", "s.csv", "--thickness", 8)
    with peer(way["display"], lambda header: HandReading(header, quantity(Length, 0.0))) as (_, heard):
        answer = papilla("telepresence", "sensor", *way["sensor"], "--log", "log.csv", *softness, "--json")
    assert answer.code == 0 and json.loads(answer.out)["periods"] >= 112, "four rows a period at most"
    # On a loaded machine the last message may be one of the moments in which friction is not known
    message = next(one.message for one in reversed(heard) if one.message.mu_kinetic.value is not None)
    assert message.lines[0].wavelength.value == pytest.approx(1.5, rel=0.01) and len(message.lines) == 1
    assert (message.mu_kinetic.value, message.force.value) == pytest.approx((0.4, 0.5), rel=0.1)
    assert message.modulus is not None and message.area is not None, "with a calibration and its sweep"


def test_what_a_log_lacks_is_said(papilla, refused, way, tmp_path):
    time = np.arange(200) / 1000
    np.savetxt(tmp_path / "log.csv", np.column_stack([time, time]), delimiter=",", header="t_s,g1", comments="")
    played = ("telepresence", "sensor", *way["sensor"], "--log", "log.csv")
    assert "log.csv: the sensor's side needs a wavelength" in refused(*played)
    for option in (("--thickness", 5), ("--sweep", "s.csv")):
        assert "--sweep and --thickness need --calibration" in refused(*played, *option)
