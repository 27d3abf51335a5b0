"""Unilateral contact against Hertz, bonded layers and an independent solver of the same complementarity problem."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import nnls

from papilla.fem.pressing.contact import contact_shape
from papilla.fem.pressing.contact_path import ContactProblem
from papilla.fem.pressing.contact_step import contact_step, first_touch
from papilla.fem.reduction.compliance import half_space_compliance, kernel_compliance
from papilla.references import LayerKernel, bonded_layer_sphere, hertz_sphere

RADIUS, E_STAR = 10.0, 0.2


def paraboloid(x, y):
    return (x**2 + y**2) / (2 * RADIUS)


@pytest.fixture(scope="module")
def ball(disc):
    """A sphere's patch of 24 rings with the compliance of a half-space."""
    patch = disc(4.0, 24, paraboloid)
    return patch, half_space_compliance(patch) / E_STAR


def solved(compliance, mass, gap, *, start=None, **load):
    """The contact without friction, found in one step from first touch, or from other nodes to `start` with."""
    problem = ContactProblem(compliance, mass, gap)
    state = first_touch(problem)
    return contact_step(problem, state if start is None else replace(state, active=start), **load)


def random_problem(seed, n=30):
    """Compliance, mass and gap of a random problem, the first positive definite and anything but diagonal."""
    random = np.random.default_rng(seed)
    factor = random.standard_normal((n, n))
    compliance = factor @ factor.T + 10.0 ** random.uniform(-3, 1) * np.eye(n)
    return compliance, random.uniform(0.5, 2, n), random.uniform(0, 1, n)


# ---- Hertz


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
            errors.append(
                [
                    contact_.indentation / exact.indentation - 1,
                    shape.area / exact.area - 1,
                    np.sqrt(4 * patch.mass @ difference**2 / exact.area) / exact.peak_pressure,
                ]
            )
        found.append(np.sqrt(np.square(errors).mean(axis=0)))
    order = np.log(found[0] / found[1]) / np.log(3)
    assert (found[1] < [0.001, 0.01, 0.05]).all()
    # The square root at the edge of Hertz's pressure allows no more than one for the pressure itself
    assert (order > [1.4, 1.0, 0.6]).all()


@pytest.mark.slow
@pytest.mark.parametrize("nu", [0.5, 0.4])
@pytest.mark.parametrize("chi", [0.19, 0.49, 0.75, 1.05])
def test_bonded_layer(disc, chi, nu):
    """A rigid sphere on a layer bonded to a rigid base, against the exact dual integral equations."""
    thickness, modulus, radius = 10.0, 0.3, 100.0
    exact = bonded_layer_sphere((chi * thickness) ** 2 / radius, radius, thickness, modulus, nu)
    patch = disc(1.4 * exact.contact_radius, 16, lambda x, y: (x**2 + y**2) / (2 * radius))
    compliance = half_space_compliance(patch) * ((1 - nu**2) / modulus)
    compliance = compliance + kernel_compliance(patch, LayerKernel(thickness, nu)) / modulus
    found = solved(compliance, patch.mass, patch.gap, indentation=exact.indentation)
    shape = contact_shape(patch, found.traction[0])
    assert 4 * patch.mass @ found.traction[0] == pytest.approx(exact.force, rel=0.01)
    assert shape.elliptic
    assert shape.area == pytest.approx(exact.area, rel=0.02)
    assert shape.peak_pressure == pytest.approx(exact.peak_pressure, rel=0.02)


# ---- Complementarity


@pytest.mark.parametrize("force", [1e-4, 0.02, 0.15])
def test_complementarity_and_balance(ball, force):
    patch, compliance = ball
    found = solved(compliance, patch.mass, patch.gap, force=force)
    weak_gap = compliance @ found.traction[0] + patch.gap - found.indentation * patch.mass
    scale = (found.indentation * patch.mass).max()
    assert (found.traction[0] >= 0).all() and (weak_gap >= -1e-12 * scale).all()
    assert np.abs(found.traction[0] * weak_gap).max() <= 1e-12 * found.traction[0].max() * scale
    assert ((found.traction[0] > 0) == found.active).all()
    assert patch.mass @ found.traction[0] == pytest.approx(force, rel=1e-12)


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


# ---- What must not change the answer


@pytest.mark.parametrize("scale", [1e-6, 1e6])
@pytest.mark.parametrize("unit", ["pressure", "length"])
def test_units_change_nothing(ball, unit, scale):
    patch, compliance = ball
    plain = solved(compliance, patch.mass, patch.gap, force=0.05)
    if unit == "pressure":
        found = solved(compliance / scale, patch.mass, patch.gap, force=0.05 * scale)
        pressure, indentation = found.traction[0] / scale, found.indentation
    else:
        found = solved(compliance * scale**3, patch.mass * scale**2, patch.gap * scale**3, force=0.05 * scale**2)
        pressure, indentation = found.traction[0], found.indentation / scale
    assert found.iterations == plain.iterations
    assert (found.active == plain.active).all()
    assert pressure == pytest.approx(plain.traction[0], rel=1e-9)
    assert indentation == pytest.approx(plain.indentation, rel=1e-12)
