"""Sources of a sensor process's samples: a simulated texture under the remote hand, or a replayed log."""

import math
from typing import Protocol

import numpy as np

from papilla.logs import TimeLog
from papilla.telepresence.gate import Received
from papilla.telepresence.hand import RemoteHand
from papilla.telepresence.messages import HandReading
from papilla.telepresence.touch import Touch
from papilla.units import S_PER_NS


class Source(Protocol):
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

    def __init__(self, touch: Touch, seed: int = 0):
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
        self._rows = [tuple(row) for row in rows.tolist()]

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
