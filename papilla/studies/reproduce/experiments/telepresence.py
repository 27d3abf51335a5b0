"""2007 and 2011 Okamoto: roughness at a distance, by a local model at the hand or by direct feedback."""

import math

import numpy as np

from papilla.studies.reproduce.claim import Found, Series
from papilla.studies.telepresence.delays import beside_each_other
from papilla.studies.telepresence.pairwise import pairwise_2007
from papilla.studies.telepresence.roughness import DELAY, TESTS_MM, Experiments, experiments_2011
from papilla.telepresence import Component, FromWavelength, Link, LinkModel, LocalModel, Set, icpf, read_curve
from papilla.telepresence.actuator import PIEZO
from papilla.telepresence.amplitude import Measured
from papilla.telepresence.loop import run as run_loop
from papilla.telepresence.messages import Parameters
from papilla.telepresence.motion import HAND_HZ, RATE_HZ
from papilla.telepresence.texture import GratingTexture

SIMULATED = "simulated hand, link, actuator and sensor; observers with one noise figure a cue stand for people"
TRIP_MS = 120.0


def run(tell) -> Found:
    """Roughness at a distance: a local model against direct feedback, over delayed links, with simulated observers.

    The loop of hand, uplink, sensor, downlink and display runs over a grating of 1.2 mm, with 60 ms each way, with one
    way alone, and with half of all datagrams lost. Two gratings side by side are crossed nine times. The pairwise test
    of 2007 and the four conditions of 2011 are answered by observers whose noise is stated.
    """
    tell("the loop")
    way = LinkModel(one_way_ms=TRIP_MS / 2)
    delayed = run_loop(Set(GratingTexture(1.2), seconds=5.0, uplink=way, downlink=way))
    up = run_loop(Set(GratingTexture(1.2), seconds=4.0, uplink=way))
    lossy = run_loop(Set(GratingTexture(1.2), seconds=5.0, downlink=LinkModel(loss=0.5)))
    near_by = run_loop(Set(GratingTexture(1.2), seconds=4.0))
    felt, uncertain = delayed.felt("local"), lossy.felt("local")
    fields = {"modulus", "mu_kinetic", "area"} & set(Parameters.__struct_fields__)
    values = {
        "parts": float(np.isfinite([felt.error, delayed.lag_ms("local"), delayed.lag_ms("direct")]).sum()),
        "local_error": felt.error,
        "lossy_error": uncertain.error,
        "lossy_alive": 1 - uncertain.silent,
        "local_lag": abs(delayed.lag_ms("local")),
        "direct_lag": delayed.lag_ms("direct"),
        "one_way": up.lag_ms("direct"),
        "slave_ms": near_by.late_ms,
        "trip": delayed.late_ms,
        "sent_mm": float(np.nanmedian(delayed.wavelength_mm[delayed.judged])),
        "bytes_ratio": delayed.bytes_per_s["direct"] / delayed.bytes_per_s["local"],
        "bytes_words": ", ".join(f"{name} {value:.0f} bytes a second" for name, value in delayed.bytes_per_s.items()),
        "area": float("area" in fields),
        "fields": float(len(fields)),
        **_display(),
        **_links(),
        **_amplitudes(),
    }
    tell("side by side")
    # Messages are 20 ms and looks along the path some 60 ms apart: one crossing tells the difference to 100 ms.
    borders = [
        beside_each_other(round_trip_ms=TRIP_MS, speed_mm_s=speed, seed=seed)
        for seed in range(3)
        for speed in (81.0, 84.0, 87.0)
    ]
    border = borders[-1]
    values |= {
        "change_local": border.change_ms["local"],
        "change_direct": border.change_ms["direct"],
        "change_here": border.without_link_ms,
        "change_late": float(np.median([own.change_ms["local"] - own.without_link_ms for own in borders])),
    }
    tell("pairs of 2007")
    values |= _pairs()
    tell("experiments of 2011")
    found = experiments_2011(progress=lambda done, total: tell(f"experiments of 2011, {done} of {total}"))
    values |= _people(found)
    rows = slice(2000, 2250)
    series = (
        Series("local model", delayed.time_s[rows], delayed.local_um[rows] / np.abs(delayed.local_um).max()),
        Series("direct feedback", delayed.time_s[rows], delayed.direct_um[rows] / np.abs(delayed.direct_um).max()),
    )
    title = "A grating of 1.2 mm over a round trip of 120 ms: the local model follows the hand of now"
    return Found(values, title, "time, s", "displacement over its greatest", series)


def _explained(signal: np.ndarray, columns: list[np.ndarray]) -> float:
    """Share of the variance of a signal (n,) that columns explain."""
    table = np.column_stack(columns)
    left = signal - table @ np.linalg.lstsq(table, signal, rcond=None)[0]
    return 1 - float(left.var() / signal.var())


def _shown(model: LocalModel, components: tuple[Component, ...], speed: float = 100.0, force: float = 0.5):
    """Places (n,) and displacement (n,) of a model over 2 s at a constant speed, the last second of it."""
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
    """What the local model displays: its frequency, its form, its silence under a great force."""
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
    """Delays as they are drawn, and the order in which datagrams arrive."""
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
    from papilla.telepresence.amplitude import AMPLIFIER_V_PER_MICROSTRAIN

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


def _pairs() -> dict:
    found = pairwise_2007()
    return {
        "pairs_above": float(found.above_nine_tenths),
        "least": float(found.least),
        "rates": " ".join(f"{rate:.2f}" for rate in np.sort(found.rates)),
        "observer_sd": found.observer_sd,
        "observer_low": found.interval[0],
        "observer_high": found.interval[1],
        "system_sd": found.system_sd,
    }


def _people(found: Experiments) -> dict:
    """The four conditions of 2011."""
    conditions = found.conditions
    (t_12, p_12), (t_34, p_34) = found.welch(1, 2), found.welch(3, 4)
    means = conditions[2].means_mm
    inside = [k for k in range(1, len(means) - 1) if means[k] > means[k - 1] and means[k] > means[k + 1]]
    return {
        "answers": float(sum(one.answers_mm.size for one in conditions.values())),
        "t_12": t_12,
        "p_12": p_12,
        "t_34": t_34,
        "p_34": p_34,
        "differs_12": found.significant(1, 2),
        "differs_34": found.significant(3, 4),
        "least_12": found.detectable_mm(1, 2),
        "noticed_direct": conditions[3].noticed,
        "noticed_local": conditions[4].noticed,
        "noticed": float(conditions[3].noticed - conditions[4].noticed),
        "answers_mm": ", ".join(f"{mean:.2f}" for mean in means),
        "answer_peak": TESTS_MM[max(inside, key=lambda k: means[k])] if inside else math.nan,
    }
