"""The ends of a telepresence loop: hand, sensor and display. Each steps once per control period.

    hand  -- HandReading, 250 Hz -->  sensor  -- Parameters, 50 Hz -->  display

Hand and display are at the operator's side, the sensor is where the finger touches. A `Wire` carries their messages: a
simulated one in `papilla.telepresence.loop`, UDP in `papilla.telepresence.processes`.
"""

import math
from collections.abc import Callable
from functools import partial
from typing import Protocol

import numpy as np

from papilla.core.units import S_PER_NS
from papilla.logs import TimeLog
from papilla.telepresence.gate import Received
from papilla.telepresence.local_model import LocalModel, Shown
from papilla.telepresence.messages import (
    Force,
    HandReading,
    Header,
    Length,
    Message,
    Parameters,
    QuantityTrust,
    quantity,
)
from papilla.telepresence.motion import HAND_HZ, HAND_RATE_HZ, PARAMETERS_HZ, HandMotion, RemoteHand
from papilla.telepresence.sensing import Sensing
from papilla.telepresence.touch import TouchLog


class FingerSource(Protocol):
    """Finger, arm and board, or a replacement; users of real ones write their own class."""

    columns: tuple[str, ...]
    gauges: int

    def take_message(self, received: Received) -> None:
        """Take a message of the display."""

    def sample(self, now_s: float, now_ns: int) -> tuple[float, ...] | None:
        """The present sample, (t_s, gauges ..., columns ...); None if there is none yet, or no more."""

    @property
    def over(self) -> bool:
        """Whether no more samples will come."""

    @property
    def said(self) -> str:
        """The state in a few words."""


class TouchSource:
    """A `Touch` at the place and with the force of the remote hand; seed : of the noise."""

    over = False

    def __init__(self, touch: TouchLog, seed: int = 0):
        self.columns, self.gauges = touch.columns, touch.gauges
        self._touch, self._remote, self._noise = touch, RemoteHand(), np.random.default_rng(seed)
        self.place_mm = self._force = math.nan

    def take_message(self, received: Received) -> None:
        """Follow the hand."""
        message = received.message
        if not isinstance(message, HandReading):
            return
        if message.position.value is not None:
            self._remote.read(S_PER_NS * received.arrived_ns, S_PER_NS * received.sent_ns, message.position.value)
        if message.force is not None and message.force.value is not None:
            self._force = message.force.value

    def sample(self, now_s: float, now_ns: int) -> tuple[float, ...] | None:
        """Time and row; None before the first message of a hand."""
        self.place_mm, speed = self._remote.at(S_PER_NS * now_ns)
        if not math.isfinite(self.place_mm):
            return None
        normal = self._noise.standard_normal(self._touch.numbers).tolist()
        return now_s, *self._touch.row(self.place_mm, speed, self._force, normal)

    @property
    def playing_s(self) -> float:
        """The time on the hand's clock at which it was at the place of the last sample."""
        return self._remote.playing_s

    @property
    def said(self) -> str:
        """Place and force of the hand."""
        pressing = f", {self._force:.2f} N" if math.isfinite(self._force) else ""
        return f"hand at {self.place_mm:.1f} mm{pressing}"


class LogSource:
    """The rows of a log at their times, as if they were measured now; the display's hand does not affect them."""

    def __init__(self, log: TimeLog):
        optional = ("force_N", "velocity_mm_s", "position_mm", "tangential_N")
        self.columns = tuple(name for name in optional if getattr(log, name) is not None)
        self.gauges, self._next = len(log.gauge_names), 0
        rows = np.column_stack([log.t_s - log.t_s[0], log.readings, *(getattr(log, name) for name in self.columns)])
        self._rows = [tuple(sample) for sample in rows.tolist()]

    def take_message(self, received: Received) -> None:
        """The log does not follow the hand."""

    def sample(self, now_s: float, now_ns: int) -> tuple[float, ...] | None:
        """The next row, when its time has come."""
        if self.over or self._rows[self._next][0] > now_s:
            return None
        self._next += 1
        return self._rows[self._next - 1]

    @property
    def over(self) -> bool:
        """Whether the last row was passed on."""
        return self._next >= len(self._rows)

    @property
    def said(self) -> str:
        """The progress in the log."""
        return f"row {self._next} of {len(self._rows)}"


CATCH_UP = 4
"""Largest number of samples that one control period takes."""


class Wire(Protocol):
    """Carries messages to the other end and back."""

    def now_ns(self) -> int:
        """The clock of this end, in ns."""

    def send(self, make: Callable[[Header], Message]) -> None:
        """Send the message that `make` builds with the next header."""

    def receive(self) -> list[Received]:
        """What has arrived, oldest first."""


class Timer:
    """Shows in which control periods something is due, at a rate that need not divide that of the periods."""

    def __init__(self, rate_Hz: float, period_s: float = 1 / HAND_RATE_HZ):
        self._wait_s, self._last_s = 1 / rate_Hz - 0.5 * period_s, -math.inf

    def due(self, now: float) -> bool:
        """Whether it is time now."""
        if now - self._last_s < self._wait_s:
            return False
        self._last_s = now
        return True


class HandEnd:
    """The operator's hand; its motion replaces the encoder of a slider. start_mm : its first place."""

    def __init__(
        self,
        wire: Wire,
        model: LocalModel,
        motion: HandMotion,
        *,
        start_mm: float = 0.0,
        period_s: float = 1 / HAND_RATE_HZ,
    ):
        self._wire, self._model, self._motion, self._start_mm = wire, model, motion, start_mm
        self._timer = Timer(HAND_HZ, period_s)

    def step(self, now: float) -> float:
        """The hand's place now (mm); when it is due, the place is sent to the sensor and given to the display."""
        place = float(self._motion.place_mm(now)) + self._start_mm
        if self._timer.due(now):
            force = float(self._motion.force_N(now))
            self._model.move(now, place, force)
            reading = partial(HandReading, position=quantity(Length, place), force=quantity(Force, force))
            self._wire.send(reading)
        return place


class SensorEnd:
    """The sensor, whose source follows the hand: samples go into the estimators, and their results are sent.

    sample : the last one of this period, None if there was none. received_s : time of the last message of the hand.
    """

    def __init__(
        self,
        wire: Wire,
        source: FingerSource,
        sensing: Sensing,
        parameters_Hz: float = PARAMETERS_HZ,
        period_s: float = 1 / HAND_RATE_HZ,
    ):
        self._wire, self._source, self._sensing, self._period_s = wire, source, sensing, period_s
        self._timer = Timer(parameters_Hz, period_s)
        self.sample: tuple[float, ...] | None = None
        self.received_s = -math.inf

    def step(self, now: float) -> None:
        """Follow the hand, take the present samples and, when it is due, send the estimates."""
        for received in self._wire.receive():
            self.received_s = now
            self._source.take_message(received)
        self.sample = None
        # Late samples are caught up, several in one period.
        for _ in range(CATCH_UP):
            sample = self._source.sample(now, self._wire.now_ns())
            if sample is None:
                break
            self.sample = sample
            self._sensing.update(sample)
            if sample[0] > now - self._period_s:
                break
        if self._timer.due(now):
            self._wire.send(self._sensing.parameters)


class DisplayEnd:
    """The display: learns the texture from messages. message : the last one; age_ns : its age at arrival."""

    def __init__(self, wire: Wire, model: LocalModel):
        self._wire, self._model = wire, model
        self.message: Parameters | None = None
        self.age_ns = math.nan

    def step(self, now: float) -> Shown:
        """The output of the display now."""
        for received in self._wire.receive():
            if isinstance(received.message, Parameters):
                self.message, self.age_ns = received.message, received.age_ns
                pressed = None if received.message.force is None else received.message.force.value
                force = math.nan if pressed is None else pressed
                self._model.learn(now, received.message.components, QuantityTrust(received.message.texture), force)
        return self._model.update(now)
