"""The whole loop, simulated: hand, uplink, sensor, downlink, and both displays on the same signals.

In every control period the hand, the sensor and the display step once, as in the processes of a real link
(`papilla.telepresence.ends`); only their wires are simulated. Direct feedback receives the sensor's raw samples over
a link of the same delays.
"""

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from papilla.core import checks
from papilla.core.errors import InputError
from papilla.core.progress import CountedStep, Progress, silent
from papilla.core.units import MS_PER_S, NS_PER_S, S_PER_H
from papilla.telepresence.direct import DirectFeedback, HighPass
from papilla.telepresence.ends import DisplayEnd, HandEnd, SensorEnd, TouchSource
from papilla.telepresence.gate import SESSION_BITS, Received
from papilla.telepresence.link import HEADER_BYTES, Link, LinkModel
from papilla.telepresence.local_model import LocalModel, Shown
from papilla.telepresence.messages import MESSAGE_VERSION, Header, Message, Samples, encode
from papilla.telepresence.motion import HAND_RATE_HZ, PARAMETERS_HZ, HandMotion
from papilla.telepresence.record import LoopRecord
from papilla.telepresence.touch import SIMULATED_NOISE_MICROSTRAIN, ReadingSource, Soft, TouchLog

PERIOD_NS = round(NS_PER_S / HAND_RATE_HZ)
CLOCK_NS = 2**45
"""Clocks of the ends at the beginning, ten hours: encoded times are then as long as real ones."""
PROGRESS_ROWS = 250
"""Number of control periods between two calls of `progress`."""


@dataclass(frozen=True)
class Set:
    """The simulated scene.

    Parameters
    ----------
    texture : under the sensor. motion : of the hand. seconds : duration.
    uplink, downlink : one way each, hand to sensor and sensor to display.
    noise_microstrain : standard deviation of a reading. components : of the local model.
    parameters_Hz : messages to the local model a second. seed : of noise and links.
    start_mm : place of the texture under the hand's 0.
    soft : specimen under the texture, and the calibrated finger that presses on it; None: one gauge, the texture alone.
    """

    texture: ReadingSource
    motion: HandMotion = field(default_factory=HandMotion)
    seconds: float = 8.0
    uplink: LinkModel = field(default_factory=LinkModel)
    downlink: LinkModel = field(default_factory=LinkModel)
    noise_microstrain: float = SIMULATED_NOISE_MICROSTRAIN
    components: int = 1
    parameters_Hz: float = PARAMETERS_HZ
    seed: int = 0
    start_mm: float = 0.0
    soft: Soft | None = None

    def __post_init__(self):
        checks.within("seconds", self.seconds, 2, S_PER_H)
        checks.within("parameters_Hz", self.parameters_Hz, 1, HAND_RATE_HZ)


class SimulatedWire:
    """The wire of one end, on the clock `time_s` that the loop sets; `number` tells the ends apart.

    Its headers are as long as real ones; they prove nothing, because the link is trusted.
    """

    def __init__(self, out: Link, into: Link, number: int):
        self.time_s, self._out, self._into = 0.0, out, into
        self._session, self._sequence, self._newest_s = 2**SESSION_BITS + number, itertools.count(1), -math.inf

    def now_ns(self) -> int:
        """The time of the loop."""
        return round(NS_PER_S * self.time_s)

    def send(self, make: Callable[[Header], Message]) -> None:
        """Send the message that `make` makes under the next header."""
        now = CLOCK_NS + self.now_ns()
        header = Header(MESSAGE_VERSION, self._session, next(self._sequence), now, self._session + 1, now, PERIOD_NS)
        message = make(header)
        self._out.send(self.time_s, message, len(encode(message)))

    def receive(self) -> list[Received]:
        """The messages that have arrived; overtaken and duplicate ones are left out, as by `gate.Gate`."""
        accepted = []
        for sent, arrived, message in self._into.receive(self.time_s):
            if sent > self._newest_s:
                self._newest_s = sent
                accepted.append(Received(message, round(NS_PER_S * arrived), round(NS_PER_S * sent), math.nan))
        return accepted


class DirectEnd:
    """Direct feedback, with the sensor's raw samples on their way to it."""

    def __init__(self, scene: Set, link: Link, feedback: DirectFeedback):
        self._texture, self._feedback, self.wire = scene.texture, feedback, SimulatedWire(link, link, 2)
        # The force changes a pressed gauge's reading far more than a texture; the amplifier's coupling removes it
        self._coupled = HighPass(HAND_RATE_HZ) if scene.soft else float
        # Of each sample that is on its way, by its number: the place, and the time on the hand's clock
        self._sensed: dict[int, tuple[float, float]] = {}
        self._shown = math.nan, math.nan

    def step(self, now: float, sensor: SensorEnd, source: TouchSource) -> tuple[float, ...]:
        """displacement_um and status now; for the displayed sample, the wavelength (mm) under the sensor and the time
        (ms) since the hand was there."""
        if sensor.sample is not None:
            reading = self._coupled(sensor.sample[1])

            def sampled(header: Header) -> Samples:
                self._sensed[header.sequence] = source.place_mm, source.playing_s
                return Samples(header, PERIOD_NS, (reading,))

            self.wire.send(sampled)
        for received in self.wire.receive():
            assert isinstance(received.message, Samples)
            place, played = self._sensed.pop(received.message.header.sequence)
            self._shown = self._texture.wavelength(place), played
            self._feedback.take_reading(now, *received.message.readings)
        displayed, (wavelength, played) = self._feedback.update(now), self._shown
        return displayed.displacement_um, displayed.status, wavelength, MS_PER_S * (now - played)


def run(
    scene: Set, local: LocalModel | None = None, direct: DirectFeedback | None = None, progress: Progress = silent
) -> LoopRecord:
    """Simulate the loop: both displays receive the same sensor over links of the same model and seed.

    `progress` is called now and then with the simulated and the total seconds.

    Raises `InputError` if the strokes leave a recorded texture, or if the force leaves the calibrated range.
    """
    model = LocalModel(components=scene.components) if local is None else local
    seeds = np.random.SeedSequence(scene.seed).generate_state(3).tolist()
    # With the same seed both links have the same delays at any time; each loses its own datagrams.
    up, down = Link(scene.uplink, seeds[0]), {name: Link(scene.downlink, seeds[1]) for name in ("local", "direct")}
    sensor_wire, hand_wire = SimulatedWire(down["local"], up, 1), SimulatedWire(up, down["local"], 0)
    touch = TouchLog(scene.texture, scene.noise_microstrain, scene.soft)
    source = TouchSource(touch, seeds[2])
    hand = HandEnd(hand_wire, model, scene.motion, start_mm=scene.start_mm)
    sensor = SensorEnd(sensor_wire, source, touch.sensing(scene.components), scene.parameters_Hz)
    display = DisplayEnd(hand_wire, model)
    feedback = DirectEnd(scene, down["direct"], DirectFeedback() if direct is None else direct)
    places, outputs, felt, messages = [], [], [], []
    time = np.arange(round(scene.seconds * HAND_RATE_HZ)) / HAND_RATE_HZ
    for period, now in enumerate(time.tolist()):
        if period % PROGRESS_ROWS == 0:
            progress(CountedStep("simulating", round(now), round(scene.seconds)))
        # One clock for both ends, and a fixed order of steps: the run is the same for the same seed.
        hand_wire.time_s = sensor_wire.time_s = feedback.wire.time_s = now
        places.append(hand.step(now))
        sensor.step(now)
        if sensor.sample is not None and not math.isfinite(sensor.sample[1]):
            raise InputError(
                f"there is no reading, {source.said}: make the strokes of the hand shorter, or press within the "
                "calibrated forces"
            )
        felt.append(feedback.step(now, sensor, source))
        outputs.append(display.step(now))
        messages.append(display.message)
    displays = np.array(outputs), np.array(felt)
    return _record(scene, time, np.array(places), displays, down, messages)


def _record(
    scene: Set, time, hand, displays: tuple[np.ndarray, np.ndarray], down: dict[str, Link], messages
) -> LoopRecord:
    """A run as arrays; displays : rows of `Shown` of the local model, and results of `DirectEnd.step`."""
    local, direct = displays
    outputs = dict(zip(Shown._fields, local.T, strict=True))
    direct_um, direct_status, direct_mm, round_trip_ms = direct.T
    payload = {name: link.bytes_sent for name, link in down.items()}
    return LoopRecord(
        time_s=time,
        hand_mm=hand,
        truth_mm=np.array([scene.texture.wavelength(place) for place in hand.tolist()]),
        local_um=outputs["displacement_um"],
        direct_um=direct_um,
        wavelength_mm=np.where(outputs["gain"] > 0, outputs["wavelength_mm"], math.nan),
        direct_mm=direct_mm,
        local_status=outputs["status"].astype(int),
        direct_status=direct_status.astype(int),
        bytes_per_s={name: number / scene.seconds for name, number in payload.items()},
        with_headers={
            name: (number + HEADER_BYTES * down[name].sent) / scene.seconds for name, number in payload.items()
        },
        round_trip_ms=round_trip_ms,
        lost={name: link.lost / max(1, link.sent) for name, link in down.items()},
        messages=messages,
    )
