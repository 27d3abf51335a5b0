"""Faults of gauges: missing, saturated, stuck while the others move, or in contradiction to the others."""

import math
from collections.abc import Sequence
from operator import eq
from typing import NamedTuple

from papilla.core.errors import InputError
from papilla.core.status import Status

STUCK_SAMPLES = 50
"""Number of repetitions of a reading, while another gauge moves, after which a gauge counts as stuck: dead, or at the
end of its range."""
FAULT_CODE_BASE = 8
"""Base of the integer that encodes the faults of all channels: one digit for each, the first gauge the lowest."""


class Fault(Status):
    """Fault of a channel (a gauge, or the force); `sentence` says it in words."""

    NONE = "in use"
    MISSING = "missing"
    SATURATED = "saturated"
    STUCK = "stuck"
    OFF_SURFACE = "contradicts the others"
    SIGN_FLIPPED = "sign flipped"
    SWAPPED = "swapped with another"


FAULT_MISSING, FAULT_SATURATED, FAULT_STUCK = map(int, (Fault.MISSING, Fault.SATURATED, Fault.STUCK))


def pack(faults) -> int:
    """The faults of all channels as one integer."""
    code = 0
    for fault in reversed(faults):
        code = code * FAULT_CODE_BASE + fault
    return code


def unpack(code: int, channels: int) -> list[Fault]:
    """The faults of all channels from such an integer, the first gauge's first."""
    return [Fault(code // FAULT_CODE_BASE**channel % FAULT_CODE_BASE) for channel in range(channels)]


def numbered(gauges: int) -> tuple[str, ...]:
    """The names g1, g2 ... of gauges that have no names of their own."""
    return tuple(f"g{number}" for number in range(1, gauges + 1))


def in_words(code: int, gauges: Sequence[str]) -> str:
    """The faults in words, such as "g3 left out: stuck, force left out: missing", with the names of the gauges; the
    force is last."""
    faults = zip((*gauges, "force"), unpack(code, len(gauges) + 1), strict=True)
    return ", ".join(f"{name} left out: {fault.sentence}" for name, fault in faults if fault)


def words(faults: tuple[int, ...], names: Sequence[str]) -> list[str]:
    """Sentences such as `g2, g4 missing` that `check` returns, with the names of the gauges."""
    named = {
        fault: [name for name, code in zip(names, faults, strict=False) if code == fault] for fault in Fault if fault
    }
    return [f"{', '.join(gauges)} {fault.sentence}" for fault, gauges in named.items() if gauges]


class HealthState(NamedTuple):
    """last : the last finite reading of each gauge; repeats : how often it repeated while another gauge moved."""

    last: tuple[float, ...]
    repeats: tuple[int, ...]


class GaugeHealth:
    """Watches g readings: |reading| >= saturation is saturated; a gauge that repeats its reading `stuck_samples` times
    while another moves is stuck. fresh : the state before the first sample."""

    def __init__(self, gauges: int, saturation: float, stuck_samples: int = STUCK_SAMPLES):
        if not saturation > 0:
            raise InputError(f"saturation (microstrain) must be greater than 0, got {saturation}")
        if stuck_samples < 2:
            raise InputError(f"stuck_samples must be at least 2, got {stuck_samples}")
        self._gauges, self._saturation, self._stuck = gauges, saturation, stuck_samples
        self._moving = (0,) * gauges
        self.fresh = HealthState((math.nan,) * gauges, self._moving)

    def fits(self, state: HealthState) -> None:
        """Raise `InputError` for a state of another number of gauges."""
        if len(state.last) != self._gauges or len(state.repeats) != self._gauges:
            raise InputError(f"the state is of {len(state.last)} gauges, this pipeline has {self._gauges}")

    def check(self, readings: tuple[float, ...], before: HealthState) -> tuple[tuple[int, ...], HealthState]:
        """The `Fault` of each gauge now, an empty tuple when all are good, and the state after this sample."""
        if not readings:
            return (), before
        (last, repeats), limit = before, self._saturation
        repeated = True in map(eq, readings, last)
        # The sum is finite only if every reading is, so one test covers nearly all samples.
        if not repeated and -limit < min(readings) and max(readings) < limit and math.isfinite(sum(readings)):
            return (), HealthState(readings, self._moving)
        finite = [-math.inf < new < math.inf for new in readings]
        moved = any(is_finite and new != old == old for new, old, is_finite in zip(readings, last, finite, strict=True))
        counts = self._moving
        if repeated:
            counted = zip(readings, last, repeats, strict=True)
            counts = tuple([min(count + moved, self._stuck) if new == old else 0 for new, old, count in counted])
        latest = tuple([new if is_finite else old for new, old, is_finite in zip(readings, last, finite, strict=True)])
        faults = tuple([
            FAULT_MISSING if not is_finite else FAULT_SATURATED if not -limit < new < limit
            else FAULT_STUCK * (count == self._stuck)
            for new, is_finite, count in zip(readings, finite, counts, strict=True)
        ])  # fmt: skip
        return (faults if any(faults) else ()), HealthState(latest, counts)
