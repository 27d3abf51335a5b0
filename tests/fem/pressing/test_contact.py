"""Unilateral contact against Hertz, bonded layers and an independent solver of the same complementarity problem."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import nnls
from scipy.special import jv

from papilla.core.errors import SolverError
from papilla.fem.pressing.contact import contact_shape, loading_path
from papilla.fem.pressing.contact_path import ContactPath, ContactProblem, LeavingError
from papilla.fem.pressing.contact_step import contact_step, first_touch
from papilla.fem.pressing.ellipses import HALF_SPACE_ENERGY
from papilla.fem.reduction.compliance import half_space_compliance
from papilla.model.specimen import Block, HalfSpace, Sphere
from papilla.references import hertz_ellipse, hertz_sphere

RADIUS, E_STAR = 10.0, 0.2


def paraboloid(x, y):
    return (x**2 + y**2) / (2 * RADIUS)


def solved(compliance, mass, gap, **load):
    """The contact without friction, found in one step from first touch."""
    problem = ContactProblem(compliance, mass, gap)
    return contact_step(problem, first_touch(problem), **load)


def random_problem(seed, n=30):
    """Compliance, mass and gap of a random problem, the first positive definite and anything but diagonal."""
    random = np.random.default_rng(seed)
    factor = random.standard_normal((n, n))
    compliance = factor @ factor.T + 10.0 ** random.uniform(-3, 1) * np.eye(n)
    return compliance, random.uniform(0.5, 2, n), random.uniform(0, 1, n)


def test_hertz_is_approached_as_the_patch_is_refined(disc):
    """Rings are hit and missed in turn, so errors are root mean squares over ten radii: caps, and orders in h."""
    found = []
    for rings in (8, 24):
        patch = disc(4.0, rings, paraboloid)
        compliance = half_space_compliance(patch)
        errors = []
        for radius in np.linspace(1.6, 3.2, 10):
            exact = hertz_sphere(4 * radius**3 / (3 * RADIUS), RADIUS, 1.0)
            contact_ = solved(compliance, patch.mass, patch.gap, force=exact.force / 4)
            shape = contact_shape(patch, contact_.traction[0])
            difference = contact_.traction[0] - exact.pressure(*patch.xy.T)
            spread = np.sqrt(4 * patch.mass @ difference**2 / exact.area) / exact.peak_pressure
            errors.append([contact_.indentation / exact.indentation - 1, shape.area / exact.area - 1, spread])
        found.append(np.sqrt(np.square(errors).mean(axis=0)))
    order = np.log(found[0] / found[1]) / np.log(3)
    assert (found[1] < [0.001, 0.01, 0.05]).all()
    # The square root at the edge of Hertz's pressure allows no more than one for the pressure itself
    assert (order > [1.4, 1.0, 0.6]).all()


@pytest.mark.parametrize("seed", range(40))
def test_random_problems_against_nonnegative_least_squares(seed):
    """p minimises p A p / 2 - p (delta m - g) over p >= 0: nnls on the Cholesky factor of A."""
    compliance, mass, gap = random_problem(seed)
    depth = 0.6
    lower = np.linalg.cholesky(compliance)
    expected, _ = nnls(lower.T, np.linalg.solve(lower, depth * mass - gap))
    found = solved(compliance, mass, gap, indentation=depth)
    assert found.traction[0] == pytest.approx(expected, rel=1e-7, abs=1e-9 * expected.max())
    assert 0 < found.active.sum() < len(mass), "neither all nor nothing is in contact"
    by_force = solved(compliance, mass, gap, force=mass @ expected)
    assert by_force.indentation == pytest.approx(depth, rel=1e-9)
    assert by_force.traction[0] == pytest.approx(expected, rel=1e-7, abs=1e-9 * expected.max())


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


@pytest.mark.parametrize("angle", [0.0, 30.0, 45.0, -70.0])
def test_an_ellipse_off_the_middle_and_turned(disc, angle):
    """Off-centre contact: no plane of symmetry, and the middle is not where the specimen touched down."""
    exact, turn = hertz_ellipse(1.5, 6.0, 14.0, 1.0), np.radians(angle)

    def gap(x, y):
        x, y = x - 0.5, y + 0.3
        along, across = np.cos(turn) * x + np.sin(turn) * y, -np.sin(turn) * x + np.cos(turn) * y
        return along**2 / 12 + across**2 / 28

    patch = disc(3.5, 14, gap, quarter=False)
    shape = contact_shape(patch, solved(half_space_compliance(patch), patch.mass, patch.gap, force=1.5).traction[0])
    assert shape.elliptic
    assert shape.area == pytest.approx(exact.area, rel=0.03)
    assert shape.peak_pressure == pytest.approx(exact.peak_pressure, rel=0.03)


@pytest.mark.parametrize("q", [-0.8, -0.3, 0.4, 0.7])
def test_the_layer_term_is_recovered(disc, q):
    """F/(pi a b) [(1 - q) 3/2 t + q 5/2 t^3], t = sqrt(1 - r^2/a^2): flatter or more pointed than Hertz's."""

    def profile(t):
        return 0.1 * ((1 - q) * 1.5 * t + q * 2.5 * t**3)

    patch = disc(4.0, 30)
    shape = contact_shape(patch, profile(np.sqrt(np.maximum(0, 1 - (patch.xy**2).sum(axis=1) / 9))))
    assert shape.elliptic
    assert shape.area == pytest.approx(np.pi * 9, rel=0.02)
    assert shape.peak_pressure == pytest.approx(profile(np.linspace(0, 1, 100_001)).max(), rel=0.02)


@pytest.mark.parametrize("half_length", [2.0, 3.0])
def test_a_line_contact_is_no_ellipse_though_its_low_moments_are(disc, half_length):
    """Hertz's line contact of a slab, 2 mm wide: the ellipse of the same moments is a third too large."""
    patch = disc(4.0, 24)
    x, y = patch.xy.T
    pressure = np.sqrt(np.maximum(0, 1 - x**2)) * (np.abs(y) < half_length)
    shape = contact_shape(patch, pressure)
    assert not shape.elliptic
    assert shape.area == pytest.approx(4 * half_length, rel=0.05)
    assert shape.peak_pressure == 1


def test_energy_on_a_half_space():
    """Integrals of the terms' Hankel transforms, (J_m(x) / x^m) with unit value at x = 0."""

    def transform(m, x):
        return [3.0, 15.0][m] * np.sqrt(np.pi / 2) * jv(m + 1.5, x) / x ** (m + 1.5)

    energy = [
        quad(lambda x, m=m, n=n: transform(m, x) * transform(n, x), 0, 200, limit=500)[0]
        for m, n in [(0, 0), (0, 1), (1, 1)]
    ]
    assert np.divide(energy, energy[0]) == pytest.approx(HALF_SPACE_ENERGY, rel=1e-5)
