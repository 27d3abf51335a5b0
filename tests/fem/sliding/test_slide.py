"""Sliding scenes: what symmetry, periodicity and laws of friction say of them, refinement, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from papilla import Grating
from papilla.core.errors import ContactRangeError, InputError
from papilla.fem import Motion, prepare, press, slide
from papilla.fem.sliding.coulomb import STICKING_NODE
from papilla.fem.sliding.dynamics import Modal, loss_factors
from papilla.fem.sliding.section import Modes
from papilla.fem.sliding.slide import amplify, choose_dynamics, highest_frequency
from papilla.fem.sliding.tying import RIGID_FLAT
from papilla.model.textures import Flat, MeasuredProfile

GRATING = Grating(0.9, 0.9, 0.3)
SLOW = {"force": 0.1, "length_mm": 5.0, "dynamics": "quasi-static"}


def steady(speed, millimetres, rate=1000.0):
    return Motion.steady(speed, millimetres / abs(speed), rate)


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
    ratio, stuck = there.tangential_N / there.force_N, (there.state == STICKING_NODE).any(axis=1)
    np.testing.assert_allclose(ratio[there.sliding], 0.5, rtol=1e-9)
    assert stuck[0] and (ratio[stuck] < 0.5 * (1 - 1e-6)).all()
    scale = np.abs(there.readings).max()
    np.testing.assert_allclose(back.readings[:, ::-1], there.readings, atol=1e-6 * scale)
    np.testing.assert_allclose(back.tangential_N, -there.tangential_N, atol=1e-9)


def test_a_finger_that_turns_back_sticks_on_the_way(finger, coarse):
    t = np.linspace(0, 0.4, 401)
    motion = Motion.sampled(t, 4 * np.sin(2 * np.pi * 2.5 * t))
    found = slide(finger, GRATING, motion, section=coarse, friction=0.5, **SLOW)
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
    assert free.any() and not free[0] and not free[-1]
    assert not found.readings[free].any() and found.unresolved == 0


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
        ({"force": None, "depth": -0.1}, InputError, r"press depth \(mm\) must lie between 0 and 1000"),
        ({"friction": -0.1}, InputError, "friction must lie between 0 and 3"),
        ({"friction": "stick"}, InputError, "a finger that slides does not stick: friction must be between 0 and 3"),
        ({"dynamics": "fast"}, InputError, "dynamics must be one of auto, quasi-static, modal"),
        ({"force": 500.0}, ContactRangeError, "reaches the end of its patch"),
    ],
)
def test_bad_scenes_are_refused_in_one_line(finger, coarse, changed, error, message):
    with pytest.raises(error, match=message):
        slide(finger, GRATING, steady(10.0, 0.1), section=coarse, **{**SLOW, **changed})
    with pytest.raises(InputError, match="section is of another finger: it has 5 gauges, the finger 2"):
        slide(replace(finger, gauges=finger.gauges[:2]), GRATING, steady(10.0, 0.1), section=coarse, **SLOW)


def test_the_amplifier_passes_up_to_four_tenths_of_the_rate():
    """Half of the amplitude is left there; a little below nearly all, a little above nearly nothing."""
    t = np.arange(16_000) / 4000.0
    for share, left in ((0.40, 0.5), (0.36, 1.0), (0.44, 0.0)):
        heard = amplify(np.sin(2 * np.pi * share * 1000 * t)[:, None], 4)[200:-200, 0]
        assert np.sqrt(2 * np.mean(heard**2)) == pytest.approx(left, abs=0.04)
    signal = np.arange(6.0)[:, None]
    assert amplify(signal, 1) is signal


STILL = Motion.steady(0.0, 0.01)


@pytest.mark.parametrize("load, friction", [({"force": 0.3}, None), ({"indentation": 0.4}, 0.3)])
def test_at_rest_it_is_a_press(finger, coarse, load, friction):
    """What `papilla.fem.press` says of the same scene, whatever the load and the friction are told as."""
    true = press(prepare(finger), RIGID_FLAT, friction=friction, **load)
    held = {"force": load.get("force"), "depth": load.get("indentation")}
    found = slide(finger, Flat(), STILL, section=coarse, friction=friction, dynamics="quasi-static", **held)
    np.testing.assert_allclose(found.readings, np.broadcast_to(true.reading, found.readings.shape), rtol=1e-6)
    np.testing.assert_allclose(found.depth_mm, true.indentation, rtol=1e-6)
    np.testing.assert_allclose(found.force_N, true.force, rtol=1e-6)
    assert found.tied.press.friction == true.friction
    assert found.friction == (friction or 0.0)


OMEGA, LOSS, STEP = 300.0, 0.2, 1e-4
PATCH, ROWS, MODE_ROWS = np.array([[0.7], [-0.3]]), np.array([[5.0, 1.0]]), np.array([[40.0]])
COMPLIANCE = np.array([[2e-5, 3e-6], [3e-6, 1e-5]])


def test_a_mode_follows_its_equation_under_forces_that_are_linear_in_each_step():
    """q'' + eta w q' + w^2 q = phi . f; the rest of the compliance answers at once."""
    turns = np.arange(41) / 40
    forces = np.column_stack([2 + np.sin(9 * turns), turns * np.cos(5 * turns)])
    modes = Modes(np.array([OMEGA]), PATCH, np.zeros((2, 1, 1)))
    inertia = Modal(modes, COMPLIANCE, ROWS, MODE_ROWS, STEP, np.array([LOSS]), forces[0])
    loads = (forces @ PATCH)[:, 0]

    def equation(t, state):
        load = np.interp(t, STEP * np.arange(41), loads)
        return [state[1], load - LOSS * OMEGA * state[1] - OMEGA**2 * state[0], LOSS * OMEGA * state[1] ** 2]

    state = np.array([loads[0] / OMEGA**2, 0.0, 0.0])
    rest = COMPLIANCE - PATCH @ PATCH.T / OMEGA**2
    assert inertia.readings(forces[0]) == pytest.approx(ROWS @ forces[0]), "at rest it is the compliance alone"
    for step in range(1, 41):
        ends = (STEP * (step - 1), STEP * step)
        state = solve_ivp(equation, ends, state, rtol=1e-10, atol=1e-16, max_step=STEP / 5).y[:, -1]
        moved = inertia.free() + inertia.compliance @ forces[step]
        assert moved == pytest.approx(rest @ forces[step] + PATCH[:, 0] * state[0], rel=1e-6)
        inertia.accept(forces[step])
        assert inertia.state[0] == pytest.approx(state[:2], rel=1e-6)
        quick = (ROWS - MODE_ROWS @ PATCH.T / OMEGA**2) @ forces[step]
        assert inertia.readings(forces[step]) == pytest.approx(quick + MODE_ROWS[0] * state[0], rel=1e-6)
    assert inertia.lost == pytest.approx(state[2], rel=0.02)
    elastic = forces[-1] @ rest @ forces[-1] + OMEGA**2 * state[0] ** 2 + state[1] ** 2
    assert inertia.energy(forces[-1]) == pytest.approx(elastic / 2, rel=1e-6)


PROFILE = MeasuredProfile(np.linspace(-9, 9, 91), np.zeros(91))


@pytest.mark.parametrize(
    "texture, pitch, shortest",
    [(Grating(1.0, 1.0, 0.1), 0.0, 2.0), (Grating(1.0, 1.0, 0.1), 1.5, 1.5), (Flat(), 1.5, 1.5), (Flat(), 0.0, 0.4),
     (PROFILE, 1.5, 0.4), (PROFILE, 0.3, 0.3)],
)  # fmt: skip
def test_the_highest_frequency_is_of_the_shortest_period_that_is_felt(texture, pitch, shortest):
    assert highest_frequency(texture, Motion.steady(-60.0, 0.1), pitch) == pytest.approx(60.0 / shortest)


def test_inertia_is_included_above_three_tenths_of_the_first_mode():
    for highest, dynamics in ((30.1, "modal"), (29.9, "quasi-static")):
        chosen, why = choose_dynamics("auto", highest, 100.0)
        assert chosen == dynamics and f"the scene reaches {highest:g} Hz" in why and "0.3 of the first mode" in why
        assert ("more" in why) == (dynamics == "modal")
    assert choose_dynamics("modal", 1.0, 100.0)[0] == "modal"


def test_a_relaxation_tells_the_loss_of_modes_at_most_ten_times_faster(relaxing):
    """E'' / E' of one Maxwell term with share g and time tau, at turns w tau."""
    omega = np.array([100.0, 300.0])
    for tau, told in ((0.099, True), (0.101, False)):
        found, origin = loss_factors(None, relaxing((1e-9, 0.3), (5.0, tau)), omega)
        turns = omega * tau
        exact = 0.3 * turns / (1 + turns**2) / (1 - 0.3 / (1 + turns**2))
        assert found == pytest.approx(exact if told else [0.1, 0.1])
        assert ("identified relaxation of 0.101 s is 10 times slower than the first mode" in origin) != told
    for identified in (None, relaxing((), ())):
        found, origin = loss_factors(None, identified, omega)
        assert found.tolist() == [0.1, 0.1] and origin.endswith("the finger has no identified relaxation")
    assert loss_factors(0.7, None, omega)[0].tolist() == [0.7, 0.7]
