"""The path of a growing contact, against single presses; without friction here, stuck in test_friction."""

import numpy as np
import pytest

from papilla.core.errors import SolverError
from papilla.fem.pressing.contact import loading_path
from papilla.fem.pressing.contact_path import ContactPath, ContactProblem, LeavingError
from papilla.fem.pressing.contact_step import contact_step, first_touch
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
