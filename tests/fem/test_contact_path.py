"""The path of a frictionless contact, against single presses."""

import numpy as np
import pytest

from papilla.errors import ContactRangeError, SolverError
from papilla.fem import FingerModel
from papilla.fem.pressing.contact import solve_contact
from papilla.fem.pressing.contact_path import contact_path
from papilla.fem.reduction.compliance import weak_gap
from papilla.finger import Finger
from papilla.mesh import build
from papilla.specimen import Block, HalfSpace, Sphere

SPECIMENS = [Block(0.02, 10), Block(0.51, 10), Block(1e4, 3), HalfSpace(0.3), Sphere(1.0, 20.0), Sphere(1e5, 4.0)]


def problem(reduced, specimen):
    return reduced.total_compliance(specimen), reduced.patch.mass, weak_gap(reduced.patch, specimen)


@pytest.mark.parametrize("specimen", SPECIMENS, ids=repr)
def test_every_force_is_the_single_press(reference, specimen):
    given, top = problem(reference, specimen), 1.0 / reference.multiplicity
    path = contact_path(*given, top)
    forces = np.geomspace(1e-4, 1.0, 40) * top
    depth, pressure = path.at(forces)
    for k, force in enumerate(forces):
        single = solve_contact(*given, force=force)
        assert depth[k] == pytest.approx(single.indentation, rel=1e-10)
        assert pressure[k] == pytest.approx(single.pressure, abs=1e-10 * single.pressure.max())


def test_the_path_rises_and_keeps_the_force(reference):
    given = problem(reference, Block(0.3, 10))
    path = contact_path(*given, 0.2)
    assert (np.diff(path.indentation) >= 0).all() and (np.diff(path.force) >= 0).all() and (path.pressure >= 0).all()
    assert path.pressure @ reference.patch.mass == pytest.approx(path.force, abs=1e-12)
    assert path.force[-1] == pytest.approx(0.2) and path.at(0.2)[0] == pytest.approx(path.indentation[-1])
    with pytest.raises(ContactRangeError, match=r"the path ends at 0.2 N on the patch, asked 0.3 N"):
        path.at(0.3)


@pytest.mark.slow
def test_nodes_that_touch_at_once_are_taken_one_by_one():
    """A whole patch has mirror nodes: they touch together, but for rounding."""
    whole = FingerModel(Finger.default(), build(Finger.default(), size_mm=2.8)).reduce((1e-9, 0.0))
    given = problem(whole, Block(0.3, 10))
    path = contact_path(*given, 0.8)
    for force in (0.01, 0.1, 0.8):
        single = solve_contact(*given, force=force)
        assert path.at(force)[0] == pytest.approx(single.indentation, rel=1e-9)
        assert path.at(force)[1] == pytest.approx(single.pressure, abs=1e-8 * single.pressure.max())


def test_all_gaps_equal_is_a_flat_punch():
    rng = np.random.default_rng(2)
    root = rng.normal(size=(12, 12))
    mass, compliance = rng.uniform(0.5, 1.0, 12), root @ root.T + 30 * np.eye(12)
    path = contact_path(compliance, mass, 0.25 * mass, 5.0)
    single = solve_contact(compliance, mass, 0.25 * mass, force=5.0)
    assert path.indentation[0] == pytest.approx(0.25)
    assert path.at(5.0)[0] == pytest.approx(single.indentation)
    assert path.at(5.0)[1] == pytest.approx(single.pressure, abs=1e-10)


@pytest.mark.parametrize("seed", range(20))
def test_nodes_may_leave_again(seed):
    """Random stiff problems, where pressure moves about: nodes come and go."""
    rng = np.random.default_rng(seed)
    n = 15
    root = rng.normal(size=(n, n))
    compliance, mass = root @ root.T + 0.5 * np.eye(n), rng.uniform(0.5, 1.5, n)
    gap = mass * rng.exponential(size=n)
    path = contact_path(compliance, mass, gap, 2.0)
    for force in np.linspace(0.01, 2.0, 25):
        single = solve_contact(compliance, mass, gap, force=force)
        depth, pressure = path.at(force)
        assert depth == pytest.approx(single.indentation, rel=1e-8)
        assert pressure == pytest.approx(single.pressure, abs=1e-7 * single.pressure.max())


def test_a_compliance_that_is_not_positive_is_refused():
    with pytest.raises(SolverError, match="not positive"):
        contact_path(np.array([[1.0, -2.0], [-2.0, 1.0]]), np.ones(2), np.array([0.0, 1.0]), 10.0)
