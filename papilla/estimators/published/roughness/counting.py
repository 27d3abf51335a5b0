"""Frequency and wavelength from the number of impulses in a sliding window."""

from dataclasses import dataclass, field

from papilla.estimators.published.roughness.answer import ALIASED, GAP, OK, SILENT, Finding
from papilla.estimators.published.roughness.impulses import MovingSum

CEILING = 0.9
"""Share of the largest number of impulses that a window can contain (one every second sample) above which a count may
be an alias."""


@dataclass(eq=False)
class ImpulseCount:
    """Counts impulses over the last `samples` and computes f = count / (per_period x duration).

    The distance of a period is |velocity now| / f, or, `paired`, the distance travelled while counting over the number
    of periods. fastest_mm_s : speed above which there is no answer.
    """

    samples: int
    rate_Hz: float
    per_period: int
    paired: bool
    fastest_mm_s: float
    _impulses: MovingSum = field(init=False)
    _speeds: MovingSum = field(init=False)

    def __post_init__(self) -> None:
        self._impulses, self._speeds = MovingSum(self.samples), MovingSum(self.samples)

    def find(self, impulse: float, speed: float) -> Finding:
        """The finding after a sample: its impulse (0: none, NaN: none possible), and |velocity|."""
        self._impulses.push(abs(impulse))
        self._speeds.push(speed)
        count, valid, moving = self._impulses.total, self._impulses.known, self._speeds.known
        if valid < self.samples // 2:
            return Finding(GAP)
        if count == 0:
            return Finding(SILENT)
        if speed > self.fastest_mm_s or count > CEILING * 0.5 * self.samples:
            return Finding(ALIASED)
        average = self._speeds.total / moving if self.paired and moving else speed
        periods, seconds = count / self.per_period, valid / self.rate_Hz
        return Finding(OK if valid == self.samples else GAP, periods / seconds, average * seconds / periods)
