"""The two ends as processes: a sensor that follows a remote hand, and a display of the sensor's estimates, each in a
control loop with a fixed period."""

import math
import time
from collections.abc import Callable, Iterator
from typing import NamedTuple

from papilla.core import checks
from papilla.core.units import MS_PER_NS, NS_PER_S, S_PER_NS, SI_MICRO
from papilla.telepresence.ends import DisplayEnd, FingerSource, HandEnd, SensorEnd, Timer
from papilla.telepresence.gate import Counts
from papilla.telepresence.local_model import DisplayStatus, LocalModel, Shown
from papilla.telepresence.messages import Parameters, QuantityTrust
from papilla.telepresence.motion import HAND_RATE_HZ, PARAMETERS_HZ, HandMotion
from papilla.telepresence.sensing import Sensing
from papilla.telepresence.udp import Endpoint


class TimeHistogram:
    """Histogram of times from 1 us to 10 s, in bins that grow by 4 %: this is the accuracy of quantiles.

    With bins of a constant ratio a few hundred numbers hold days of periods, and short times are resolved as well as
    long ones.
    """

    LOW_S, HIGH_S, RATIO = SI_MICRO, 10.0, 1.04
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
        remaining = share * self.number
        for place, count in enumerate(self._bins):
            remaining -= count
            # `share * number` is rounded: what is left of a whole number of times may be slightly above zero.
            if count and remaining <= checks.ROUNDING_SHARE:
                return min(self.greatest_s, self.LOW_S * self.RATIO**place)
        return math.nan


class TickGrid:
    """Ticks on an even grid of time: `for now_s in period.ticks(seconds)`.

    work : time from a tick to the request for the next one; busy : processor time of this thread in it. missed : number
    of ticks that were left out because the one before took too long.
    """

    def __init__(
        self,
        period_s: float = 1 / HAND_RATE_HZ,
        clock: Callable[[], int] = time.monotonic_ns,
        sleep: Callable[[float], None] = time.sleep,
    ):
        self.period_s, self._clock, self._sleep = period_s, clock, sleep
        self.work, self.busy, self.missed, self.ticked = TimeHistogram(), TimeHistogram(), 0, 0

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
            ended = self._clock()
            self.work.add(S_PER_NS * (ended - now))
            # Ticks that are already over are left out and counted, instead of being caught up in a hurry.
            following = max(number + 1, (ended - begin) // period)
            self.missed += following - number - 1
            number = following


TRUST_WORDS = {QuantityTrust.OK: "ok", QuantityTrust.HELD: "wavelength held", QuantityTrust.UNKNOWN: "no wavelength"}
"""What a sensor's live line says of the wavelength."""
LIVE_HZ = 4.0
"""Updates of the live line per second."""


class Live(NamedTuple):
    """The content of a live line: time_s, the state of this end, its present values, messages received, timing."""

    time_s: float
    state: str
    said: str
    counts: Counts
    period: TickGrid


Report = Callable[[Live], None]


def run_sensor(
    endpoint: Endpoint,
    source: FingerSource,
    sensing: Sensing,
    *,
    parameters_Hz: float = PARAMETERS_HZ,
    seconds: float = math.inf,
    report: Report = lambda live: None,
    period: TickGrid | None = None,
) -> TickGrid:
    """Sample a source at 1 kHz and send the estimates, until the source ends or so many seconds have passed.

    Returns the `TickGrid`.
    """
    period = TickGrid() if period is None else period
    sensor, live = SensorEnd(endpoint, source, sensing, parameters_Hz, period.period_s), Timer(LIVE_HZ, period.period_s)
    for now in period.ticks(seconds):
        sensor.step(now)
        if live.due(now):
            lines, trust = sensing.lines()
            wavelength = f", {lines[0].wavelength_mm:.3f} mm" if lines else ""
            state_text = TRUST_WORDS[trust]
            if now - sensor.received_s > 1:
                state_text = "no display has sent a message"
            values = f"{source.said}{wavelength}" if math.isfinite(sensor.received_s) else ""
            report(Live(now, state_text, values, endpoint.gate.counts, period))
        if source.over:
            break
    return period


def run_display(
    endpoint: Endpoint,
    model: LocalModel,
    motion: HandMotion,
    *,
    seconds: float = math.inf,
    report: Report = lambda live: None,
    keep: Callable[[float, float, Shown, Parameters | None], None] = lambda *_output: None,
    period: TickGrid | None = None,
) -> TickGrid:
    """Send the place of the hand at 250 Hz and display the texture under it at 1 kHz.

    The motion stands for the encoder of the operator's slider. `keep` is called in every period with the time, the
    hand's position, the output, and the last message, whose modulus, friction and contact area are for other displays.
    Returns the `TickGrid`.
    """
    period = TickGrid(1 / model.rate_Hz) if period is None else period
    hand, display = HandEnd(endpoint, model, motion, period_s=period.period_s), DisplayEnd(endpoint, model)
    live = Timer(LIVE_HZ, period.period_s)
    for now in period.ticks(seconds):
        place, output, message = hand.step(now), display.step(now), display.message
        keep(now, place, output, message)
        if live.due(now):
            values = ""
            if message is not None:
                texture = f"{output.wavelength_mm:.3f} mm, {output.frequency_Hz:.0f} Hz, "
                values = texture if math.isfinite(output.wavelength_mm) else ""
                values += f"gain {output.gain:.2f}, {_softness(message)}"
                values += f"last message {MS_PER_NS * display.age_ns:.1f} ms old when it came"
            report(Live(now, DisplayStatus(output.status).sentence, values, endpoint.gate.counts, period))
    return period


def _softness(message: Parameters) -> str:
    """Modulus and contact area of a message, if it has them, with their standard deviations."""
    quantities = [(message.modulus, "MPa"), (message.area, "mm²")]
    return "".join(
        f"{quantity.value:.3g} ± {quantity.sigma or math.nan:.1g} {unit}, "
        for quantity, unit in quantities
        if quantity is not None and quantity.value is not None
    )
