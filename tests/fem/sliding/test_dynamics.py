"""One mode with inertia against an integration of its equation, and the choice of the dynamics by frequencies."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from papilla import Grating
from papilla.fem import Motion
from papilla.fem.sliding.dynamics import Modal, loss_factors
from papilla.fem.sliding.section import Modes
from papilla.fem.sliding.slide import choose_dynamics, highest_frequency
from papilla.model.textures import Flat, MeasuredProfile

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
        assert [choose_dynamics(asked, highest, 100.0)[0] for asked in ("modal", "quasi-static")] == [
            "modal", "quasi-static"
        ]  # fmt: skip


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
