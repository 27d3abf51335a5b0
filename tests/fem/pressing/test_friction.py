"""Contact with friction on condensed bodies: closed forms, a second method, and what must hold of any bodies."""

import math

import numpy as np
import pytest

from papilla.core.errors import SolverError
from papilla.fem.pressing.contact import LoadingPath
from papilla.fem.pressing.contact_path import ContactPath, ContactProblem
from papilla.fem.pressing.contact_step import contact_step, first_touch
from papilla.fem.reduction.compliance import PatchSurface
from papilla.fem.reduction.patch import quadrature
from papilla.model.specimen import HalfSpace
from papilla.references import dundurs_beta, effective_modulus, frictional_punch

RADIUS = 20.0
STICK = math.inf


def paraboloid(x, y):
    return (x * x + y * y) / (2 * RADIUS)


@pytest.fixture(scope="module")
def sphere(disc):
    """A patch under a paraboloid, for contacts of 2 mm radius."""
    return disc(3.0, 20, paraboloid)


def bodies_on(patch, specimen, finger=None) -> ContactProblem:
    """A specimen against a rigid finger, or against a half-space, which is turned over: its coupling changes sign."""
    n = len(patch.xy)
    compliance = specimen.traction_compliance(PatchSurface(patch))
    if finger is not None:
        turned = np.repeat([1.0, -1.0, -1.0], n)
        compliance = compliance + turned[:, None] * finger.traction_compliance(PatchSurface(patch)) * turned
    fixed = (patch.xy == 0).T if len(patch.images) == 4 else np.zeros((2, n), dtype=bool)
    return ContactProblem(compliance, patch.mass, patch.gap, fixed)


def shear_moment(patch, state):
    """int q r dA on the specimen, N mm."""
    points, weights, hats = quadrature(patch)
    return -len(patch.images) * float(weights @ ((hats @ state.traction[1:].T) * points).sum(axis=1))


def check_state(problem, state, friction):
    """Contact and Coulomb's law hold at every node."""
    gap = problem.moved(state.traction)[0] + problem.gap - state.indentation * problem.mass
    p, q = state.traction[0], np.hypot(*state.traction[1:])
    scale = np.abs(problem.gap).max() + state.indentation * problem.mass.max()
    assert p.min() >= 0 and gap.min() > -1e-9 * scale
    assert np.abs(gap[p > 0]).max() < 1e-9 * scale
    if math.isfinite(friction):
        assert (q <= friction * p * (1 + 1e-8) + 1e-12 * p.max()).all()


@pytest.mark.parametrize("friction", [STICK, *(pytest.param(mu, marks=pytest.mark.slow) for mu in (0.4, 0.2, 0.1))])
def test_flat_punch_is_mossakovskii_s_and_spence_s(disc, friction):
    """Against the frictionless punch on the same patch, whose edge is as coarse."""
    patch, nu = disc(1.0, 16), 0.3
    problem, n = bodies_on(patch, HalfSpace(1.0, nu)), len(patch.xy)
    smooth = ContactProblem(problem.compliance[:n, :n], problem.mass, problem.gap)
    plain = contact_step(smooth, first_touch(smooth), indentation=0.01)
    state = LoadingPath(problem, friction).at(indentation=0.01)
    expected = frictional_punch(dundurs_beta(1.0, nu), friction)
    assert state.force / plain.force == pytest.approx(expected.force_factor, rel=1.5e-3)
    check_state(problem, state, friction)


def test_dissimilar_half_spaces_feel_dundurs_beta_alone(disc):
    patch, one, other = disc(3.0, 16, paraboloid), (1.0, 0.1), (2.0, 0.45)
    expected = frictional_punch(dundurs_beta(*one, *other), 0.2)
    force, depth = expected.sphere(2.0, RADIUS, effective_modulus(*one, *other))
    state = LoadingPath(bodies_on(patch, HalfSpace(*one), HalfSpace(*other)), 0.2).at(indentation=depth)
    assert 4 * state.force == pytest.approx(force, rel=2e-3)
    assert shear_moment(patch, state) == pytest.approx(expected.shear_moment * 2.0 * force, rel=0.02)


@pytest.mark.parametrize("friction, nu", [(STICK, 0.0), (STICK, 0.3), (STICK, 0.45), (0.2, 0.3), (0.1, 0.3)])
def test_growing_sphere_is_mossakovskii_s_and_spence_s(sphere, friction, nu):
    patch = sphere
    expected = frictional_punch(dundurs_beta(1.0, nu), friction)
    force, depth = expected.sphere(2.0, RADIUS, effective_modulus(1.0, nu))
    problem = bodies_on(patch, HalfSpace(1.0, nu))
    state = LoadingPath(problem, friction).at(indentation=depth)
    assert 4 * state.force == pytest.approx(force, rel=1e-3)
    assert shear_moment(patch, state) == pytest.approx(expected.shear_moment * 2.0 * force, rel=5e-3)
    check_state(problem, state, friction)
    if friction < STICK:
        r, element = np.hypot(*patch.xy.T), 3.0 / 20
        assert r[state.active & ~state.slipping].max() < 2.0 * expected.stick_radius + element
        assert r[state.slipping].min() > 2.0 * expected.stick_radius - element


def gauss_seidel(problem, state, friction, depth, sweeps=20000):
    """The same step, node by node with projections: no linear system, no sets (Jean 1999,
    doi:10.1016/S0045-7825(98)00383-1)."""
    n = len(problem.mass)
    A, traction = problem.compliance.reshape(3, n, 3 * n), state.traction.copy()
    scale = problem.compliance.diagonal().reshape(3, n)
    for _ in range(sweeps):
        before = traction.copy()
        for i in range(n):
            gap = A[0, i] @ traction.ravel() + problem.gap[i] - depth * problem.mass[i]
            traction[0, i] = max(0.0, traction[0, i] - gap / scale[0, i])
            slip = A[1:, i] @ traction.ravel() - state.moved[1:, i]
            q = (traction[1:, i] - slip / scale[1:, i].max()) * ~problem.fixed[:, i]
            limit, size = friction * traction[0, i], math.hypot(*q)
            traction[1:, i] = q if size <= limit else q * (limit / size)
        if np.abs(traction - before).max() < 1e-13 * traction.max():
            return traction
    raise AssertionError("the second method did not converge")


@pytest.mark.parametrize("friction", [0.05, 0.3])
def test_steps_agree_with_gauss_seidel(disc, friction):
    """A specimen of nu 0 against a finger that is elliptic and stands askew: nothing is symmetric but the patch."""
    patch = disc(3.0, 3, lambda x, y: (1.5 * x * x + 0.8 * y * y + 0.6 * x * y) / 40, quarter=False)
    problem = bodies_on(patch, HalfSpace(1.0, 0.0))
    state = first_touch(problem)
    for depth in (0.03, 0.08, 0.15):
        expected = gauss_seidel(problem, state, friction, depth)
        state = contact_step(problem, state, friction, indentation=depth)
        assert state.traction == pytest.approx(expected, abs=1e-9 * expected.max())
        check_state(problem, state, friction)
    assert state.slipping.sum() > 0


@pytest.mark.parametrize("seed", range(6))
def test_a_stuck_path_does_not_depend_on_its_first_order_of_nodes(sphere, seed):
    """Two bodies, given apart or as their sum; the order is guessed from the path of a skin with other curvatures."""
    rng = np.random.default_rng(seed)
    both = bodies_on(sphere, HalfSpace(1.0, 0.3))
    bodies, modulus = (rng.uniform(0.3, 3.0), rng.uniform(0.3, 3.0)), rng.uniform(0.1, 10.0)
    theirs = bodies[1] * both.compliance
    apart = ContactProblem(bodies[0] * both.compliance, both.mass, both.gap, both.fixed, theirs, modulus)
    summed = ContactProblem(apart.compliance, both.mass, both.gap, both.fixed)
    longer = 1 + 10.0 ** -rng.uniform(0.5, 4.0) * np.cos(2 * np.arctan2(*sphere.xy.T))
    guess = ContactPath(ContactProblem(apart.compliance, both.mass, both.gap * longer, both.fixed))
    for depth in (0.02, 0.06):
        expected = ContactPath(summed).at(indentation=depth)
        state = ContactPath(apart, guess, 1.05).at(indentation=depth)
        assert (state.active == expected.active).all()
        assert state.traction == pytest.approx(expected.traction, abs=1e-9 * expected.traction.max())


def random_problem(seed, n=9) -> ContactProblem:
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(3 * n, 4 * n))
    return ContactProblem(root @ root.T / n, rng.uniform(0.5, 1.5, n), rng.uniform(0, 3, n), np.zeros((2, n), bool))


@pytest.mark.parametrize("friction", [STICK, 0.3])
def test_paths_of_random_bodies_hold_the_laws_or_say_so(friction):
    """Strongly coupled bodies let nodes go again; where no state of stick follows, an error says so."""
    states = 0
    for problem in map(random_problem, range(8)):
        path = LoadingPath(problem, friction)
        try:
            path.at(indentation=4.0)
        except SolverError:
            continue
        for state in (path.at(indentation=depth) for depth in np.linspace(0.2, 4.0, 20)):
            if state is not None:
                check_state(problem, state, friction)
                states += 1
    assert states >= 20, "most paths are refused"


def test_friction_takes_energy_and_never_gives_it(disc):
    patch = disc(3.0, 10, paraboloid)
    path = LoadingPath(bodies_on(patch, HalfSpace(1.0, 0.2)), 0.15)
    last = path.at(indentation=0.2)
    steps = np.diff([knot.dissipated for knot in path.steps.knots])
    assert steps.min() > -1e-12 * last.dissipated and last.dissipated > 0
    # and no more than the work that was put in
    work = np.trapezoid([knot.force for knot in path.steps.knots], [knot.indentation for knot in path.steps.knots])
    assert last.dissipated < 0.05 * work
