"""2007 and 2011 Okamoto: roughness at a distance, by a local model at the hand or by direct feedback."""

import math

import numpy as np

from papilla.core.units import MS_PER_S
from papilla.telepresence import Component, FromWavelength, Link, LinkModel, LocalModel, Set, icpf, read_curve
from papilla.telepresence.actuator import PIEZO_STACK
from papilla.telepresence.amplitude import AMPLIFIER_V_PER_MICROSTRAIN, Measured, PowerCurve
from papilla.telepresence.loop import run as run_loop
from papilla.telepresence.messages import Parameters
from papilla.telepresence.motion import HAND_HZ, HAND_RATE_HZ
from papilla.telepresence.record import LoopRecord
from papilla.telepresence.touch import GratingTexture
from papilla_papers.claims.claim import Experiment, gathered
from papilla_papers.claims.scenes import scene
from papilla_papers.claims.signals import listed
from papilla_papers.telepresence import FEEDBACK_DELAY, NOTICED_MS, TESTS_MM, beside_each_other, experiments_2011

LINK_SCENE = scene("telepresence")


def run(tell, cause: bool = True) -> dict:
    """Roughness at a distance: a local model against direct feedback, over delayed links.

    The loop of hand, uplink, sensor, downlink and display runs over a grating of 1.2 mm, with 60 ms each way, with one
    way alone, and with half of all datagrams lost. Two gratings side by side are crossed five times. What the four
    conditions of 2011 displayed is compared: wavelength over the hand's own path, lag, amplitude.
    """
    tell("the loop")
    delayed = _loop(cause, seconds=LINK_SCENE.long_s, both_ways=True)
    values = gathered(lambda: _machines(delayed, cause), _display, _links, _amplitudes)
    tell("side by side")
    values |= gathered(lambda: _borders(cause))
    tell("experiments of 2011")
    return values | gathered(lambda: _displayed(tell, cause))


def _loop(strong: bool = True, *, seconds: float = LINK_SCENE.seconds, both_ways: bool = False, **links) -> LoopRecord:
    """The loop over a grating of 1.2 mm, whose signal is far above the noise or, if not `strong`, far below it.

    both_ways : half of the round trip each way.
    """
    way = LinkModel(one_way_ms=LINK_SCENE.trip_ms / 2)
    links = {"uplink": way, "downlink": way} if both_ways else links
    amplitude = LINK_SCENE.microstrain if strong else LINK_SCENE.faint_microstrain
    texture = GratingTexture(LINK_SCENE.wavelength_mm, amplitude)
    return run_loop(Set(texture, seconds=seconds, **links))


def _machines(delayed: LoopRecord, cause: bool) -> dict:
    """The displayed and sent signals of the loop, and their delays."""
    way = LinkModel(one_way_ms=LINK_SCENE.trip_ms / 2)
    up = _loop(uplink=way if cause else LinkModel())
    lossy = _loop(cause, seconds=LINK_SCENE.long_s, downlink=LinkModel(loss=LINK_SCENE.loss))
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
        beside_each_other(round_trip_ms=LINK_SCENE.trip_ms * cause, speed_mm_s=speed, seed=seed)
        for seed, speed in enumerate(LINK_SCENE.crossed_mm_s)
    ]
    return {
        "change_local": borders[-1].change_ms["local"],
        "change_direct": borders[-1].change_ms["direct"],
        "change_here": float(np.median([border.without_link_ms for border in borders])),
        "change_late": float(np.median([border.change_ms["local"] - border.without_link_ms for border in borders])),
    }


def _displayed(tell, cause: bool) -> dict:
    """The four conditions of 2011: whether two displays of one texture agree, which one is late, and where the
    amplitude is largest."""
    curve = read_curve()
    if not cause:
        curve = PowerCurve(curve.wavelength_mm, tuple(1.0 for _ in curve.power))
    conditions = experiments_2011(curve=curve, seconds=LINK_SCENE.displayed_s, progress=tell)
    direct, local, direct_late, local_late = conditions.values()
    by_direct = np.roll(direct.felt_mm, 0 if cause else 1)
    alike = np.abs(by_direct - local.felt_mm) <= LINK_SCENE.same_mm
    slopes = [float(np.polyfit(TESTS_MM, felt, 1)[0]) for felt in (by_direct, local.felt_mm)]
    late = [(direct_late if cause else direct).lag_ms > NOTICED_MS, np.abs(local_late.lag_ms) < NOTICED_MS]
    amplitudes = local.amplitude_um
    inside = [
        k
        for k in range(1, len(amplitudes) - 1)
        if amplitudes[k] > max(amplitudes[k - 1], amplitudes[k + 1]) * LINK_SCENE.stands_out
    ]
    return {
        "alike": float(np.mean(alike)),
        "felt_mm": ", ".join(
            f"{by_feedback:.2f} and {by_model:.2f}"
            for by_feedback, by_model in zip(direct.felt_mm, local.felt_mm, strict=True)
        ),
        "trend": max(slopes, key=lambda slope: abs(slope - 1)),
        "late": float(np.mean(late)),
        "lags_ms": f"{np.median(direct_late.lag_ms):.0f} and {np.median(np.abs(local_late.lag_ms)):.1f}",
        "peak_mm": TESTS_MM[max(inside, key=lambda k: amplitudes[k])] if inside else math.nan,
        "shown_um": listed(amplitudes, ".1f"),
    }


def _explained(signal: np.ndarray, columns: list[np.ndarray]) -> float:
    """Share of the variance of a signal (n,) that columns explain."""
    table = np.column_stack(columns)
    residual = signal - table @ np.linalg.lstsq(table, signal, rcond=None)[0]
    return 1 - float(residual.var() / signal.var())


def _shown(model: LocalModel, components: tuple[Component, ...], force: float = LINK_SCENE.model.force_N):
    """Places (n,) and displacement (n,) of a model during the last of 2 s at a constant speed."""
    setup, displacement = LINK_SCENE.model, []
    time = np.arange(setup.samples) / HAND_RATE_HZ
    for step, now in enumerate(time.tolist()):
        if step % setup.moves_every == 0:
            model.move(now, setup.speed_mm_s * now, force)
        if step % setup.learns_every == 0:
            model.learn(now, components)
        displacement.append(model.update(now).displacement_um)
    return setup.speed_mm_s * time[setup.first_sample :], np.array(displacement[setup.first_sample :])


def _display() -> dict:
    """The output of the local model: its frequency, its waveform, and its silence under a large force."""
    values, setup, slow = {}, LINK_SCENE.display, icpf(LINK_SCENE.display.icpf_um)
    for name, actuator in (("stimulus", PIEZO_STACK), ("stimulus_icpf", slow)):
        _, displacement = _shown(LocalModel(actuator), (Component(*setup.stimulus),))
        spectrum = np.abs(np.fft.rfft(displacement - displacement.mean()))
        values[name] = float(np.argmax(spectrum) * HAND_RATE_HZ / len(displacement))
    first, second = Component(*setup.one), Component(*setup.other)
    place, displacement = _shown(LocalModel(), (first,))
    both_at, both = _shown(LocalModel(components=2), (first, second))
    lines = [_waves(both_at, mm) for mm, _ in (setup.one, setup.other)]
    shares = [_explained(both, line) for line in lines]
    forces = np.arange(setup.forces_N["from"], setup.forces_N.to, setup.forces_N.step)
    silent = [force for force in forces.tolist() if _is_silent(force)]
    frequencies = np.arange(setup.frequencies_Hz["from"], setup.frequencies_Hz.to)
    passed = np.array([slow.passed(float(hertz), setup.icpf_band_Hz) for hertz in frequencies])
    piezo = zip(("at_310", "at_200", "at_290"), map(PIEZO_STACK.response, setup.piezo_Hz), strict=True)
    return (
        values
        | dict(piezo)
        | {
            "sine_share": _explained(displacement, _waves(place, setup.one[0])),
            "two_lines": float(sum(share > setup.present for share in shares)),
            "two_share": _explained(both, lines[0] + lines[1]),
            "force_limit": min(silent, default=math.nan),
            "icpf_Hz": float(frequencies[int(np.argmin(np.abs(passed - 0.5)))]),
            "stroke": PIEZO_STACK.stroke_um,
            "volts": PIEZO_STACK.drive_V,
            "hand_Hz": HAND_HZ,
            "rate_Hz": HAND_RATE_HZ,
            "fine": PIEZO_STACK.passed(setup.fine_Hz, PIEZO_STACK.band_Hz),
        }
    )


def _waves(place: np.ndarray, wavelength_mm: float) -> list[np.ndarray]:
    return [wave(2 * np.pi * place / wavelength_mm) for wave in (np.sin, np.cos)]


def _is_silent(force: float) -> bool:
    _, displacement = _shown(LocalModel(), (Component(*LINK_SCENE.display.one),), force=force)
    return not displacement[-LINK_SCENE.display.last_samples :].any()


def _links() -> dict:
    """The drawn delays, and the order in which datagrams arrive."""
    setup = LINK_SCENE.links
    link, order = Link(FEEDBACK_DELAY, setup.seed), Link(FEEDBACK_DELAY, setup.order_seed)
    drawn = MS_PER_S * np.array([link.one_way_s(setup.every_s * k + setup.offset_s) for k in range(setup.draws)])
    for number in range(setup.datagrams):
        order.send(number / HAND_RATE_HZ, number, setup.size)
    arrived = [datagram.content for datagram in order.receive(setup.until_s)]
    out = sum(b < a for a, b in zip(arrived, arrived[1:], strict=False))
    return {"delay_mean": drawn.mean(), "delay_sd": drawn.std(), "in_order": f"{out} of {len(arrived)} out"}


def _amplitudes() -> dict:
    """Equations (9) and (11)."""
    curve, setup = read_curve(), LINK_SCENE.amplitudes
    places = np.linspace(*curve.fit.wavelength_mm, setup.places)
    printed = FromWavelength(curve, setup.B, as_printed=True)
    largest = max(printed(float(place)) for place in places)
    first, second = setup.wavelengths_mm
    amplitude = 0.5 * math.log(curve(second) / curve(first))
    return {
        "direct_gain": Measured()(1.0, 1.0) / AMPLIFIER_V_PER_MICROSTRAIN,
        "amplifier": AMPLIFIER_V_PER_MICROSTRAIN,
        "a_over_B": largest / setup.B,
        "B_peak": 2 * largest,
        "exponent": math.log(printed(second) / printed(first)) / amplitude,
    }


experiment = Experiment.of(run)
