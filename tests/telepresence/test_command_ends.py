"""The ends of the link: what a sensor and a display are made of and what they leave behind, in one process."""

import csv
import json
import math
import os
import signal
from types import SimpleNamespace

import numpy as np
import pytest
from free_ports import free_ports

from papilla.telepresence import processes
from papilla.telepresence.cli import ends as ends
from papilla.telepresence.udp import Address


class Gate(SimpleNamespace):
    """An endpoint that has sent and received something."""

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.closed = True


@pytest.fixture
def endpoint(monkeypatch):
    """In place of one with a socket; `made` has its addresses and key."""
    from papilla.telepresence import udp
    from papilla.telepresence.gate import Counts

    counts = Counts(accepted=11, forged=2, old=1)
    offset = SimpleNamespace(round_trip_ns=1_250_000, offset_ns=-500_000)
    one = Gate(gate=SimpleNamespace(offset=offset, counts=counts), sent=7, bytes_sent=700, closed=False, made=None)
    one.leaves_machine = False

    def make(*given):
        one.made = given
        return one

    monkeypatch.setattr(udp, "Endpoint", make)
    monkeypatch.setattr(ends.gc, "collect", lambda: 0)  # Of all objects of the tests: a tenth of a second each
    return one


@pytest.fixture
def sensed(monkeypatch):
    """What a sensor was run with."""
    asked = {}

    def run_sensor(endpoint, source, sensing, *, period, **how):
        asked.update(source=source, sensing=sensing, **how)
        period.ticked, period.missed = 100, 3

    monkeypatch.setattr(processes, "run_sensor", run_sensor)
    return asked


def test_a_sensor_of_a_grating_is_what_its_options_say(papilla, endpoint, sensed):
    scene = ("--wavelength", 2, "--amplitude", 40, "--noise", 1.5, "--seed", 5, "--components", 3)
    answer = papilla("telepresence", "sensor", *scene, "--parameters-rate", 20, "--seconds", 0.5, "--json")
    assert answer.code == 0, answer.err
    assert endpoint.made == (Address("127.0.0.1", 47001), Address("127.0.0.1", 47002), None) and endpoint.closed
    assert (sensed["parameters_Hz"], sensed["seconds"]) == (20.0, 0.5) and sensed["sensing"].components == 3
    touch = sensed["source"]._touch
    assert (touch.texture.wavelength_mm, touch.texture.amplitude, touch._noise) == (2.0, 40.0, 1.5)
    found = json.loads(answer.out)
    assert found | {"seconds": 0, "work_ms": 0, "busy_ms": 0} == {
        "seconds": 0, "periods": 100, "missed": 3, "work_ms": 0, "busy_ms": 0, "sent": 7, "bytes_sent": 700,
        "received": vars(endpoint.gate.counts), "round_trip_ms": 1.25, "clock_offset_ms": -0.5,
    }  # fmt: skip
    assert papilla("telepresence", "sensor").out == (
        "100 periods, 3 missed; 7 messages sent, 11 received, 3 dropped; shortest round trip 1.25 ms\n"
    )
    assert sensed["seconds"] == math.inf
    endpoint.gate.offset.round_trip_ns = math.nan
    assert papilla("telepresence", "sensor").out.endswith("11 received, 3 dropped\n")


def test_a_sensor_plays_a_log(papilla, endpoint, sensed, tmp_path):
    time = np.arange(200) / 1000
    rows = np.column_stack([time, np.sin(time), 20 * time])
    np.savetxt(tmp_path / "log.csv", rows, delimiter=",", header="t_s,g1,position_mm", comments="")
    assert papilla("telepresence", "sensor", "--log", "log.csv", "--components", 2).code == 0
    assert sensed["source"].gauges == 1 and sensed["sensing"].components == 2
    assert sensed["sensing"].pipeline.off["modulus"] == "no calibration was given"
    answer = papilla("telepresence", "sensor", "--log", "log.csv", "--thickness", 5)
    assert answer.code == 2 and "--sweep and --thickness need --calibration" in answer.err
    answer = papilla("telepresence", "sensor", "--log", "log.csv", "--sweep", "s.csv")
    assert answer.code == 2 and "--sweep and --thickness need --calibration" in answer.err
    np.savetxt(tmp_path / "log.csv", rows[:, :2], delimiter=",", header="t_s,g1", comments="")
    assert "log.csv: the sensor's side needs a wavelength" in papilla("telepresence", "sensor", "--log", "log.csv").err


@pytest.mark.parametrize(
    "option, value, said",
    [
        ("--parameters-rate", 0.5, "--parameters-rate must lie between 1 and 1000"),
        ("--parameters-rate", 1001, "--parameters-rate must lie between 1 and 1000"),
        ("--seconds", 0, "--seconds must be greater than 0"),
    ],
)
def test_bad_numbers_are_refused(refused, endpoint, sensed, option, value, said):
    assert said in refused("telepresence", "sensor", option, value)
    assert not sensed


def test_the_ends_of_the_rates_are_allowed(papilla, endpoint, sensed):
    for rate in (1, 1000):
        assert papilla("telepresence", "sensor", "--parameters-rate", rate).code == 0
        assert sensed["parameters_Hz"] == rate


def test_a_display_writes_a_row_for_each_period(papilla, endpoint, monkeypatch, tmp_path):
    from papilla.telepresence.local_model import Shown
    from papilla.telepresence.messages import Modulus, Trust

    asked, missing = {}, SimpleNamespace(modulus=None, area=None, mu_kinetic=None, mu_static=None)
    there = SimpleNamespace(**vars(missing) | {"modulus": Modulus(0.5, 0.1, int(Trust.DOUBTED))})

    def run_display(endpoint, model, motion, *, period, keep=None, **how):
        asked.update(model=model, motion=motion, **how)
        for k in range(250 if keep else 0):
            keep(k / 1000, 0.5 * k, Shown(1.0 * k, 2.0, 3.0, 4.0, 0.5, 0), there if k > 100 else None)

    monkeypatch.setattr(processes, "run_display", run_display)
    options = ("--speed", 50, "--strokes", 0, "--force", 0.25, "--components", 2, "--seconds", 2, "--out", "shown.csv")
    assert papilla("telepresence", "display", *options).code == 0
    motion = asked["motion"]
    assert (motion.peak_mm_s, motion.strokes_Hz, motion.press_N) == (50.0, 0.0, 0.25) and asked["seconds"] == 2
    assert asked["model"].components == 2
    assert endpoint.made[:2] == (Address("127.0.0.1", 47002), Address("127.0.0.1", 47001))
    with (tmp_path / "shown.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 250 and [float(row["t_s"]) for row in rows] == [k / 1000 for k in range(250)]
    last = rows[-1]
    told = [float(last[name]) for name in ("position_mm", "displacement_um", "drive_V", "wavelength_mm", "gain")]
    assert told == [124.5, 249.0, 2.0, 4.0, 0.5]
    assert (last["modulus_MPa"], last["modulus_sigma_MPa"], last["modulus_status"]) == ("0.5", "0.1", "doubted")
    assert last["mu_kinetic"] == "" and rows[100]["modulus_status"] == "" != rows[101]["modulus_status"]
    assert papilla("telepresence", "display").code == 0 and asked["seconds"] == math.inf


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


def test_without_a_key_the_link_stays_on_this_machine(refused):
    here = f"127.0.0.1:{free_ports(1)[0]}"
    for end in ("sensor", "display"):
        said = refused("telepresence", end, "--listen", "0.0.0.0:0", "--peer", here, "--seconds", 0.01)
        assert "--listen must be HOST:PORT" in said
        said = refused("telepresence", end, "--listen", "0.0.0.0:47099", "--peer", here, "--seconds", 0.01)
        assert "listening at 0.0.0.0, which other machines reach, needs a key (--key-file)" in said
        said = refused("telepresence", end, "--listen", here, "--peer", "192.0.2.1:9", "--seconds", 0.01)
        assert "192.0.2.1:9 is another machine, which needs a key (--key-file)" in said


def test_to_another_machine_it_is_said_that_nothing_is_encrypted(papilla, tmp_path):
    (tmp_path / "link.key").write_text("a secret of two ends\n")
    (tmp_path / "link.key").chmod(0o600)
    way = ("--listen", f"0.0.0.0:{free_ports(1)[0]}", "--peer", "192.0.2.1:9")
    answer = papilla("telepresence", "sensor", *way, "--key-file", "link.key", "--seconds", 0.01)
    assert answer.code == 0
    assert "messages to 192.0.2.1:9 are signed, not encrypted: whoever is on the way can read them" in answer.err


def test_addresses_must_differ(refused, endpoint, sensed):
    said = refused("telepresence", "sensor", "--listen", "127.0.0.1:5000", "--peer", "127.0.0.1:5000")
    assert "--listen and --peer must differ, got 127.0.0.1:5000 twice" in said
    assert "--peer must be HOST:PORT" in refused("telepresence", "sensor", "--peer", "here")
    assert "--listen must be HOST:PORT" in refused("telepresence", "sensor", "--listen", "here")


@pytest.mark.parametrize("stop", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_an_end_with_130_and_its_summary(papilla, endpoint, monkeypatch, stop):
    before = {one: signal.getsignal(one) for one in (signal.SIGINT, signal.SIGTERM)}
    monkeypatch.setattr(processes, "run_sensor", lambda *_, **__: signal.raise_signal(stop))
    answer = papilla("telepresence", "sensor")
    assert answer.code == 130 and answer.out.startswith("0 periods, 0 missed; 7 messages sent")
    assert signal.getsignal(signal.SIGINT) == before[signal.SIGINT]


def live(time_s: float, state: str, said: str = "") -> processes.Live:
    from papilla.telepresence.gate import Counts

    return processes.Live(time_s, state, said, Counts(accepted=5, old=2), SimpleNamespace(missed=1))


def test_away_from_a_terminal_a_state_is_said_when_it_changes_and_every_five_seconds(capsys):
    with ends._live() as report:
        for time_s in (0.0, 1.0, 4.9, 5.0, 9.9):
            report(live(time_s, "ok", "2 mm"))
        report(live(10.0, "silent"))
    lines = capsys.readouterr().err.splitlines()
    assert [line.split(" s  ")[0].strip() for line in lines] == ["0.0", "5.0", "10.0"]
    assert lines[0].strip() == "0.0 s  ok; 2 mm; 5 messages, 2 dropped, 1 periods missed"
    assert lines[2].strip() == "10.0 s  silent; 5 messages, 2 dropped, 1 periods missed"


def test_on_a_terminal_one_line_is_overwritten(capsys, monkeypatch):
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    monkeypatch.setenv("COLUMNS", "21")
    with ends._live() as report:
        report(live(0.0, "ok"))
        report(live(0.1, "ok"))
    said = capsys.readouterr().err
    assert said == "\r\x1b[2K     0.0 s  ok; 5 me\r\x1b[2K     0.1 s  ok; 5 me\n"
