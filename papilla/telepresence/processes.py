"""The two ends as processes: a sensor that follows a remote hand, and a display of the sensor's estimates."""

import math
from collections.abc import Callable
from typing import NamedTuple

from papilla.telepresence.answer import DisplayStatus, Shown, Trust
from papilla.telepresence.ends import DisplayEnd, HandEnd, SensorEnd, Timer
from papilla.telepresence.gate import Counts
from papilla.telepresence.local_model import LocalModel
from papilla.telepresence.messages import Parameters
from papilla.telepresence.motion import PARAMETERS_HZ, Motion
from papilla.telepresence.period import Period
from papilla.telepresence.sensing import Sensing
from papilla.telepresence.sources import Source
from papilla.telepresence.udp import Endpoint
from papilla.units import MS_PER_NS

LIVE_HZ = 4.0
"""Updates of the live line per second."""


class Live(NamedTuple):
    """The content of a live line: time_s, the state of this end, its present values, messages received, timing."""

    time_s: float
    state: str
    said: str
    counts: Counts
    period: Period


Report = Callable[[Live], None]


def run_sensor(
    endpoint: Endpoint,
    source: Source,
    sensing: Sensing,
    *,
    parameters_Hz: float = PARAMETERS_HZ,
    seconds: float = math.inf,
    report: Report = lambda live: None,
    period: Period | None = None,
) -> Period:
    """Sample a source at 1 kHz and send the estimates, until the source ends or so many seconds have passed.

    Returns the `Period`.
    """
    period = Period() if period is None else period
    sensor, live = SensorEnd(endpoint, source, sensing, parameters_Hz, period.period_s), Timer(LIVE_HZ, period.period_s)
    for now in period.ticks(seconds):
        sensor.step(now)
        if live.due(now):
            lines, trust = sensing.lines()
            found = f", {lines[0].wavelength_mm:.3f} mm" if lines else ""
            state = {Trust.OK: "ok", Trust.HELD: "wavelength held", Trust.UNKNOWN: "no wavelength"}[trust]
            if now - sensor.received_s > 1:
                state = "no display has sent a message"
            said = f"{source.said}{found}" if math.isfinite(sensor.received_s) else ""
            report(Live(now, state, said, endpoint.gate.counts, period))
        if source.over:
            break
    return period


def run_display(
    endpoint: Endpoint,
    model: LocalModel,
    motion: Motion,
    *,
    seconds: float = math.inf,
    report: Report = lambda live: None,
    keep: Callable[[float, float, Shown, Parameters | None], None] = lambda now, place, shown, message: None,
    period: Period | None = None,
) -> Period:
    """Send the place of the hand at 250 Hz and display the texture under it at 1 kHz.

    The motion stands for the encoder of the operator's slider. `keep` is called in every period with the time, the
    hand's position, the output, and the last message, whose modulus, friction and contact area are for other displays.
    Returns the `Period`.
    """
    period = Period(1 / model.rate_Hz) if period is None else period
    hand, display = HandEnd(endpoint, model, motion, period_s=period.period_s), DisplayEnd(endpoint, model)
    live = Timer(LIVE_HZ, period.period_s)
    for now in period.ticks(seconds):
        place, shown, message = hand.step(now), display.step(now), display.message
        keep(now, place, shown, message)
        if live.due(now):
            said = ""
            if message is not None:
                texture = f"{shown.wavelength_mm:.3f} mm, {shown.frequency_Hz:.0f} Hz, "
                said = texture if math.isfinite(shown.wavelength_mm) else ""
                said += f"gain {shown.gain:.2f}, {_softness(message)}"
                said += f"last message {MS_PER_NS * display.age_ns:.1f} ms old when it came"
            report(Live(now, DisplayStatus(shown.status).sentence, said, endpoint.gate.counts, period))
    return period


def _softness(message: Parameters) -> str:
    """Modulus and contact area of a message, if it has them, with their standard deviations."""
    quantities = [(message.modulus, "MPa"), (message.area, "mm²")]
    known = [(one.value, one.sigma, unit) for one, unit in quantities if one is not None and one.value is not None]
    return "".join(f"{value:.3g} ± {sigma or math.nan:.1g} {unit}, " for value, sigma, unit in known)
