"""2007 and 2011 Okamoto: roughness at a distance, by a local model at the hand or by direct feedback."""

import math

import numpy as np

from papilla.studies.reproduce.claim import Found, Series, gathered
from papilla.studies.telepresence.delays import beside_each_other
from papilla.studies.telepresence.roughness import DELAY, NOTICED_MS, TESTS_MM, experiments_2011
from papilla.telepresence import Component, FromWavelength, Link, LinkModel, LocalModel, Set, icpf, read_curve
from papilla.telepresence.actuator import PIEZO
from papilla.telepresence.amplitude import AMPLIFIER_V_PER_MICROSTRAIN, Measured, PowerCurve
from papilla.telepresence.loop import run as run_loop
from papilla.telepresence.messages import Parameters
from papilla.telepresence.motion import HAND_HZ, RATE_HZ
from papilla.telepresence.record import Record
from papilla.telepresence.texture import GratingTexture

CROSSED_AT = (80.0, 82.0, 84.0, 86.0, 88.0)
"""Speeds in mm/s at which a border is crossed, one per seed."""
SIMULATED = "simulated hand, link, actuator and sensor"
SCENE = (
    "the texture (fainter than the noise), the delay (or a delay where there is none), the local model (direct feedback"
    " in its place), the right texture beside it, the dependence of the signal on the wavelength",
    "white, 1 to 3.5 microstrain beside 50",
    len(TESTS_MM),
)
TRIP_MS = 120.0
FAINT_MICROSTRAIN = 1e-3
SAME_MM = 0.1
"""Half of the step (mm) between neighbouring textures of the comparison scale."""


def run(tell, cause: bool = True) -> Found:
    """Roughness at a distance: a local model against direct feedback, over delayed links.

    The loop of hand, uplink, sensor, downlink and display runs over a grating of 1.2 mm, with 60 ms each way, with one
    way alone, and with half of all datagrams lost. Two gratings side by side are crossed five times. What the four
    conditions of 2011 displayed is compared: wavelength over the hand's own path, lag, amplitude.
    """
    tell("the loop")
    delayed = _loop(cause, seconds=5.0, both_ways=True)
    values = gathered(lambda: _machines(delayed, cause), _display, _links, _amplitudes)
    tell("side by side")
    values |= gathered(lambda: _borders(cause))
    tell("experiments of 2011")
    values |= gathered(lambda: _displayed(tell, cause))
    rows = slice(2000, 2250)
    series = tuple(
        Series(name, delayed.time_s[rows], shown[rows] / max(np.abs(shown).max(), 1e-9))
        for name, shown in (("local model", delayed.local_um), ("direct feedback", delayed.direct_um))
    )
    title = "A grating of 1.2 mm over a round trip of 120 ms: the local model follows the hand of now"
    return Found(values, title, "time, s", "displacement over its greatest", series)


def _loop(heard: bool = True, *, seconds: float = 4.0, both_ways: bool = False, **links) -> Record:
    """The loop over a grating of 1.2 mm, that is heard or not; `both_ways` with half of the round trip each way."""
    way = LinkModel(one_way_ms=TRIP_MS / 2)
    links = {"uplink": way, "downlink": way} if both_ways else links
    return run_loop(Set(GratingTexture(1.2, 50.0 if heard else FAINT_MICROSTRAIN), seconds=seconds, **links))


def _machines(delayed: Record, cause: bool) -> dict:
    """The displayed and sent signals of the loop, and their delays."""
    way = LinkModel(one_way_ms=TRIP_MS / 2)
    up = _loop(uplink=way if cause else LinkModel())
    lossy = _loop(cause, seconds=5.0, downlink=LinkModel(loss=0.5))
    near_by = _loop(uplink=LinkModel() if cause else way)
    felt, uncertain = delayed.felt("local"), lossy.felt("local")
    sent = delayed.wavelength_mm[delayed.judged]
    sent = sent[np.isfinite(sent)]
    fields = {"modulus", "mu_kinetic", "area"} & set(Parameters.__struct_fields__)
    return {
        "parts": float(np.isfinite([felt.error, delayed.lag_ms("local"), delayed.lag_ms("direct")]).sum()),
        "local_error": felt.error,
        "lossy_error": uncertain.error,
        "lossy_alive": 1 - uncertain.silent,
        "local_lag": abs(delayed.lag_ms("local") if cause else _loop(both_ways=True).lag_ms("direct")),
        "direct_lag": (delayed if cause else _loop()).lag_ms("direct"),
        "one_way": up.lag_ms("direct"),
        "slave_ms": near_by.late_ms,
        "trip": delayed.late_ms,
        "sent_mm": float(np.median(sent)) if sent.size else math.nan,
        "bytes_ratio": delayed.bytes_per_s["direct"] / delayed.bytes_per_s["local"],
        "bytes_words": ", ".join(f"{name} {value:.0f} bytes a second" for name, value in delayed.bytes_per_s.items()),
        "area": float("area" in fields),
        "fields": float(len(fields)),
    }


def _borders(cause: bool) -> dict:
    """Two gratings side by side. Messages are 20 ms and searches some 60 ms apart, so one crossing gives the difference
    with an error of 100 ms."""
    borders = [
        beside_each_other(round_trip_ms=TRIP_MS * cause, speed_mm_s=speed, seed=seed)
        for seed, speed in enumerate(CROSSED_AT)
    ]
    return {
        "change_local": borders[-1].change_ms["local"],
        "change_direct": borders[-1].change_ms["direct"],
        "change_here": float(np.median([own.without_link_ms for own in borders])),
        "change_late": float(np.median([own.change_ms["local"] - own.without_link_ms for own in borders])),
    }


def _displayed(tell, cause: bool) -> dict:
    """The four conditions of 2011: whether two displays of one texture agree, which one is late, and where the
    amplitude is largest."""
    curve = read_curve()
    if not cause:
        curve = PowerCurve(curve.wavelength_mm, tuple(1.0 for _ in curve.power))
    found = experiments_2011(
        curve=curve,
        seconds=2.5,
        progress=lambda done, total: tell(f"experiments of 2011, {done} of {total}"),
    )
    direct, local = found[1], found[2]
    by_direct = np.roll(direct.felt_mm, 0 if cause else 1)
    alike = np.abs(by_direct - local.felt_mm) <= SAME_MM
    slopes = [float(np.polyfit(TESTS_MM, felt, 1)[0]) for felt in (by_direct, local.felt_mm)]
    late = [(found[3] if cause else direct).lag_ms > NOTICED_MS, np.abs(found[4].lag_ms) < NOTICED_MS]
    shown = local.amplitude_um
    inside = [k for k in range(1, len(shown) - 1) if shown[k] > max(shown[k - 1], shown[k + 1]) * 1.05]
    return {
        "alike": float(np.mean(alike)),
        "felt_mm": ", ".join(
            f"{one:.2f} and {other:.2f}" for one, other in zip(direct.felt_mm, local.felt_mm, strict=True)
        ),
        "trend": max(slopes, key=lambda slope: abs(slope - 1)),
        "late": float(np.mean(late)),
        "lags_ms": f"{np.median(found[3].lag_ms):.0f} and {np.median(np.abs(found[4].lag_ms)):.1f}",
        "peak_mm": TESTS_MM[max(inside, key=lambda k: shown[k])] if inside else math.nan,
        "shown_um": ", ".join(f"{one:.1f}" for one in shown),
    }


def _explained(signal: np.ndarray, columns: list[np.ndarray]) -> float:
    """Share of the variance of a signal (n,) that columns explain."""
    table = np.column_stack(columns)
    left = signal - table @ np.linalg.lstsq(table, signal, rcond=None)[0]
    return 1 - float(left.var() / signal.var())


def _shown(model: LocalModel, components: tuple[Component, ...], speed: float = 100.0, force: float = 0.5):
    """Places (n,) and displacement (n,) of a model during the last of 2 s at a constant speed."""
    places, shown = [], []
    for row in range(2000):
        now = row / RATE_HZ
        if row % 4 == 0:
            model.move(now, speed * now, force)
        if row % 20 == 0:
            model.learn(now, components)
        shown.append(model.update(now).displacement_um)
        places.append(speed * now)
    return np.array(places[1000:]), np.array(shown[1000:])


def _display() -> dict:
    """The output of the local model: its frequency, its waveform, and its silence under a large force."""
    values = {}
    for name, actuator in (("stimulus", PIEZO), ("stimulus_icpf", icpf(20.0))):
        _, shown = _shown(LocalModel(actuator), (Component(2.0, 20.0),))
        spectrum = np.abs(np.fft.rfft(shown - shown.mean()))
        values[name] = float(np.argmax(spectrum) * RATE_HZ / len(shown))
    place, shown = _shown(LocalModel(), (Component(1.2, 20.0),))
    waves = [wave(2 * np.pi * place / 1.2) for wave in (np.sin, np.cos)]
    both_at, both = _shown(LocalModel(components=2), (Component(1.2, 20.0), Component(2.9, 12.0)))
    lines = [[wave(2 * np.pi * both_at / one) for wave in (np.sin, np.cos)] for one in (1.2, 2.9)]
    each = [_explained(both, one) for one in lines]
    silent = [force for force in np.arange(1.9, 2.1, 0.01).tolist() if _is_silent(force)]
    frequencies = np.arange(1.0, 400.0)
    passed = np.array([icpf(20.0).passed(float(one), 200.0) for one in frequencies])
    return values | {
        "sine_share": _explained(shown, waves),
        "two_lines": float(sum(share > 0.05 for share in each)),
        "two_share": _explained(both, lines[0] + lines[1]),
        "force_limit": min(silent, default=math.nan),
        "icpf_Hz": float(frequencies[int(np.argmin(np.abs(passed - 0.5)))]),
        "at_310": PIEZO.response(310.0),
        "at_200": PIEZO.response(200.0),
        "at_290": PIEZO.response(290.0),
        "stroke": PIEZO.stroke_um,
        "volts": PIEZO.drive_V,
        "hand_Hz": HAND_HZ,
        "rate_Hz": RATE_HZ,
        "fine": PIEZO.passed(500.0, PIEZO.band_Hz),
    }


def _is_silent(force: float) -> bool:
    return not np.abs(_shown(LocalModel(), (Component(1.2, 20.0),), force=force)[1][-100:]).any()


def _links() -> dict:
    """The drawn delays, and the order in which datagrams arrive."""
    link = Link(DELAY, 3)
    drawn = np.array([link.one_way_s(0.2 * k + 0.01) for k in range(3000)])
    order = Link(DELAY, 4)
    for row in range(4000):
        order.send(row / 1000, row, 8)
    arrived = [one.content for one in order.receive(60.0)]
    out = sum(b < a for a, b in zip(arrived, arrived[1:], strict=False))
    return {"delay_mean": 1e3 * drawn.mean(), "delay_sd": 1e3 * drawn.std(), "in_order": f"{out} of {len(arrived)} out"}


def _amplitudes() -> dict:
    """Equations (9) and (11)."""
    curve = read_curve()
    places = np.linspace(*curve.fit.wavelength_mm, 201)
    printed = FromWavelength(curve, 55.0, as_printed=True)
    largest = max(printed(float(one)) for one in places)
    one, other = 0.9, 1.3
    amplitude = 0.5 * math.log(curve(other) / curve(one))
    return {
        "direct_gain": Measured()(1.0, 1.0) / AMPLIFIER_V_PER_MICROSTRAIN,
        "amplifier": AMPLIFIER_V_PER_MICROSTRAIN,
        "a_over_B": largest / 55.0,
        "B_peak": 2 * largest,
        "exponent": math.log(printed(other) / printed(one)) / amplitude,
    }
