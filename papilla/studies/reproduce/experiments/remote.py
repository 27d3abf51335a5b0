"""2007 and 2011 Okamoto: roughness at a distance, by a local model at the hand or by direct feedback."""

import math

import numpy as np

from papilla.studies.reproduce.claim import Claim, Experiment, Found, Series, above, below, near
from papilla.studies.telepresence.delays import beside_each_other
from papilla.studies.telepresence.pairwise import pairwise_2007
from papilla.studies.telepresence.roughness import DELAY, TESTS_MM, Experiments, experiments_2011
from papilla.telepresence import Component, FromWavelength, Link, LinkModel, LocalModel, Set, icpf, read_curve
from papilla.telepresence.actuator import PIEZO
from papilla.telepresence.amplitude import Measured
from papilla.telepresence.loop import HAND_HZ, RATE_HZ
from papilla.telepresence.loop import run as run_loop
from papilla.telepresence.messages import Parameters
from papilla.telepresence.texture import GratingTexture

SIMULATED = "simulated hand, link, actuator and sensor; observers with one noise figure a cue stand for people"
LOOP, PEOPLE = "papilla telepresence simulate", "studies.telepresence.roughness.experiments_2011()"
MODEL = "telepresence.LocalModel"
TRIP_MS = 120.0
NOT_PRINTED = "how softness and friction are shown on a display is not described"

CLAIMS = (
    Claim("A43", "2006 I", "Display, sensor and quick estimation together make touch at a distance", 3.0, near(3.0),
          "parts in one loop", "parts", LOOP, "the loop runs: wavelength felt within {local_error:.1%}; {SIMULATED}"),
    Claim("A44", "2006 I, IV", "An ICPF display works from 0 to 200 Hz", 200.0, near(200.0, by=25.0), "Hz", "icpf_Hz",
          "telepresence.icpf(stroke_um)", "where it fades to a half; its stroke is not printed"),
    Claim("A45", "2006 I [9]", "Softness, roughness and friction are synthesised on one display", "word",
          cannot=NOT_PRINTED),
    Claim("A46", "2006 I [4][5]", "Softness can be shown by a contact area", 1.0, near(1.0), "field of a message",
          "area", "telepresence.messages.Parameters.area",
          "the area of an estimated modulus travels; no display of area exists"),
    Claim("A47", "2006 III.A",
          "With the wavelength and the hand's own speed the display goes on while the link fails", 1.0, above(0.8),
          "share of time displayed", "lossy_alive", LOOP,
          "half of all datagrams lost; wavelength error {lossy_error:.1%}; {SIMULATED}"),
    Claim("B1", "2007 1-2, fig. 1", "Parameters are sent, the stimulus is made where the hand is", 0.0, below(0.1),
          "rms error of the felt wavelength", "local_error", LOOP, "{SIMULATED}"),
    Claim("B2", "2007 2", "The stimulus has the frequency f = v / lambda", 50.0, near(50.0, percent=2), "Hz",
          "stimulus", MODEL, "2 mm at 100 mm/s"),
    Claim("B10", "2007 3.2", "The ICPF display is driven at v / lambda", 50.0, near(50.0, percent=2), "Hz",
          "stimulus_icpf", "LocalModel(icpf(20))", "2 mm at 100 mm/s"),
    Claim("B12", "2007 3.3", "The sensor's arm moves with the speed of the hand", 0.0, below(10.0),
          "ms behind, no delay", "slave_ms", LOOP, "positions at 250 Hz; {SIMULATED}"),
    Claim("B13", "2007 4", "Of six pairs of 1-4 mm four are told apart at over 0.9, two at 0.7", 4.0, near(4.0),
          "pairs at 0.9 or more", "pairs_above", "studies.telepresence.pairwise.pairwise_2007()",
          "simulated observer, its one noise figure fitted to these rates (sd {observer_sd:.2f} of ln lambda, "
          "{observer_low:.2f}-{observer_high:.2f}): {rates}; the system itself adds {system_sd:.3f}"),
    Claim("B14", "2007 4", "The four are significant at 95 %", 9.0, near(9.0), "right answers of ten", "least",
          "scipy.stats.binomtest", "two-sided; 7 of 10 has p = 0.34, so the two others are not"),
    Claim("B15", "2007 1", "Parameters need far less bandwidth than the signal", "far less", above(2.0),
          "bytes of the signal over those of parameters", "bytes_ratio", LOOP, "{bytes_words} payload"),
    Claim("B16", "2007 abstract", "The delay of communication is cancelled", 0.0, below(10.0), "ms behind the hand",
          "local_lag", LOOP, "round trip {trip:.0f} ms; {SIMULATED}"),
    Claim("C2", "2011 Okamoto eq. (2)", "The sensor's place is the hand's, a delay ago", 60.0, near(60.0, by=8.0),
          "ms", "one_way", LOOP, "60 ms up, none down"),
    Claim("C3", "2011 Okamoto eq. (3)", "Direct feedback is late by both delays", 120.0, near(120.0, by=12.0), "ms",
          "direct_lag", LOOP, "60 ms each way"),
    Claim("C4", "2011 Okamoto eq. (4)", "The local model uses late parameters at the hand's place of now", 0.0,
          below(10.0), "ms behind the hand", "local_lag", LOOP, "the same link"),
    Claim("C5", "2011 Okamoto eq. (5)", "What is sent is estimated from the sensor's signal", 1.2,
          near(1.2, percent=3), "mm", "sent_mm", LOOP, "the grating is of 1.2 mm"),
    Claim("C6", "2011 Okamoto eq. (6)", "The display is a sum of A sin(2 pi x / lambda) of the hand's place", 1.0,
          above(0.98), "share of variance explained", "sine_share", MODEL, "one component, strokes"),
    Claim("C8", "2011 Okamoto 2.2", "More components make a richer texture; one is used", 2.0, near(2.0),
          "lines shown", "two_lines", "LocalModel(components=2)", "{two_share:.1%} of the variance is in both"),
    Claim("C9", "2011 Okamoto 3.1", "Actuator: 55 um peak to peak at 150 V, -3 dB at 310 Hz, flat to 300 Hz", 0.7071,
          near(0.7071, by=0.01), "response at 310 Hz", "at_310", "telepresence.actuator.PIEZO",
          "{stroke:g} um at {volts:g} V; {at_200:.3f} at 200 Hz, {at_290:.3f} at 290 Hz"),
    Claim("C10", "2011 Okamoto 3.1", "Positions at 250 Hz, data at 1 kHz", 250.0, near(250.0), "Hz", "hand_Hz",
          "telepresence.loop.HAND_HZ", "output at {rate_Hz:g} Hz"),
    Claim("C11", "2011 Okamoto 3.2.1", "The pressing force is watched: at most 2 N", 2.0, near(2.0, by=0.02), "N",
          "force_limit", "LocalModel.move(time_s, position_mm, force_N)",
          "least force at which the display falls silent"),
    Claim("C29", "2011 Okamoto eq. (9)", "Direct feedback displays 23.8 um a volt", 23.8, near(23.8, percent=1),
          "um/V", "direct_gain", "telepresence.DirectFeedback", "behind the amplifier's 0.01 V per microstrain"),
    Claim("C15", "2011 Okamoto 3.2.3", "The amplifier gives 0.01 V per microstrain, read at 1 kHz", 0.01,
          near(0.01, percent=1), "V per microstrain", "amplifier", "telepresence.amplitude"),
    Claim("C30", "2011 Okamoto eq. (10)", "The local model displays a(lambda) sin(2 pi x / lambda)", 1.0, above(0.98),
          "share of variance explained", "sine_share", MODEL),
    Claim("C31", "2011 Okamoto eq. (11)", "The amplitude is B g_A / P_max", 1.0, near(1.0, percent=0.1),
          "a at the greatest power over B", "a_over_B", "FromWavelength(curve, 55, as_printed=True)",
          "P_max is lost in print: that of the shipped g_A, of sliding scenes, is taken"),
    Claim("X9", "2011 Okamoto eq. (11)", "B = 55 um fits an actuator of 55 um", 55.0, below(55.0), "um peak to peak",
          "B_peak", "2 B",
          "inconsistent in print: an amplitude of 55 um is 110 um peak to peak; papilla takes B for the stroke"),
    Claim("X10", "2011 Okamoto eqs (8), (11)", "The displacement goes with the signal", 1.0, near(1.0, by=0.05),
          "exponent of the signal's amplitude", "exponent", "telepresence.FromWavelength",
          "inconsistent in print: (11) makes it proportional to a power, the square of an amplitude; papilla takes "
          "the root"),
    Claim("C32", "2011 Okamoto 5.2", "Delays N(120, 40) ms drawn every 200 ms, first in, first out", 120.0,
          near(120.0, by=4.0), "ms mean", "delay_mean", "telepresence.Link",
          "sd {delay_sd:.1f} ms; {in_order} of order"),
    Claim("C33", "2011 Okamoto 1 [15]", "A delay is noticed above 60 ms, a texture changed at 40 ms", (40.0, 60.0),
          cannot="people; the cited study's own figures, 41 and 59 ms, are those of the simulated observers"),
    Claim("C34", "2011 Okamoto 5.1-5.3", "Eight people, seven gratings of 0.8-2.0 mm, two trials, four conditions",
          448.0, near(448.0), "answers", "answers", PEOPLE, "{SIMULATED}"),
    Claim("C35", "2011 Okamoto 5.4.1, fig. 15", "Without delay local model and direct feedback are alike",
          "no difference", above(0.05), "Welch p", "p_12", PEOPLE, "t = {t_12:.2f} (0.857 printed); differs in "
          "{differs_12:.0%} of simulated repetitions; a difference of {least_12:.2f} mm would be found; {SIMULATED}"),
    Claim("C36", "2011 Okamoto 5.4.2, fig. 16", "With delay their errors do not differ either", "no difference",
          above(0.05), "Welch p", "p_34", PEOPLE,
          "t = {t_34:.2f} (0.826 printed); differs in {differs_34:.0%} of simulated repetitions; {SIMULATED}"),
    Claim("C37", "2011 Okamoto 5.4.2", "All notice the delay of direct feedback, none that of the local model", 8.0,
          near(8.0), "of eight, direct less local", "noticed", PEOPLE, "{noticed_direct} and {noticed_local} of 8; "
          "an observer notices a lag over its threshold, of 59 ms on average"),
    Claim("C38", "2011 Okamoto 5.4.1", "Answers have a local maximum near 1.4 mm, because g_A has", 1.4, (1.2, 1.6),
          "mm", "answer_peak", PEOPLE, "mean answers {answers_mm} mm for 0.8 to 2.0 mm; NaN: no maximum inside; the "
          "people's own answers are lost in print"),
    Claim("C41", "2011 Okamoto 2.1", "A change of texture is told a round trip late", 120.0, near(120.0, by=40.0),
          "ms", "change_late", "studies.telepresence.delays.beside_each_other()", "from 1 to 4 mm: "
          "{change_local:.0f} ms by the local model over the link, {change_here:.0f} ms without, {change_direct:.0f} "
          "ms by direct feedback at 87 mm/s; the median of nine crossings"),
    Claim("B7b", "2007 fig. 5", "From 1 to 4 mm side by side the loop shows 4 mm within 0.08 s", 80.0, below(80.0),
          "ms", "change_here", "studies.telepresence.delays.beside_each_other()",
          "papilla's own estimator, no link; {SIMULATED}"),
    Claim("C43", "2011 Okamoto 5.3", "Fine textures leave the driver's band", 0.0, below(0.01), "share displayed",
          "fine", "telepresence.actuator.PIEZO.passed", "0.2 mm at 100 mm/s is 500 Hz"),
    Claim("C44", "2011 Okamoto 3.2.2", "The scheme extends to friction and softness", 3.0, near(3.0),
          "more fields of a message", "fields", "telepresence.messages.Parameters",
          "modulus, friction, contact area; no display of them exists"),
)  # fmt: skip


def run(tell) -> Found:
    """The loop over links, and the papers' experiments with simulated observers."""
    tell("the loop")
    way = LinkModel(one_way_ms=TRIP_MS / 2)
    delayed = run_loop(Set(GratingTexture(1.2), seconds=5.0, uplink=way, downlink=way))
    up = run_loop(Set(GratingTexture(1.2), seconds=4.0, uplink=way))
    lossy = run_loop(Set(GratingTexture(1.2), seconds=5.0, downlink=LinkModel(loss=0.5)))
    near_by = run_loop(Set(GratingTexture(1.2), seconds=4.0))
    felt, uncertain = delayed.felt("local"), lossy.felt("local")
    fields = {"modulus", "mu_kinetic", "area"} & set(Parameters.__struct_fields__)
    values = {
        "SIMULATED": SIMULATED,
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


EXPERIMENT = Experiment(
    "telepresence",
    "Roughness at a distance: a local model against direct feedback, over delayed links, with simulated observers",
    CLAIMS,
    run,
    SIMULATED,
)
