"""Sum of the values of a sliding window, one value at a time or a block at once, with the same bits."""

from dataclasses import dataclass

import numpy as np

from papilla.errors import InputError
from papilla.estimators.published.roughness.answer import NONE


@dataclass(frozen=True)
class MovingSumState:
    """place : where the next value goes in the ring `values`; known : how many of them are not NaN.

    total, fresh : their sum, and that of those since the ring began again.
    """

    place: int
    known: int
    total: float
    fresh: float
    values: tuple[float, ...]


class MovingSum:
    """`total` of the last `length` values and how many of them are `known`; a NaN is in neither.

    A running sum keeps every rounding error it ever made. Here the sum of the values since the ring began again
    replaces it whenever the ring is full, so none lives longer than two windows.
    """

    def __init__(self, length: int, start: float = NONE):
        self._length = length
        self.state = MovingSumState(0, 0 if start != start else length, 0.0, 0.0, (start,) * length)

    @property
    def state(self) -> MovingSumState:
        """All that is remembered, to be kept or to be set again; a state of another length is refused."""
        return MovingSumState(self._place, self.known, self.total, self._fresh, tuple(self._values))

    @state.setter
    def state(self, state: MovingSumState) -> None:
        self._values = checked_ring("ring", state.values, self._length)
        self._place, self.known, self.total, self._fresh = state.place, state.known, state.total, state.fresh

    def push(self, value: float) -> None:
        """Take one more value."""
        place = self._place
        old = self._values[place]
        if old == old:
            self.total -= old
            self.known -= 1
        if value == value:
            self.total += value
            self._fresh += value
            self.known += 1
        self._values[place] = value
        place += 1
        if place == self._length:
            self.total, self._fresh, place = self._fresh, 0.0, 0
        self._place = place

    def extend(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """total and known after each of the values (n,), n > 0: what `push` gives one by one, bit for bit."""
        length, place, count = self._length, self._place, len(values)
        laps = -(-(place + count) // length)
        # One row a lap of the ring, the lap before the first on top; what is not there yet stays NaN.
        table = np.full((laps + 1) * length, NONE)
        table[place:length], table[length : length + place] = self._values[place:], self._values[:place]
        table[length + place : length + place + count] = values
        known = ~np.isnan(table)
        rows = np.where(known, table, 0.0).reshape(laps + 1, length)
        leaving, coming = rows[:-1], rows[1:].copy()
        coming[0, :place] = 0.0
        # Cumulative sums add in order, as single pushes do: first what leaves, then what comes.
        fresh = np.cumsum(np.column_stack([np.zeros(laps), coming]), axis=1)
        fresh[0] = np.cumsum(np.concatenate([[self._fresh], coming[0]]))
        steps = np.empty((laps, 2 * length + 1))
        steps[:, 1::2], steps[:, 2::2] = -leaving, coming
        steps[0, 0], steps[1:, 0] = self.total, fresh[:-1, -1]
        totals = np.cumsum(steps, axis=1)[:, 2::2]
        totals[:, -1] = fresh[:, -1]
        block = slice(place, place + count)
        knowns = self.known + np.cumsum(known[length:][block].astype(int) - known[:-length][block])
        totals = totals.ravel()[block]
        # The ring as it stands now: this lap up to `place`, the lap before it from there on.
        self._place = (place + count) % length
        latest = np.concatenate([np.array(self._values[place:] + self._values[:place]), values])[-length:]
        self._values = np.roll(latest, self._place).tolist()
        self.total, self.known = float(totals[-1]), int(knowns[-1])
        self._fresh = float(fresh[-1, self._place]) if self._place else 0.0
        return totals, knowns


def checked_ring(name: str, values: tuple, length: int) -> list:
    """A buffer of a saved state as a list; raises `InputError` where it is of another window."""
    if len(values) != length:
        raise InputError(f"the state's {name} holds {len(values)} samples, the window is {length}")
    return list(values)
