"""The real link: two processes over UDP, killed and started again; strangers and floods; a loop that keeps time."""

import json
import re
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
from free_ports import free_ports
from stepped_clock import SteppedClock

from papilla.core.errors import FileAccessError, InputError
from papilla.telepresence import Address, Endpoint
from papilla.telepresence.messages import HandReading, Length, quantity
from papilla.telepresence.processes import TickGrid, TimeHistogram

PATIENCE_S = 60.0


class End:
    """A process of the command line, and the live lines that it writes."""

    def __init__(self, name, listen, peer, *options):
        command = [sys.executable, "-m", "papilla", "telepresence", name, "--json", *options]
        command += ["--listen", f"127.0.0.1:{listen}", "--peer", f"127.0.0.1:{peer}"]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.lines = []
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self):
        for line in self.process.stderr:
            self.lines.append(line)

    def wait_for(self, state):
        """Until a new live line tells this state."""
        known, deadline = len(self.lines), time.monotonic() + PATIENCE_S
        while not any(re.search(rf" s  {state}", line) for line in self.lines[max(0, known - 1) :]):
            assert time.monotonic() < deadline and self.process.poll() is None, (state, self.lines)
            time.sleep(0.05)

    def end(self, how=signal.SIGINT):
        self.process.send_signal(how)
        out = self.process.stdout.read()
        code = self.process.wait(PATIENCE_S)
        self._reader.join(PATIENCE_S)
        self.process.stdout.close()
        self.process.stderr.close()
        return code, out


@pytest.fixture
def start():
    """Starts an `End`; what still runs after the test is killed."""
    ends = []

    def begin(*arguments):
        ends.append(End(*arguments))
        return ends[-1]

    yield begin
    for one in ends:
        if not one.process.stdout.closed:
            one.end(signal.SIGKILL)


@pytest.mark.slow
@pytest.mark.parametrize("with_key", [False, True])
def test_either_process_survives_kill_9_of_the_other(start, tmp_path, with_key):
    ports, options = free_ports(2), ()
    if with_key:
        (tmp_path / "key").write_bytes(b"a secret of more than 16 bytes")
        (tmp_path / "key").chmod(0o600)
        options = ("--key-file", str(tmp_path / "key"))
    sensor = start("sensor", *ports, *options)
    display = start("display", *reversed(ports), *options, "--out", str(tmp_path / "shown.csv"))
    display.wait_for("ok")
    assert sensor.end(signal.SIGKILL)[0] == -signal.SIGKILL
    display.wait_for("no message for too long")
    sensor = start("sensor", *ports, *options)
    display.wait_for("ok")
    code, out = display.end()
    assert code == 130 and json.loads(out)["received"]["forged"] == 0
    assert (tmp_path / "shown.csv").read_text().startswith("t_s,position_mm,displacement_um")
    sensor.wait_for("no display")
    display = start("display", *reversed(ports), *options)
    display.wait_for("ok")
    assert display.end(signal.SIGKILL)[0] == -signal.SIGKILL
    sensor.wait_for("no display")
    code, out = sensor.end()
    assert code == 130 and json.loads(out)["sent"] > 0


@pytest.mark.slow
def test_a_peer_that_sleeps_silences_the_display_which_comes_back_without_a_step(start, tmp_path):
    ports = free_ports(2)
    sensor = start("sensor", *ports)
    display = start("display", *reversed(ports), "--out", str(tmp_path / "shown.csv"))
    for _ in range(2):
        display.wait_for("ok")
        sensor.process.send_signal(signal.SIGSTOP)
        display.wait_for("no message for too long")
        time.sleep(0.5)
        sensor.process.send_signal(signal.SIGCONT)
        display.wait_for("ok")
    display.process.send_signal(signal.SIGSTOP)
    sensor.wait_for("no display")
    display.process.send_signal(signal.SIGCONT)
    display.wait_for("ok")
    assert display.end(signal.SIGTERM)[0] == 130, "a polite kill keeps the table"
    shown = np.genfromtxt(tmp_path / "shown.csv", delimiter=",", names=True, dtype=None, encoding=None)
    gain, since = shown["gain"], np.diff(shown["t_s"])
    assert (gain[shown["t_s"] > 1] == 0).any() and gain[-1] > 0
    # Up in 0.1 s, down in 0.3 s, and a late period counts as 5 ms at most.
    assert (np.diff(gain) <= np.minimum(since, 0.005) / 0.1 + 1e-9).all()
    assert (np.diff(gain) >= -np.minimum(since, 0.005) / 0.3 - 1e-9).all()
    assert np.nanmedian(shown["wavelength_mm"]) == pytest.approx(1.2, rel=0.03)
    assert (np.abs(shown["displacement_um"]) <= 27.5 * gain + 1e-9).all(), "what is displayed fades with the gain"
    assert np.abs(shown["displacement_um"]).max() > 5


def test_only_the_peer_is_heard_and_a_flood_is_bounded():
    ports = free_ports(3)
    here, there, stranger = (Address("127.0.0.1", port) for port in ports)
    with Endpoint(here, there) as one, Endpoint(there, here) as other, Endpoint(stranger, here) as loud:
        for _ in range(200):
            loud.send(lambda header: HandReading(header, quantity(Length, 1.0)))
        assert one.receive() == [] and one.gate.counts.foreign <= 64, "a flood costs a period this much"
        for _ in range(20):
            assert one.receive() == []
            time.sleep(0.005)
        assert one.gate.counts.foreign > 100
        heard = []
        for _ in range(5):
            for end in (one, other):
                end.send(lambda header: HandReading(header, quantity(Length, 2.0)))
            time.sleep(0.01)
            heard += one.receive() + other.receive()
        assert one.gate.counts.accepted and other.gate.counts.accepted
        assert {item.message.position.value for item in heard} == {2.0}
        assert 0 <= one.gate.offset.round_trip_ns < 1e9


def test_sending_where_nobody_listens_is_no_error():
    ports = free_ports(2)
    with Endpoint(Address("127.0.0.1", ports[0]), Address("127.0.0.1", ports[1])) as lonely:
        for _ in range(5):
            lonely.send(lambda header: HandReading(header, quantity(Length, 1.0)))
            assert lonely.receive() == []
        assert lonely.sent + lonely.unsent == 5


@pytest.mark.parametrize("text", ["a:1", "10.0.0.1:65535", "[::1]:7"])
def test_an_address_is_shown_as_it_is_given(text):
    assert str(Address.of(text, "--peer")) == text


@pytest.mark.parametrize("text", ["", "host", "host:", ":1", "host:0", "host:65536", "host:-1", "host:1x", "host:²"])
def test_an_address_that_is_none_is_refused(text):
    with pytest.raises(InputError, match="--peer must be HOST:PORT"):
        Address.of(text, "--peer")


KEY = b"a secret of more than 16 bytes"


def test_without_a_key_nothing_listens_or_sends_off_this_machine():
    """192.0.2.1 is an address of documentation (RFC 5737): nobody has it."""
    here, away = Address("127.0.0.1", free_ports(1)[0]), Address("192.0.2.1", 9)
    for everywhere in (Address("0.0.0.0", 0), Address("::", 0), away):
        peer = Address("::1" if ":" in everywhere.host else "127.0.0.1", 9)
        with pytest.raises(InputError, match="listening at .* needs a key"):
            Endpoint(everywhere, peer)
    with pytest.raises(InputError, match="192.0.2.1:9 is another machine, which needs a key"):
        Endpoint(here, away)
    with Endpoint(Address("0.0.0.0", 0), away, KEY) as open_end, Endpoint(here, Address("127.0.0.2", 9)) as own:
        assert open_end.leaves_machine and not own.leaves_machine


def test_an_address_in_use_is_one_clear_error():
    port, other = free_ports(2)
    address = Address("127.0.0.1", port)
    with Endpoint(address, Address("127.0.0.1", other)), pytest.raises(FileAccessError, match="cannot listen"):
        Endpoint(address, Address("127.0.0.1", other))


def test_the_loop_keeps_its_grid_and_counts_what_it_missed():
    clock = SteppedClock()
    period, times = TickGrid(1e-3, clock, clock.sleep), []
    for now in period.ticks(0.1):
        times.append(now)
        clock.sleep(0.0052 if len(times) == 10 else 0.0002)
    assert period.missed == 4 and len(times) == 96
    assert times[9] == pytest.approx(0.009) and times[10] == pytest.approx(0.0142) and times[-1] == pytest.approx(0.099)
    assert period.work.quantile_s(0.5) == pytest.approx(0.0002, rel=0.05)
    assert period.work.greatest_s == pytest.approx(0.0052)


def test_quantiles_of_times_are_right_to_a_bin():
    spread = TimeHistogram()
    for number in range(1, 1001):
        spread.add(1e-6 * number)
    assert spread.quantile_s(0.5) == pytest.approx(500e-6, rel=0.05)
    assert spread.quantile_s(0.999) == pytest.approx(999e-6, rel=0.05)
    beyond = TimeHistogram()
    for seconds in (50.0, 100.0):
        beyond.add(seconds)
    assert 10 <= beyond.quantile_s(0.5) <= 10.4, "ten seconds and more are one bin"
    spread.add(1e9)
    assert spread.greatest_s == 1e9 and TimeHistogram().quantile_s(0.5) != TimeHistogram().quantile_s(0.5)
