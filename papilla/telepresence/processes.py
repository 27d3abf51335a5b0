"""The two ends as processes: a sensor that follows a remote hand, and a display that feels what the sensor finds."""

import math
from collections.abc import Callable
from functools import partial
from typing import NamedTuple

from papilla.estimators.pipeline import Pipeline
from papilla.telepresence.answer import DisplayStatus, Shown, Trust
from papilla.telepresence.gate import Counts
from papilla.telepresence.hand import RemoteHand
from papilla.telepresence.local_model import LocalModel
from papilla.telepresence.loop import HAND_HZ, PARAMETERS_HZ, SCALE_SIGMA, Motion
from papilla.telepresence.messages import HandReading, Length, Parameters, quantity
from papilla.telepresence.period import Period
from papilla.telepresence.sensing import Sensing
from papilla.telepresence.texture import Texture
from papilla.telepresence.udp import Endpoint

LIVE_S = 0.25
"""How often the live line is renewed."""


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
    texture: Texture,
    *,
    noise: Callable[[], float] = lambda: 0.0,
    components: int = 1,
    parameters_Hz: float = PARAMETERS_HZ,
    seconds: float = math.inf,
    report: Report = lambda live: None,
    period: Period | None = None,
) -> Period:
    """Follow the remote hand over a texture at 1 kHz and send what the estimators find.

    The texture stands for finger, arm and board, which a user of `Sensing` and `Endpoint` puts in its place. Returns
    what the period kept.
    """
    period = Period() if period is None else period
    pipeline = Pipeline(gauges=1, columns=("position_mm",), scale_sigma=SCALE_SIGMA, latency_s=0.0)
    sensing, remote = Sensing(pipeline, components=components), RemoteHand()
    told_s = live_s = heard_s = -math.inf
    for now in period.ticks(seconds):
        for heard in endpoint.receive():
            position = heard.message.position.value if isinstance(heard.message, HandReading) else None
            if position is not None:
                heard_s = now
                remote.read(1e-9 * heard.arrived_ns, 1e-9 * heard.sent_ns, position)
        place, speed = remote.at(1e-9 * endpoint.now_ns())
        if math.isfinite(place):
            sensing.update((now, texture.reading(place, speed) + noise(), place))
        if now - told_s >= 1 / parameters_Hz - 0.5 * period.period_s:
            told_s = now
            endpoint.send(sensing.parameters)
        if now - live_s >= LIVE_S:
            live_s = now
            lines, trust = sensing.lines()
            found = f", {lines[0].wavelength_mm:.3f} mm" if lines else ""
            state = {Trust.OK: "ok", Trust.HELD: "wavelength held", Trust.UNKNOWN: "no wavelength"}[trust]
            if now - heard_s > 1:
                state = "no hand is heard"
            report(Live(now, state, f"hand at {place:.1f} mm{found}", endpoint.gate.counts, period))
    return period


def run_display(
    endpoint: Endpoint,
    model: LocalModel,
    motion: Motion,
    *,
    seconds: float = math.inf,
    report: Report = lambda live: None,
    keep: Callable[[float, float, Shown], None] = lambda now, place, shown: None,
    period: Period | None = None,
) -> Period:
    """Send where the hand is at 250 Hz and display the texture under it at 1 kHz.

    The motion stands for the encoder of the operator's slider. `keep` is called with the time, the hand's position and
    what is displayed in every period. Returns what the period kept.
    """
    period = Period(1 / model.rate_Hz) if period is None else period
    hand_s = live_s = -math.inf
    age_ns = math.nan
    for now in period.ticks(seconds):
        place = float(motion.place_mm(now))
        if now - hand_s >= 1 / HAND_HZ - 0.5 * period.period_s:
            hand_s = now
            model.move(now, place)
            endpoint.send(partial(HandReading, position=quantity(Length, place)))
        for heard in endpoint.receive():
            if isinstance(heard.message, Parameters):
                age_ns = heard.age_ns
                model.learn(now, heard.message.components, Trust(heard.message.texture))
        shown = model.update(now)
        keep(now, place, shown)
        if now - live_s >= LIVE_S:
            live_s = now
            said = f"{shown.wavelength_mm:.3f} mm, {shown.frequency_Hz:.0f} Hz, gain {shown.gain:.2f}, "
            said += f"last message {1e-6 * age_ns:.1f} ms old when it came"
            state = DisplayStatus(shown.status).sentence
            report(Live(now, state, said, endpoint.gate.counts, period))
    return period
