"""Sliding scenes: what symmetry, periodicity and laws of friction say of them, refinement, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest

from papilla import Grating
from papilla.core.errors import ContactRangeError, InputError
from papilla.fem import Motion, slide
from papilla.fem.sliding.coulomb import STICKING_NODE
from papilla.fem.sliding.slide import amplify
from papilla.model.textures import Flat, MeasuredProfile

GRATING = Grating(0.9, 0.9, 0.3)
SLOW = {"force": 0.1, "length_mm": 5.0, "dynamics": "quasi-static"}


def steady(speed, millimetres, rate=1000.0):
    return Motion.steady(speed, millimetres / abs(speed), rate)


def test_a_flat_gives_a_constant_signal(finger, coarse):
    found = slide(finger, Flat(), steady(50.0, 10.0), section=coarse, friction=0.4, **SLOW)
    late = found.readings[100:]
    assert np.ptp(late, axis=0).max() < 1e-6 * np.abs(late).max()
    assert found.status == "ok"
    np.testing.assert_allclose(found.force_N, 0.1, rtol=1e-9)
    np.testing.assert_allclose(found.tangential_N[found.sliding], 0.04, rtol=1e-9)


@pytest.mark.parametrize("friction", [0.0, 0.5, 1.5])
def test_a_period_further_everything_is_as_before(finger, coarse, friction):
    found = slide(finger, GRATING, steady(36.0, 18.0), section=coarse, friction=friction, **SLOW)
    period = round(1.8 / 36.0 * 1000)
    last, before = found.readings[-period:], found.readings[-2 * period : -period]
    assert np.abs(last - before).max() < 2e-3 * np.ptp(last, axis=0).max()
    assert found.unresolved == 0


def test_reversed_motion_mirrors_the_signal(finger, coarse):
    there = slide(finger, GRATING, steady(40.0, 8.0), section=coarse, friction=0.5, **SLOW)
    back = slide(finger, GRATING, steady(-40.0, 8.0), section=coarse, friction=0.5, **SLOW)
    scale = np.abs(there.readings).max()
    np.testing.assert_allclose(back.readings[:, ::-1], there.readings, atol=1e-6 * scale)
    np.testing.assert_allclose(back.tangential_N, -there.tangential_N, atol=1e-9)


def test_full_slip_pulls_with_mu_times_the_force_and_stick_with_less(finger, coarse):
    found = slide(finger, GRATING, steady(40.0, 8.0), section=coarse, friction=0.7, **SLOW)
    ratio = found.tangential_N / found.force_N
    np.testing.assert_allclose(ratio[found.sliding], 0.7, rtol=1e-9)
    stuck = (found.state == STICKING_NODE).any(axis=1)
    assert stuck[0]
    assert (ratio[stuck] < 0.7 * (1 - 1e-6)).all()


def test_a_finger_that_turns_back_sticks_on_the_way(finger, coarse):
    t = np.linspace(0, 0.4, 401)
    found = slide(
        finger, GRATING, Motion.sampled(t, 4 * np.sin(2 * np.pi * 2.5 * t)), section=coarse, friction=0.5, **SLOW
    )
    assert found.tangential_N.min() == pytest.approx(-0.05, rel=1e-9)
    assert found.tangential_N.max() == pytest.approx(0.05, rel=1e-9)
    turned = slice(100, 110)
    assert (found.state[turned] == STICKING_NODE).any()


def test_lift_off_and_landing_on_a_step(finger, coarse):
    """A plateau with an edge: the finger leaves it, hangs free at its depth, and lands again."""
    x = np.arange(-20.0, 40.01, 0.1)
    profile = MeasuredProfile(x, np.where((x > 0) & (x < 20), 0.0, 2.0))
    found = slide(
        finger, profile, Motion.sampled([0, 0.7], [-8.0, 28.0]), section=coarse, depth=0.3, length_mm=5.0, friction=0.3,
        dynamics="quasi-static",
    )  # fmt: skip
    free = found.force_N == 0
    assert free.any()
    assert not free[0]
    assert not free[-1]
    assert not found.readings[free].any()
    assert found.unresolved == 0


@pytest.mark.parametrize("friction", [0.0, 0.4])
def test_the_signal_settles_as_steps_shrink(finger, coarse, friction):
    """At first order at least: slip counts over the whole of a step, and a node touches from the end of one. A step is
    a sample where samples are close."""
    wavy = Grating(0.9, 0.9, 0.05, form="sine")

    def signal(finer):
        motion = steady(18.0, 3.6, 400.0 * finer)
        return slide(finger, wavy, motion, section=coarse, friction=friction, **SLOW).readings[:: 8 * finer]

    exact = signal(32)
    errors = [np.sqrt(np.mean((signal(finer) - exact) ** 2)) for finer in (1, 2, 4)]
    assert errors[0] > 1.5 * errors[1] > 1.5**2 * errors[2]
    assert errors[1] < 0.01 * exact.std(axis=0).max()


def test_inertia_closes_its_energy_and_vanishes_when_slow(finger, coarse):
    fast = slide(finger, GRATING, steady(120.0, 12.0), section=coarse, friction=0.3, force=0.1, length_mm=5.0)
    assert fast.dynamics == "modal"
    assert "more than 0.3 of the first mode" in fast.why
    assert fast.energy_error < 0.01
    slowly = steady(2.0, 0.6)
    still, moving = (
        slide(finger, Flat(), slowly, section=coarse, force=0.1, length_mm=5.0, dynamics=dynamics)
        for dynamics in ("quasi-static", "modal")
    )
    np.testing.assert_allclose(moving.readings, still.readings, atol=1e-5 * np.abs(still.readings).max())
    auto = slide(finger, GRATING, slowly, section=coarse, force=0.1, length_mm=5.0)
    assert auto.dynamics == "quasi-static"


@pytest.mark.parametrize(
    "changed, error, message",
    [
        ({"force": None}, InputError, "exactly one of force and depth"),
        ({"force": 0.0}, InputError, r"force \(N\) must be greater than 0"),
        ({"force": None, "depth": 1001.0}, InputError, r"press depth \(mm\) must lie between 0 and 1000"),
        ({"force": None, "depth": -0.1}, InputError, r"press depth \(mm\) must lie between 0 and 1000"),
        ({"friction": -0.1}, InputError, "friction must lie between 0 and 3"),
        ({"friction": 4.0}, InputError, "friction must lie between 0 and 3"),
        ({"dynamics": "fast"}, InputError, "dynamics must be one of auto, quasi-static, modal"),
        ({"force": 500.0}, ContactRangeError, "reaches the end of its patch"),
    ],
)
def test_bad_scenes_are_refused_in_one_line(finger, coarse, changed, error, message):
    with pytest.raises(error, match=message):
        slide(finger, GRATING, steady(10.0, 0.1), section=coarse, **{**SLOW, **changed})


def test_a_grating_finer_than_the_elements_is_refused(finger, coarse):
    with pytest.raises(InputError, match="wavelength 0.2 mm is not resolved by the skin's elements of 0.15 mm"):
        slide(finger, Grating(0.1, 0.1, 0.5), steady(10.0, 0.1), section=coarse, **SLOW)


def test_a_slide_that_sticks_or_has_the_section_of_another_finger_is_refused(finger, coarse):
    scene = {"force": 0.1, "length_mm": 5.0, "section": coarse}
    with pytest.raises(InputError, match="a finger that slides does not stick: friction must be between 0 and 3"):
        slide(finger, GRATING, steady(80.0, 8.0), friction="stick", **scene)
    with pytest.raises(InputError, match="section is of another finger: it has 5 gauges, the finger 2"):
        slide(replace(finger, gauges=finger.gauges[:2]), GRATING, steady(80.0, 8.0), **scene)


def test_the_amplifier_passes_up_to_four_tenths_of_the_rate():
    """Half of the amplitude is left there; a little below nearly all, a little above nearly nothing."""
    t = np.arange(16_000) / 4000.0
    for share, left in ((0.40, 0.5), (0.36, 1.0), (0.44, 0.0)):
        heard = amplify(np.sin(2 * np.pi * share * 1000 * t)[:, None], 4)[200:-200, 0]
        assert np.sqrt(2 * np.mean(heard**2)) == pytest.approx(left, abs=0.04)
    signal = np.arange(6.0)[:, None]
    assert amplify(signal, 1) is signal
