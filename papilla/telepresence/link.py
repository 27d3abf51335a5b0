"""A simulated link: delay, loss, reordering, duplication and limited bandwidth, each with its own random numbers."""

import heapq
import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from papilla.core import checks
from papilla.core.errors import InputError
from papilla.core.units import MS_PER_S, S_PER_MIN, S_PER_MS, S_PER_NS

OVERTAKES_S = 0.02
"""Time after a reordered datagram within which later ones may arrive before it."""
HEADER_BYTES = 28
"""IPv4 and UDP headers of a datagram."""


@dataclass(frozen=True)
class LinkModel:
    """Effects of a link on datagrams, one way.

    Parameters
    ----------
    one_way_ms, one_way_sd_ms : delay, normal and truncated at 0 (a negative draw is drawn again).
    redraw_Hz : rate at which a new delay is drawn; datagrams keep their order as in a queue (FIFO).
    jitter_ms : standard deviation of extra wait of each datagram (half-normal); order is kept.
    loss, reordering, duplication : shares of the datagrams, 0 to 1.
    bandwidth_bytes_s : limit, headers included; datagrams beyond it wait in a queue.
    queue_s : longest wait; a datagram that would wait longer is lost, as in a full buffer.

    Raises `InputError` for values out of range.
    """

    one_way_ms: float = 0.0
    one_way_sd_ms: float = 0.0
    redraw_Hz: float = 5.0
    jitter_ms: float = 0.0
    loss: float = 0.0
    reordering: float = 0.0
    duplication: float = 0.0
    bandwidth_bytes_s: float = math.inf
    queue_s: float = 1.0

    def __post_init__(self):
        for name in ("one_way_ms", "one_way_sd_ms", "jitter_ms"):
            checks.within(name, getattr(self, name), 0, MS_PER_S * S_PER_MIN)
        for name in ("loss", "reordering", "duplication"):
            checks.within(name, getattr(self, name), 0, 1)
        checks.positive("redraw_Hz", self.redraw_Hz)
        checks.positive("queue_s", self.queue_s)
        if not self.bandwidth_bytes_s > 0:
            raise InputError(f"bandwidth_bytes_s must be greater than 0, got {self.bandwidth_bytes_s}")


class Delivery(NamedTuple):
    """sent_s, arrived_s and the content."""

    sent_s: float
    arrived_s: float
    content: Any


class Link:
    """One way of a link, datagram by datagram: `send` and `receive` with times that do not go back.

    Every effect has its own random numbers and draws them for every datagram, so a changed loss does not change the
    delays. `sent`, `lost`, `bytes_sent` count.
    """

    def __init__(self, model: LinkModel, seed: int):
        self.model = model
        causes = np.random.SeedSequence(seed).spawn(5)
        self._delays, self._jitter, self._loss, self._order, self._twice = map(np.random.default_rng, causes)
        self._waiting: list[tuple[float, int, Delivery]] = []
        self._last_s = self._free_s = -math.inf
        self._drawn: dict[int, float] = {}
        self.sent = self.lost = self.bytes_sent = 0

    def one_way_s(self, time_s: float) -> float:
        """The delay drawn for this time."""
        slot = int(max(0.0, time_s) * self.model.redraw_Hz)
        while len(self._drawn) <= slot:
            self._drawn[len(self._drawn)] = self._draw()
        return self._drawn[slot]

    def _draw(self) -> float:
        """A one-way delay in s, drawn from a normal distribution that is cut at 0."""
        model = self.model
        if model.one_way_sd_ms == 0:
            return S_PER_MS * model.one_way_ms
        while (value := self._delays.normal(model.one_way_ms, model.one_way_sd_ms)) < 0:
            pass
        return S_PER_MS * value

    def send(self, time_s: float, content: Any, size_bytes: int = 0) -> None:
        """Send a datagram of `size_bytes` (its content, headers are added)."""
        model = self.model
        # All numbers are drawn for every datagram, also if unused: another loss leaves the delays the same.
        jitter = S_PER_MS * model.jitter_ms * abs(self._jitter.normal())
        gone, twice = self._loss.random(), self._twice.random()
        late, later = self._order.random(), self._order.random()
        self.sent += 1
        self.bytes_sent += size_bytes
        begins = max(time_s, self._free_s)
        if gone < model.loss or begins - time_s > model.queue_s:
            self.lost += 1
            return
        leaves = begins + (size_bytes + HEADER_BYTES) / model.bandwidth_bytes_s
        self._free_s = leaves
        arrives = leaves + self.one_way_s(time_s) + jitter
        # Only a reordered datagram may be overtaken; all others keep their order, as in a queue.
        if late < model.reordering:
            arrives += OVERTAKES_S * later
        else:
            arrives = self._last_s = max(arrives, self._last_s)
        for _ in range(2 if twice < model.duplication else 1):
            heapq.heappush(self._waiting, (arrives, self.sent, Delivery(time_s, arrives, content)))

    def receive(self, time_s: float) -> list[Delivery]:
        """The datagrams that have arrived by now, in the order of arrival."""
        arrived = []
        while self._waiting and self._waiting[0][0] <= time_s + S_PER_NS:
            arrived.append(heapq.heappop(self._waiting)[2])
        return arrived
