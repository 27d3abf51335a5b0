"""A control loop with a fixed period and statistics of its timing, in memory that does not grow."""

import math
import time
from collections.abc import Callable, Iterator

from papilla import checks
from papilla.telepresence.motion import RATE_HZ
from papilla.units import MICRO, NS_PER_S, S_PER_NS


class Spread:
    """Histogram of times from 1 us to 10 s, in bins that grow by 4 %: this is the accuracy of quantiles.

    With bins of a constant ratio a few hundred numbers hold days of periods, and short times are resolved as well as
    long ones.
    """

    LOW_S, HIGH_S, RATIO = MICRO, 10.0, 1.04
    NUMBER = math.ceil(math.log(HIGH_S / LOW_S) / math.log(RATIO))

    def __init__(self) -> None:
        self._bins = [0] * (self.NUMBER + 1)
        self.number, self.greatest_s = 0, 0.0

    def add(self, seconds: float) -> None:
        """Count one time."""
        place = 0 if seconds <= self.LOW_S else 1 + int(math.log(seconds / self.LOW_S) / math.log(self.RATIO))
        self._bins[min(place, self.NUMBER)] += 1
        self.number += 1
        self.greatest_s = max(self.greatest_s, seconds)

    def quantile_s(self, share: float) -> float:
        """The time that this share of the times does not exceed; NaN without any."""
        left = share * self.number
        for place, count in enumerate(self._bins):
            left -= count
            # `share * number` is rounded: what is left of a whole number of times may be slightly above zero.
            if count and left <= checks.ROUNDING:
                return min(self.greatest_s, self.LOW_S * self.RATIO**place)
        return math.nan


class Period:
    """Ticks on an even grid of time: `for now_s in period.ticks(seconds)`.

    work : time from a tick to the request for the next one; busy : processor time of this thread in it. missed : number
    of ticks that were left out because the one before took too long.
    """

    def __init__(
        self,
        period_s: float = 1 / RATE_HZ,
        clock: Callable[[], int] = time.monotonic_ns,
        sleep: Callable[[float], None] = time.sleep,
    ):
        self.period_s, self._clock, self._sleep = period_s, clock, sleep
        self.work, self.busy, self.missed, self.ticked = Spread(), Spread(), 0, 0

    def ticks(self, seconds: float = math.inf) -> Iterator[float]:
        """Times in s since the first tick, for so long."""
        begin, period, number = self._clock(), round(NS_PER_S * self.period_s), 0
        while number * self.period_s < seconds:
            # On a grid from the beginning, so that late ticks do not shift all later ones.
            due = begin + number * period
            now = self._clock()
            # The operating system may end a sleep early.
            while now < due:
                self._sleep(S_PER_NS * (due - now))
                now = self._clock()
            self.ticked += 1
            had = time.thread_time_ns()
            yield S_PER_NS * (now - begin)
            self.busy.add(S_PER_NS * (time.thread_time_ns() - had))
            done = self._clock()
            self.work.add(S_PER_NS * (done - now))
            # Ticks that are already over are left out and counted, instead of being caught up in a hurry.
            following = max(number + 1, (done - begin) // period)
            self.missed += following - number - 1
            number = following
