"""Which gauge is wrong and how: missing, saturated, stuck while the others move."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from operator import eq

from papilla.errors import InputError

GOOD, MISSING, SATURATED, STUCK = range(4)
_WORDS = {MISSING: "missing", SATURATED: "saturated", STUCK: "stuck"}
STUCK_SAMPLES = 50
"""A gauge that repeats itself so often while another one moves is stuck: dead, or held at the end of its range."""


@dataclass(frozen=True)
class HealthState:
    """last : the last finite reading of each gauge; repeats : how often it came again while another gauge moved."""

    last: tuple[float, ...]
    repeats: tuple[int, ...]


class GaugeHealth:
    """Watches g readings; |reading| >= saturation is saturated, a gauge that repeats itself `stuck_samples` times while
    another moves is stuck."""

    def __init__(self, gauges: int, saturation: float, stuck_samples: int = STUCK_SAMPLES):
        if not saturation > 0:
            raise InputError(f"saturation (microstrain) must be greater than 0, got {saturation}")
        if stuck_samples < 2:
            raise InputError(f"stuck_samples must be at least 2, got {stuck_samples}")
        self._gauges, self._saturation, self._stuck = gauges, saturation, stuck_samples
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self.state = HealthState((math.nan,) * self._gauges, (0,) * self._gauges)

    @property
    def state(self) -> HealthState:
        """All that is remembered, to be kept or to be set again."""
        return HealthState(self._last, tuple(self._repeats))

    @state.setter
    def state(self, state: HealthState) -> None:
        if len(state.last) != self._gauges or len(state.repeats) != self._gauges:
            raise InputError(f"the state is of {len(state.last)} gauges, this pipeline has {self._gauges}")
        self._last, self._repeats = state.last, list(state.repeats)

    @property
    def stuck(self) -> tuple[int, ...]:
        """Numbers (from 0) of the gauges that are stuck now."""
        return tuple(number for number, count in enumerate(self._repeats) if count >= self._stuck)

    def look(self, readings: tuple[float, ...]) -> tuple[int, ...]:
        """What each gauge is now; an empty tuple when all are good."""
        if not readings:
            return ()
        last, repeats, limit = self._last, self._repeats, self._saturation
        same = list(map(eq, readings, last))
        repeated = True in same
        # The sum is finite only where every reading is: nearly always there is nothing more to see.
        if math.isfinite(sum(readings)) and -limit < min(readings) and max(readings) < limit and not repeated:
            self._last = readings
            if any(repeats):
                self._repeats = [0] * self._gauges
            return ()
        finite = [-math.inf < new < math.inf for new in readings]
        if repeated:
            moved = any(
                known and not equal and old == old for known, equal, old in zip(finite, same, last, strict=True)
            )
            for number, equal in enumerate(same):
                if not equal:
                    repeats[number] = 0
                elif moved:
                    repeats[number] = min(repeats[number] + 1, self._stuck)
        elif any(repeats):
            self._repeats = repeats = [0] * self._gauges
        self._last = tuple(new if known else old for new, old, known in zip(readings, last, finite, strict=True))
        found = tuple(
            MISSING
            if not known
            else SATURATED
            if not -limit < new < limit
            else STUCK
            if repeated == self._stuck
            else GOOD
            for new, known, repeated in zip(readings, finite, repeats, strict=True)
        )
        return found if any(found) else ()


def words(found: tuple[int, ...], names: Sequence[str]) -> list[str]:
    """Sentences such as `g2, g4 missing` of what `look` found of the gauges of these names."""
    sentences = []
    for kind, word in _WORDS.items():
        named = [name for name, own in zip(names, found, strict=False) if own == kind]
        if named:
            sentences.append(f"{', '.join(named)} {word}")
    return sentences
