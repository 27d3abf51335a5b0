"""What each end of the loop sends and when, over a wire that only keeps what is sent."""

import gc
import math
import sys

import numpy as np
import pytest
from stepped_clock import SteppedClock

from papilla.logs import read_time_log
from papilla.telepresence import GratingTexture, HandMotion, LocalModel, QuantityTrust, TouchLog
from papilla.telepresence.ends import CATCH_UP, DisplayEnd, HandEnd, LogSource, SensorEnd, Timer, TouchSource
from papilla.telepresence.gate import Gate, Received
from papilla.telepresence.messages import MESSAGE_VERSION, Header, Length, Modulus, Parameters, Strain, quantity
from papilla.telepresence.messages import TextureLine as TextureLine
from papilla.telepresence.processes import TickGrid, run_display, run_sensor

HEADER = Header(MESSAGE_VERSION, 1, 1, 0, 0, 0, 0)


class KeptWire:
    """Keeps what is sent with its time, and gives what is put into `arrived`."""

    def __init__(self):
        self.now, self.sent, self.arrived = 0.0, [], []

    def now_ns(self):
        return round(1e9 * self.now)

    def send(self, make):
        self.sent.append((self.now, make(HEADER)))

    def receive(self):
        arrived, self.arrived = self.arrived, []
        return arrived


@pytest.fixture
def wire():
    return KeptWire()


@pytest.mark.parametrize("rate_Hz, rows", [(250, 4), (50, 20), (1000, 1), (30, 33)])
def test_a_timer_keeps_its_rate_on_the_grid_of_periods(rate_Hz, rows):
    timer = Timer(rate_Hz)
    due = [row for row in range(100) if timer.due(row / 1000)]
    assert due == list(range(0, 100, rows))


def test_the_hand_is_read_250_times_a_second_by_display_and_sensor_alike(wire):
    model, motion = LocalModel(), HandMotion()
    hand = HandEnd(wire, model, motion, start_mm=7.0, period_s=1 / 4000)
    for row in range(401):
        wire.now = row / 4000
        assert hand.step(wire.now) == pytest.approx(7.0 + motion.place_mm(wire.now))
    times, messages = zip(*wire.sent, strict=True)
    assert times == pytest.approx([0.004 * number for number in range(26)])
    assert messages[-1].position.value == pytest.approx(7.0 + motion.place_mm(0.1)) == model.hand.state.place_mm
    assert messages[-1].force.value == pytest.approx(motion.force_N(0.1))


def test_the_sensor_samples_where_the_hand_is_and_sends_50_times_a_second(wire):
    touch = TouchLog(GratingTexture(1.2), 0.0)
    sensor = SensorEnd(wire, TouchSource(touch), touch.sensing())
    reached = KeptWire()
    hand = HandEnd(reached, LocalModel(), HandMotion(100.0, 0.0))
    sensor.step(0.0)
    assert sensor.sample is None and sensor.received_s == -math.inf, "nobody knows where the hand is"
    for row in range(1, 401):
        reached.now = wire.now = row / 1000
        hand.step(wire.now)
        wire.arrived = [Received(one, round(1e9 * at), round(1e9 * at), 0.0) for at, one in reached.sent]
        reached.sent.clear()
        sensor.step(wire.now)
        assert sensor.sample[0] == wire.now
    assert sensor.sample[2] == pytest.approx(100 * wire.now, abs=1e-6)
    assert sensor.sample[1] == pytest.approx(touch.texture.reading(sensor.sample[2], 100.0))
    assert len(wire.sent) == 21 and sensor.received_s == 0.397, "the last reading of the hand"
    found = wire.sent[-1][1]
    assert found.texture == QuantityTrust.OK and found.lines[0].wavelength.value == pytest.approx(1.2, rel=0.01)


def test_late_samples_are_made_up_for_some_in_a_period(wire):
    class Late:
        columns, gauges, over, said = ("position_mm",), 1, False, ""

        def __init__(self):
            self.number = 0

        def take_message(self, received):
            raise AssertionError("nothing was sent")

        def sample(self, now_s, now_ns):
            self.number += 1
            return 0.001 * self.number, 0.0, 0.0

    source, touch = Late(), TouchLog(GratingTexture(1.2))
    sensor = SensorEnd(wire, source, touch.sensing())
    sensor.step(0.01)
    assert source.number == CATCH_UP
    for _ in range(2):
        sensor.step(0.01)
    assert source.number == 10, "up to the sample of now"


def test_the_display_learns_from_parameters_alone(wire):
    model = LocalModel()
    display, hand = DisplayEnd(wire, model), HandEnd(wire, model, HandMotion(100.0, 0.0))
    line = TextureLine(quantity(Length, 2.0), quantity(Strain, 50.0))
    shown = []
    for row in range(200):
        wire.now = row / 1000
        hand.step(wire.now)
        if row == 100:
            messages = Parameters(HEADER, 0, (line,)), wire.sent[-1][1]
            wire.arrived = [Received(message, 0, 0, 3e6) for message in messages]
        shown.append(display.step(wire.now))
    assert all(one.displacement_um == 0 for one in shown[:100]) and shown[-1].wavelength_mm == 2.0
    assert max(abs(one.displacement_um) for one in shown[100:]) > 5
    assert display.message.lines == (line,) and display.age_ns == 3e6


def test_a_log_is_played_again_at_its_times(tmp_path):
    time = 5 + np.arange(6) / 100
    rows = np.column_stack([time, 40 * time, 30 * time, np.full(6, 0.5)])
    np.savetxt(tmp_path / "log.csv", rows, delimiter=",", header="t_s,g1,g2,force_N", comments="")
    source = LogSource(read_time_log(tmp_path / "log.csv"))
    assert (source.columns, source.gauges, source.over) == (("force_N",), 2, False)
    assert source.sample(0.0, 0) == pytest.approx((0, 200, 150, 0.5)) and source.sample(0.005, 0) is None
    late = [source.sample(0.2, 0) for _ in range(5)]
    assert [sample[0] for sample in late] == pytest.approx([0.01, 0.02, 0.03, 0.04, 0.05])
    assert source.over and source.said == "row 6 of 6" and source.sample(9.0, 0) is None


def on_a_stepped_clock(wire):
    clock, wire.gate = SteppedClock(), Gate()
    return TickGrid(1e-3, clock, clock.sleep)


def test_the_line_of_the_display_tells_what_it_knows_four_times_a_second(wire):
    period, told = on_a_stepped_clock(wire), []
    modulus = quantity(Modulus, 0.1, 0.02)
    line = TextureLine(quantity(Length, 2.0), quantity(Strain, 50.0))

    def keep(now, place, shown, message):
        if now == pytest.approx(0.3):
            wire.arrived = [Received(Parameters(HEADER, 0, (line,), modulus), 0, 0, 3e6)]

    found = run_display(
        wire, LocalModel(), HandMotion(100.0, 0.0), seconds=0.6, report=told.append, keep=keep, period=period
    )
    assert found is period and period.missed == 0
    assert [live.time_s for live in told] == pytest.approx([0, 0.25, 0.5])
    assert told[0].said == told[1].said == "" and "no message about a texture" in told[1].state
    assert told[2].said.startswith("2.000 mm, 50 Hz, gain 1.00") and "0.1 ± 0.02 MPa" in told[2].said
    assert told[2].said.endswith("last message 3.0 ms old when it came") and told[2].state == "ok"
    assert len(wire.sent) == 150, "the hand's place, 250 times a second"


def test_the_line_of_the_sensor_says_whether_a_display_is_heard(wire):
    period, told, touch = on_a_stepped_clock(wire), [], TouchLog(GratingTexture(1.2), 0.0)
    run_sensor(wire, TouchSource(touch), touch.sensing(), seconds=1.6, report=told.append, period=period)
    assert [live.time_s for live in told] == pytest.approx([0.25 * number for number in range(7)])
    assert all(live.state == "no display has sent a message" and live.said == "" for live in told)


def test_a_display_that_runs_holds_no_more_with_time(wire):
    """The objects that Python holds grow by none a message or period."""
    period, held = on_a_stepped_clock(wire), []
    line = TextureLine(quantity(Length, 2.0), quantity(Strain, 50.0))

    def keep(now, place, shown, message):
        row = round(1e3 * now)
        wire.sent.clear()
        if row % 20 == 0:
            wire.arrived = [Received(Parameters(HEADER, 0, (line,)), 0, 0, 3e6)]
        if row in (10_000, 29_999):
            gc.collect()
            held.append(sys.getallocatedblocks())

    run_display(wire, LocalModel(), HandMotion(100.0, 1.0), seconds=30.0, keep=keep, period=period)
    assert held[1] - held[0] < 500, "one a message would be 1000, one a period 20,000"
