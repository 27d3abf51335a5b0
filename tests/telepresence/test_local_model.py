"""The local model: continuous whatever comes, inside band and stroke, silent when it must be."""

import math

import numpy as np
import pytest

from papilla.core.errors import InputError
from papilla.telepresence import Actuator, Component, DisplayStatus, LocalModel, QuantityTrust, Safety

FINE_HZ = 20_000.0


def play(model, seconds, place, *, rate_Hz=1000.0, events=None, hand_Hz=250.0, force=lambda t: math.nan, start_s=0.0):
    """Shown of each sample; `events(t)` gives the components that arrive, or None."""
    shown, every = [], round(rate_Hz / hand_Hz)
    for row in range(round(seconds * rate_Hz)):
        now = start_s + row / rate_Hz
        if row % every == 0:
            model.move(now, place(now), force(now))
        if events is not None and (told := events(now)) is not None:
            model.learn(now, *told)
        shown.append(model.update(now))
    return shown


def every(period_s, *told):
    last = [-math.inf]

    def events(now):
        if 0 <= now - last[0] < period_s:
            return None
        last[0] = now
        return told

    return events


def test_it_is_the_printed_sine_of_the_hand_for_one_wavelength():
    model = LocalModel()
    shown = play(model, 2.0, lambda t: 60 * t, events=every(0.05, (Component(1.2, 40.0),)))
    y = np.array([one.displacement_um for one in shown])[1000:]
    x = 60 * np.arange(1000, 2000) / 1000
    design = np.column_stack([np.sin(2 * np.pi * x / 1.2), np.cos(2 * np.pi * x / 1.2)])
    solution, residual, *_ = np.linalg.lstsq(design, y, rcond=None)
    assert np.hypot(*solution) == pytest.approx(40 * 0.238, rel=1e-3)
    assert residual[0] / (y @ y) < 1e-4
    assert shown[-1].frequency_Hz == pytest.approx(50.0, rel=1e-6)
    assert shown[-1].status == DisplayStatus.OK
    loud = play(LocalModel(), 1.0, lambda t: 140 * t, events=every(0.05, (Component(0.5, 1000.0),)))[-200:]
    assert loud[-1].status == DisplayStatus.LIMITED
    assert max(abs(one.drive_V - 75) for one in loud) == pytest.approx(75, rel=0.02)


@pytest.mark.parametrize("compensate, share", [(True, 1.0), (False, math.sqrt(0.5))])
def test_a_roll_off_is_compensated_or_left_in_the_displacement(compensate, share):
    """At its corner an actuator of first order moves by 1 / sqrt(2) of what its volts ask for."""
    model = LocalModel(Actuator("slow", 55.0, 300.0, corner_Hz=100.0, order=1, drive_V=100.0), compensate=compensate)
    shown = play(model, 1.0, lambda t: 120 * t, events=every(0.05, (Component(1.2, 40.0),)))[500:]
    moved = math.sqrt(2) * np.std([one.displacement_um for one in shown])
    volts = math.sqrt(2) * np.std([one.drive_V for one in shown])
    assert moved == pytest.approx(share * 40 * 0.238, rel=2e-3)
    assert volts == pytest.approx(100.0 * math.sqrt(2) * moved / 55.0, rel=2e-3), "100 V for the whole stroke at rest"


@pytest.mark.parametrize("seed", range(8))
def test_the_drive_is_continuous_whatever_arrives(seed):
    rng = np.random.default_rng(seed)
    model = LocalModel(components=3, rate_Hz=FINE_HZ, safety=Safety(hold_s=0.1, decay_s=0.05, attack_s=0.02))
    place, speed = [0.0], [0.0]

    def hand(now):
        if rng.random() < 0.02:
            speed[0] = rng.uniform(-800, 800)
        place[0] += speed[0] / 250
        if rng.random() < 0.01:
            place[0] += rng.uniform(-500, 500)
        return math.nan if rng.random() < 0.01 else place[0]

    def events(now):
        if rng.random() > 0.002:
            return None
        lines = [Component(*rng.uniform((0.3, 0), (6, 300))) for _ in range(rng.integers(0, 5))]
        lines += [Component(math.nan, 1.0), Component(-1.0, 5.0), Component(1.0, math.inf)]
        return tuple(lines), rng.choice(list(QuantityTrust))

    def force(now):
        return rng.choice([math.nan, 0.5, 1.95, 2.5])

    shown = play(model, 1.5, hand, rate_Hz=FINE_HZ, events=events, force=force)
    volts = np.array([one.drive_V for one in shown])
    assert np.isfinite(volts).all()
    assert volts.min() >= -1e-9 and volts.max() <= 150 + 1e-9
    steepest = 75 * (2 * math.pi * 300 + 2 / 0.02 + 1 / 0.02) / FINE_HZ
    assert np.abs(np.diff(volts)).max() <= 1.01 * steepest
    assert {one.status for one in shown} & {DisplayStatus.LIMITED, DisplayStatus.TOO_FAST, DisplayStatus.PRESSED}


@pytest.mark.parametrize("rate_Hz", [1000.0, 4000.0])
def test_nothing_is_heard_beyond_the_band(rate_Hz):
    model = LocalModel(rate_Hz=rate_Hz)
    texture = every(0.05, (Component(0.5, 100.0),))
    shown = play(model, 1.0, lambda t: 300 * t, rate_Hz=rate_Hz, events=texture)  # 600 Hz
    assert shown[-1].status == DisplayStatus.TOO_FAST
    assert all(one.displacement_um == 0 for one in shown[len(shown) // 2 :])
    sweep = play(LocalModel(rate_Hz=rate_Hz), 3.0, lambda t: 40 * t * t, rate_Hz=rate_Hz, events=texture)
    y = np.array([one.displacement_um for one in sweep])
    spectrum = np.abs(np.fft.rfft(y * np.hanning(y.size))) ** 2
    frequency = np.fft.rfftfreq(y.size, 1 / rate_Hz)
    assert spectrum[frequency > 330].sum() < 1e-4 * spectrum.sum()


@pytest.mark.parametrize("cause", ["link", "hand", "force"])
def test_it_decays_to_zero_in_the_stated_time_and_comes_back_without_a_step(cause):
    safety = Safety(hold_s=0.2, decay_s=0.1, attack_s=0.05)
    model = LocalModel(rate_Hz=FINE_HZ, safety=safety)
    texture = every(0.05, (Component(1.0, 100.0),))

    def away(now):
        return 0.5 < now < 1.5

    shown = play(
        model,
        2.0,
        lambda t: math.nan if cause == "hand" and away(t) else 50 * t,
        rate_Hz=FINE_HZ,
        events=lambda t: None if cause == "link" and away(t) else texture(t),
        force=lambda t: 2.5 if cause == "force" and away(t) else 0.5,
    )
    y = np.array([one.displacement_um for one in shown])
    quiet = 0.5 + (safety.decay_s if cause == "force" else safety.hold_s + safety.decay_s) + 0.06
    assert (y[round(quiet * FINE_HZ) : round(1.5 * FINE_HZ)] == 0).all()
    assert np.abs(y[: round(0.5 * FINE_HZ)]).max() > 20 and np.abs(y[-2000:]).max() > 20
    assert np.abs(np.diff(y)).max() < 27.5 * (2 * math.pi * 60 + 100) / FINE_HZ
    kind = {"link": DisplayStatus.STALLED, "hand": DisplayStatus.NO_HAND, "force": DisplayStatus.PRESSED}[cause]
    assert shown[round(1.4 * FINE_HZ)].status == kind


def test_a_clock_that_jumps_or_sleeps_makes_no_step():
    model = LocalModel(rate_Hz=FINE_HZ)
    texture = every(0.05, (Component(1.0, 100.0),))
    before = play(model, 0.5, lambda t: 50 * t, rate_Hz=FINE_HZ, events=texture)[-1]
    again = model.update(0.3)
    assert again.status == DisplayStatus.CLOCK and again.displacement_um == before.displacement_um
    assert model.update(math.nan).status == DisplayStatus.CLOCK
    slept = model.update(60.0)
    assert abs(slept.displacement_um - before.displacement_um) < 1.0
    after = play(
        model, 0.5, lambda t: 50 * t, rate_Hz=FINE_HZ, events=every(0.05, (Component(1.0, 100.0),)), start_s=61
    )
    assert np.abs(np.diff([one.displacement_um for one in after])).max() < 2.0
    assert after[-1].status == DisplayStatus.OK


def heard(displacement, place, wavelengths):
    """Amplitude of each wavelength in what is displayed along a path, by least squares."""
    phase = 2 * np.pi * np.multiply.outer(np.asarray(place), 1 / np.array(wavelengths))
    found, *_ = np.linalg.lstsq(np.hstack([np.cos(phase), np.sin(phase)]), np.asarray(displacement), rcond=None)
    return np.hypot(*found.reshape(2, -1))


def test_components_are_the_strongest_and_gone_ones_fade():
    lines = (Component(1.0, 10.0), Component(2.0, 30.0), Component(4.0, 20.0))
    model = LocalModel(components=2)
    shown = play(model, 1.0, lambda t: 50 * t, events=every(0.05, lines))
    loud = heard([one.displacement_um for one in shown[400:]], 50 * np.arange(400, len(shown)) / 1000, (1.0, 2.0, 4.0))
    assert loud[0] < 0.05 * loud[2] < 0.05 * loud[1]
    shown = play(model, 0.3, lambda t: 50 * t, events=every(0.05, (), QuantityTrust.UNKNOWN), start_s=1.0)
    assert shown[-1].status == DisplayStatus.NO_TEXTURE and shown[-1].displacement_um == 0


def test_what_is_held_stays():
    model = LocalModel()
    play(model, 0.3, lambda t: 50 * t, events=every(0.05, (Component(1.0, 50.0),)))
    shown = play(model, 1.0, lambda t: 50 * t, events=every(0.05, (), QuantityTrust.HELD), start_s=0.3)
    assert shown[-1].status == DisplayStatus.OK and shown[-1].wavelength_mm == 1.0


@pytest.mark.parametrize("exponent, grows", [(0.0, 1.0), (0.5, 2.0), (1.0, 4.0)])
def test_the_amplitude_follows_the_hands_force_of_now(exponent, grows):
    """Felt at 0.25 N; the hand presses by 1 N after a second, and no further message says so."""
    model, greatest = LocalModel(force_exponent=exponent, safety=Safety(hold_s=5.0)), []
    for start, force in ((0.0, 0.25), (1.0, 1.0)):
        events = every(5.0, (Component(1.0, 20.0),), QuantityTrust.OK, 0.25) if start == 0 else None
        shown = play(model, 1.0, lambda t: 50 * t, events=events, force=lambda t, f=force: f, start_s=start)
        greatest.append(max(one.displacement_um for one in shown[500:]))
    assert greatest[0] == pytest.approx(20.0 * 0.238, rel=1e-2)
    assert greatest[1] == pytest.approx(grows * greatest[0], rel=1e-2)


def test_without_either_force_the_amplitude_is_the_sensors():
    for sensed, pressed in ((math.nan, 1.0), (0.25, math.nan)):
        model = LocalModel(force_exponent=1.0)
        events = every(0.05, (Component(1.0, 20.0),), QuantityTrust.OK, sensed)
        shown = play(model, 1.0, lambda t: 50 * t, events=events, force=lambda t, f=pressed: f)
        assert max(one.displacement_um for one in shown[500:]) == pytest.approx(20.0 * 0.238, rel=1e-2)


@pytest.mark.parametrize(
    "make, said",
    [
        (lambda: LocalModel(components=0), "components"),
        (lambda: LocalModel(force_exponent=-1.0), "force_exponent"),
        (lambda: LocalModel(rate_Hz=500), "rate_Hz"),
        (lambda: Actuator("x", -1, 100), "stroke_um"),
        (lambda: Safety(hold_s=0), "hold_s"),
        (lambda: Safety(force_release_N=3.0), "force_release_N"),
    ],
)
def test_unusable_values_are_refused(make, said):
    with pytest.raises(InputError, match=said):
        make()
