"""Creep of the silicone in a touch, compared with the touches that identified the finger.

The equivalent force is the force that would give the same strain at once; its ratio to the force says how far the
silicone has crept (`references.Prony.strained`). If this ratio leaves the range of the identifying touches, readings
differ from the calibration, and a remark says so.
"""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

from papilla.errors import InputError
from papilla.references import Prony

LEAST_CHANGE = 0.02
"""Change of that ratio beyond the range from which a touch is called different: 1 to 2 % of S_d."""

WORDS = (
    "",
    "loaded faster than the touches that the finger was identified by",
    "loaded more slowly, held longer or unloaded, unlike the touches that the finger was identified by",
)


class CreepState(NamedTuple):
    """Time and force of the last sample, and, for each term, the part of the force (N) that has not relaxed yet."""

    time_s: float
    force_N: float
    kept: tuple[float, ...]


class Creep:
    """Ratio of equivalent force to force of a stream of samples: `Prony.strained`, a sample at a time.

    Parameters
    ----------
    relaxation : of a calibration's finger: shares, times_s, and crept, the range of that ratio in the touches that it
        was identified by. least_N : smaller forces are not judged.

    Raises `InputError` for a relaxation that is not of these numbers.
    """

    def __init__(self, relaxation: Mapping[str, Any], least_N: float):
        try:
            series = Prony(tuple(relaxation["shares"]), tuple(relaxation["times_s"]))
            low, high = map(float, relaxation["crept"])
        except (KeyError, TypeError, ValueError) as error:
            raise InputError(
                "the calibration's finger.relaxation must have shares, times_s and crept, two numbers"
            ) from error
        self._terms, self._least = series.retardation, least_N
        self._low, self._high = low - LEAST_CHANGE, high + LEAST_CHANGE
        self.state = CreepState(math.nan, 0.0, (0.0,) * len(self._terms))

    def feel(self, time_s: float, force_N: float) -> int:
        """Take a sample. Returns 0, or the index in `WORDS` of the difference. A sample without a force is not
        judged."""
        before = self.state
        step = time_s - before.time_s
        if force_N != force_N or step <= 0:
            return 0
        kept = (force_N,) * len(self._terms)
        if step > 0:
            # The forces kept creep away; of a force that rises linearly over the step, a part has crept already.
            rise, lost = force_N - before.force_N, [(-math.expm1(-step / tau), tau) for _, tau in self._terms]
            each = zip(lost, before.kept, strict=True)
            kept = tuple([one * (1 - share) + rise * tau / step * share for (share, tau), one in each])
        self.state = CreepState(time_s, force_N, kept)
        if force_N < self._least:
            return 0
        crept = 1.0 + sum([c * (1 - one / force_N) for (c, _), one in zip(self._terms, kept, strict=True)])
        return 1 if crept < self._low else 2 if crept > self._high else 0
