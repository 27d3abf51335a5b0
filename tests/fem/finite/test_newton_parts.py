"""Limits of Newton's method, on both sides: how far a step is shortened, and how long a compliance is kept."""

from types import SimpleNamespace

import numpy as np
import pytest

from papilla.fem.finite.newton import State, StepError, _right_side_out
from papilla.fem.finite.touching import Touching


def stepped(smallest, before=1.0):
    """The step from rest to a displacement of 1 on a body whose smallest det F is a function of the displacement."""
    zero = np.zeros((1, 3))
    rest = State(zero, np.zeros(1), np.zeros(1), np.zeros(1, bool), 0.0)
    wanted = State(zero + 1, np.ones(1), np.full(1, 2.0), np.ones(1, bool), 4.0)
    body = SimpleNamespace(forces=lambda u, p: SimpleNamespace(smallest_jacobian=smallest(float(u[0, 0]))))
    return _right_side_out(body, rest, wanted, SimpleNamespace(smallest_jacobian=before))


@pytest.mark.parametrize("share, whole", [(0.101, True), (0.099, False)])
def test_a_step_leaves_a_tenth_of_the_smallest_volume(share, whole):
    state, after, complete = stepped(lambda u: 0.5 * (share if u == 1 else 1.0), before=0.5)
    assert complete == whole and state.indentation == (4.0 if whole else 2.0)
    assert state.contact == [2.0 if whole else 1.0] and state.pressure == [1.0 if whole else 0.5]
    assert state.active.all() and after.smallest_jacobian == 0.5 * (share if whole else 1.0)


def test_a_step_is_halved_five_times_at_most():
    assert stepped(lambda u: 1.0 if u <= 1 / 32 else -1.0)[0].indentation == 4 / 32
    with pytest.raises(StepError, match="a cell would turn inside out"):
        stepped(lambda u: 1.0 if u <= 1 / 64 else -1.0)


@pytest.fixture
def follow(monkeypatch):
    """Function: whether the compliance is renewed where the skin has moved along x (mm), edges being 0.5 mm long."""
    patch = SimpleNamespace(xy=np.zeros((2, 2)), edge_length=np.array([0.4, 0.6]))
    monkeypatch.setattr(Touching, "_compliance_at", lambda self, current: None)
    monkeypatch.setattr(
        Touching, "current_patch", lambda self, moved: SimpleNamespace(xy=np.array([[moved, 0], [0, 0]]))
    )

    def renewed(*moves, friction=0.0, residual=0.0):
        touching = Touching(SimpleNamespace(patch=patch), None, friction)
        return [touching.follow(move, residual) for move in moves]

    return renewed


def test_a_compliance_is_renewed_where_the_skin_has_moved(follow):
    assert follow(0.0, 1e-9, 1e-9, 2e-9) == [False, True, False, True]


@pytest.mark.parametrize("residual, renewed", [(1 / 29.9, False), (1 / 30.1, True)])
def test_far_from_equilibrium_it_is_renewed_for_large_movements_alone(follow, residual, renewed):
    """30 times the residual, as a share of the movement so far."""
    assert follow(1.0, residual=residual) == [renewed]


@pytest.mark.parametrize("moved, renewed", [(0.0099, False), (0.0101, True)])
def test_with_friction_it_is_renewed_after_a_fiftieth_of_an_edge(follow, moved, renewed):
    assert follow(moved, friction=0.3) == [renewed]
