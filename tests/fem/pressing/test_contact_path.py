"""The path of a growing contact, against single presses; without friction here, stuck in test_friction."""

import math

import numpy as np
import pytest

from papilla.core.errors import SolverError
from papilla.fem import FingerModel
from papilla.fem.pressing.contact import LoadingPath, loading_path
from papilla.fem.pressing.contact_path import ContactPath, ContactProblem, LeavingError
from papilla.fem.pressing.contact_step import contact_step, first_touch
from papilla.mesh import build
from papilla.model.finger import Finger
from papilla.model.specimen import Block, HalfSpace, Sphere

SPECIMENS = [Block(0.02, 10), Block(0.51, 10), Block(1e4, 3), HalfSpace(0.3), Sphere(1.0, 20.0), Sphere(1e5, 4.0)]


def check_against_single_presses(path, forces, rel=1e-10):
    problem = path.problem
    for force in forces:
        single = contact_step(problem, first_touch(problem), force=force)
        state = path.at(force=force)
        assert state.indentation == pytest.approx(single.indentation, rel=rel)
        assert state.traction[0] == pytest.approx(single.traction[0], abs=10 * rel * single.traction[0].max())
        assert state.force == pytest.approx(force, rel=1e-9) and (state.active == single.active).all()


@pytest.mark.parametrize("specimen", SPECIMENS, ids=repr)
def test_every_force_is_the_single_press(reference, specimen):
    check_against_single_presses(
        loading_path(reference, specimen, 0.0), np.geomspace(1e-4, 1.0, 40) / reference.multiplicity
    )


def test_force_and_depth_rise_and_are_two_ways_to_one_state(reference):
    path = loading_path(reference, Block(0.3, 10), 0.0)
    by_force = path.at(force=0.2)
    whole = path.whole
    assert (np.diff(whole.depth) >= 0).all() and (np.diff(whole.force) >= 0).all()
    assert len(set(whole.nodes)) == len(whole.nodes) > by_force.active.sum()
    by_depth = path.at(indentation=by_force.indentation)
    assert by_depth.force == pytest.approx(0.2, rel=1e-12)
    assert by_depth.traction == pytest.approx(by_force.traction, abs=1e-12 * by_force.traction.max())
    assert path.at(indentation=-1e-3) is None and path.at(force=0.0) is None


@pytest.mark.slow
def test_nodes_that_touch_at_once_are_taken_one_by_one():
    """A whole patch has mirror nodes: they touch together, but for rounding."""
    whole = FingerModel(Finger.default(), build(Finger.default(), size_mm=2.8)).reduce((1e-9, 0.0))
    check_against_single_presses(loading_path(whole, Block(0.3, 10), 0.0), (0.01, 0.1, 0.8), rel=1e-9)


def test_all_gaps_equal_is_a_flat_punch():
    rng = np.random.default_rng(2)
    root = rng.normal(size=(12, 12))
    mass, compliance = rng.uniform(0.5, 1.0, 12), root @ root.T + 30 * np.eye(12)
    path = ContactPath(ContactProblem(compliance, mass, 0.25 * mass))
    check_against_single_presses(path, [5.0])
    assert path.depth == pytest.approx(0.25)


@pytest.mark.parametrize("seed", range(20))
def test_where_nodes_leave_again_it_says_so_and_never_errs(seed):
    """Random stiff problems, where pressure moves about: nodes come and go."""
    rng = np.random.default_rng(seed)
    n = 15
    root = rng.normal(size=(n, n))
    compliance, mass = root @ root.T + 0.5 * np.eye(n), rng.uniform(0.5, 1.5, n)
    path = ContactPath(ContactProblem(compliance, mass, mass * rng.exponential(size=n)))
    answered = 0
    for force in np.linspace(0.01, 2.0, 25):
        try:
            check_against_single_presses(path, [force], rel=1e-8)
        except LeavingError:
            continue
        answered += 1
    assert answered > 0


def test_a_compliance_that_is_not_positive_is_refused():
    compliance = np.array([[1.0, -2.0], [-2.0, 1.0]])
    with pytest.raises(SolverError, match="not positive"):
        ContactPath(ContactProblem(compliance, np.ones(2), np.array([0.0, 1.0]))).at(force=10.0)


@pytest.mark.parametrize("stuck", [False, True])
def test_another_order_to_begin_with_changes_nothing(reference, stuck):
    """A guess from another specimen, from none, and from a path that is worthless."""
    path = loading_path(reference, Block(0.2, 10), math.inf) if stuck else loading_path(reference, Block(0.2, 10), 0.0)
    problem, expected = path.problem, path.at(force=0.1)
    backwards = ContactPath(ContactProblem(problem.compliance[: len(problem.mass), : len(problem.mass)],
                                             problem.mass, problem.gap.max() - problem.gap))  # fmt: skip
    for guess in (None, loading_path(reference, Sphere(5.0, 8.0), 0.0).whole, backwards):
        path = LoadingPath(problem, math.inf if stuck else 0.0, guess)
        # Without friction no order makes a node leave, so the path itself answers, not its steps
        other = (path if stuck else path.whole).at(force=0.1)
        assert other.indentation == pytest.approx(expected.indentation, rel=1e-12)
        assert other.traction == pytest.approx(expected.traction, abs=1e-11 * expected.traction.max())
