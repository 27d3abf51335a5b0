"""Contact with friction against its exact answers: a sphere that sticks or slips, and a bonded layer both ways."""

from collections.abc import Iterator

import numpy as np

from papilla.fem import ReducedFinger, press
from papilla.fem.pressing.contact_path import ContactProblem
from papilla.fem.pressing.loading_path import path_of
from papilla.fem.reduction.compliance import PatchSurface, quadrature, weak_gap
from papilla.finger import Layer
from papilla.references import dundurs_beta, frictional_punch
from papilla.specimen import Block, Friction, friction_coefficient
from papilla.studies.case import Case
from papilla.studies.verify.bodies import BALL, BALL_RADIUS, bonded_layer, half_space, off

MODULUS, NU = 1.0, 0.3

FORCE_BOUND, SHEAR_BOUND = 0.01, 0.03

THICKNESS = 1.5


def friction() -> Iterator[Case]:
    """A ball on a block of 600 contact radii, and on a bonded layer that is meshed or taken from its kernels."""
    model = half_space(Layer(MODULUS, NU))
    reduced = model.reduce()
    beta = dundurs_beta(MODULUS, NU)
    frictions: tuple[tuple[Friction, str], ...] = (("stick", "Mossakovskii"), (0.2, "Spence"), (0.1, "Spence"))
    for value, source in frictions:
        exact = frictional_punch(beta, friction_coefficient(value))
        force, indentation = exact.sphere(1.0, BALL_RADIUS, MODULUS / (1 - NU**2))
        found = press(reduced, BALL, indentation=indentation, friction=value)
        name, against = f"sphere on half-space, friction {value}", f"at given indentation, against {source}"
        yield Case(f"{name}, force", f"force {against} (exact solution)", off(found.force, force), FORCE_BOUND)
        moment = shear_moment(reduced, found.traction)
        measure = f"moment of the shear {against} (exact solution)"
        yield Case(f"{name}, shear", measure, off(moment, exact.shear_moment * force), SHEAR_BOUND)
    yield from _layer_both_ways()


def _layer_both_ways() -> Iterator[Case]:
    """An incompressible layer by finite elements under a ball, and its kernels in their place."""
    layer = Layer(MODULUS, 0.5)
    model = bonded_layer(layer, THICKNESS)
    reduced = model.reduce()
    patch, n = reduced.patch, len(reduced.patch.xy)
    turned = np.repeat([1.0, -1.0, -1.0], n)
    kernels = Block(MODULUS, THICKNESS, 0.5).traction_compliance(PatchSurface(patch, reduced.half_space))
    problem = ContactProblem(turned[:, None] * kernels * turned, patch.mass, weak_gap(patch, BALL), (patch.xy == 0).T)
    for value in ("stick", 0.1):
        found = press(reduced, BALL, indentation=0.6 / BALL_RADIUS, friction=value)
        expected = path_of(problem, friction_coefficient(value)).at(indentation=0.6 / BALL_RADIUS)
        assert expected is not None
        name = f"sphere on incompressible layer, friction {value}"
        against = "at given indentation, against the layer's kernels (second method)"
        force = reduced.multiplicity * expected.force
        yield Case(f"{name}, force", f"force {against}", off(found.force, force), FORCE_BOUND)
        moments = shear_moment(reduced, found.traction), shear_moment(reduced, expected.traction)
        yield Case(f"{name}, shear", f"moment of the shear {against}", off(*moments), SHEAR_BOUND)


def shear_moment(reduced: ReducedFinger, traction: np.ndarray) -> float:
    """int q . x dA (N mm) of tangential tractions (3, n) on the whole patch."""
    points, weights, hats = quadrature(reduced.patch)
    return reduced.multiplicity * float(weights @ ((hats @ traction[1:].T) * points).sum(axis=1))
