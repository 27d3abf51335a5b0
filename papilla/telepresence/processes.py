"""The two ends as processes: a sensor that follows a remote hand, and a display that feels what the sensor finds."""

import math
from collections.abc import Callable
from functools import partial
from typing import NamedTuple

from papilla.telepresence.answer import DisplayStatus, Shown, Trust
from papilla.telepresence.gate import Counts
from papilla.telepresence.local_model import LocalModel
from papilla.telepresence.loop import HAND_HZ, PARAMETERS_HZ, Motion
from papilla.telepresence.messages import Force, HandReading, Length, Parameters, quantity
from papilla.telepresence.period import Period
from papilla.telepresence.sensing import Sensing
from papilla.telepresence.sources import Source
from papilla.telepresence.udp import Endpoint

LIVE_S = 0.25
"""How often the live line is renewed."""
CATCH_UP = 4
"""Samples that one period takes at most."""


class Live(NamedTuple):
    """What a live line tells: time_s, in what state this end is, numbers of now, what came in and how time was kept."""

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
    """Sample a source at 1 kHz and send what the estimators find, until it is over or so many seconds have passed.

    Returns what the period kept.
    """
    period = Period() if period is None else period
    told_s = live_s = heard_s = -math.inf
    for now in period.ticks(seconds):
        for heard in endpoint.receive():
            heard_s = now
            source.hear(heard)
        # A row that came late is made up for at once, some at a time.
        for _ in range(CATCH_UP):
            sample = source.sample(now, endpoint.now_ns())
            if sample is None:
                break
            sensing.update(sample)
            if sample[0] > now - period.period_s:
                break
        if now - told_s >= 1 / parameters_Hz - 0.5 * period.period_s:
            told_s = now
            endpoint.send(sensing.parameters)
        if now - live_s >= LIVE_S:
            live_s = now
            lines, trust = sensing.lines()
            found = f", {lines[0].wavelength_mm:.3f} mm" if lines else ""
            state = {Trust.OK: "ok", Trust.HELD: "wavelength held", Trust.UNKNOWN: "no wavelength"}[trust]
            if now - heard_s > 1:
                state = "no display is heard"
            said = f"{source.said}{found}" if math.isfinite(heard_s) else ""
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
    keep: Callable[[float, float, Shown, Parameters | None], None] = lambda now, place, shown, told: None,
    period: Period | None = None,
) -> Period:
    """Send where the hand is at 250 Hz and display the texture under it at 1 kHz.

    The motion stands for the encoder of the operator's slider. `keep` is called in every period with the time, the
    hand's position, what is displayed, and the last message: its modulus, friction and contact area are for displays of
    those. Returns what the period kept.
    """
    period = Period(1 / model.rate_Hz) if period is None else period
    hand_s = live_s = -math.inf
    age_ns, told = math.nan, None
    for now in period.ticks(seconds):
        place, force = float(motion.place_mm(now)), float(motion.force_N(now))
        if now - hand_s >= 1 / HAND_HZ - 0.5 * period.period_s:
            hand_s = now
            model.move(now, place, force)
            endpoint.send(partial(HandReading, position=quantity(Length, place), force=quantity(Force, force)))
        for heard in endpoint.receive():
            if isinstance(heard.message, Parameters):
                age_ns, told = heard.age_ns, heard.message
                model.learn(now, told.components, Trust(told.texture))
        shown = model.update(now)
        keep(now, place, shown, told)
        if now - live_s >= LIVE_S:
            live_s = now
            said = f"gain {shown.gain:.2f}, "
            if math.isfinite(shown.wavelength_mm):
                said = f"{shown.wavelength_mm:.3f} mm, {shown.frequency_Hz:.0f} Hz, {said}"
            said += _softness(told) + f"last message {1e-6 * age_ns:.1f} ms old when it came"
            said = said if told else ""
            state = DisplayStatus(shown.status).sentence
            report(Live(now, state, said, endpoint.gate.counts, period))
    return period


def _softness(told: Parameters | None) -> str:
    """Modulus and contact area of a message, where it has them, with their standard deviations."""
    parts = [] if told is None else [(told.modulus, "MPa"), (told.area, "mm²")]
    known = [(one.value, one.sigma, unit) for one, unit in parts if one is not None and one.value is not None]
    return "".join(f"{value:.3g} ± {sigma or math.nan:.1g} {unit}, " for value, sigma, unit in known)
