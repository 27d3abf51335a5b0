"""Patch test and rigid motions, which every element must reproduce exactly."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from papilla.fem.discrete.assembly import lame
from papilla.fem.discrete.elements import ELEMENTS, TaylorHood, interpolation
from papilla.fem.reduction.gauges import curvature_functional, gauge_frame, strain_functional
from papilla.finger import Finger, Layer
from papilla.mesh import build
from papilla.mesh.body import surfaces_of
from papilla.mesh.layered import INNER, OUTER
from papilla.studies import parameters
from papilla.studies.case import Case
from papilla.studies.verify.elements import Discretisation, one_material
from papilla.studies.verify.structured import cube

GIVEN = parameters.parameters(__name__)


def patch_test() -> Iterator[Case]:
    """Constant strain, constant stress across the layers, and rigid motions."""
    yield from exact_fields()
    yield from _rigid_motions()


def exact_fields() -> Iterator[Case]:
    """Constant strain, and constant stress across the layers."""
    mesh = cube(4, jitter=GIVEN.jitter, split=True)
    for element in ELEMENTS:
        for nu in GIVEN.poissons:
            error = _constant_strain(Discretisation(mesh, element), nu)
            measure = "displacement inside, linear on the boundary (exact solution)"
            yield Case(f"constant strain, {element}, nu {nu:g}", measure, error, GIVEN.bound)
    for contrast in GIVEN.contrasts:
        error = _constant_stress(Discretisation(mesh, "Taylor-Hood"), contrast)
        measure = "displacement that bends on the interface, pressure that jumps there (exact solution)"
        yield Case(f"constant stress, layer contrast {contrast:g}", measure, error, GIVEN.bound)


def _constant_strain(discrete: Discretisation, nu: float) -> float:
    return _interior_error(discrete, one_material(Layer(GIVEN.strain_modulus_MPa, nu)), _linear)


def _linear(x: np.ndarray) -> np.ndarray:
    return np.einsum("ij,j...->i...", np.array(GIVEN.gradient), x)


def _constant_stress(discrete: Discretisation, contrast: float) -> float:
    """Shear and confined compression by a stress that is the same above and below z = 1/2."""
    (nu, incompressible), modulus = GIVEN.poissons, GIVEN.stress_modulus_MPa
    layers = {OUTER: Layer(modulus * contrast, nu), INNER: Layer(modulus, incompressible)}
    along, across, through = GIVEN.stress_MPa
    slopes = {}
    for number, layer in layers.items():
        mu, compressibility = lame(layer)
        slopes[number] = np.array([along / mu, across / mu, through / (2 * mu + 1 / compressibility)])

    def field(x):
        below, above = np.minimum(x[2], 0.5), np.maximum(x[2] - 0.5, 0)
        return np.multiply.outer(slopes[INNER], below) + np.multiply.outer(slopes[OUTER], above)

    return _interior_error(discrete, layers, field)


def _interior_error(discrete: Discretisation, layers: dict[int, Layer], field) -> float:
    """Largest error in the unknowns inside a cube with the field given on its whole boundary, relative to the field."""
    x, exact = discrete.points, field(discrete.points).T
    held = ((x == 0) | (x == 1)).any(axis=0)
    found = discrete.solve(layers, np.zeros_like(exact), held, exact)
    return float(np.abs(found - exact).max() / np.abs(exact).max())


def _rigid_motions() -> Iterator[Case]:
    """Strain in the cells and reading of every gauge, under three translations and three rotations of unit size."""
    finger = Finger.default()
    # The whole mesh without mirrors: gauges lie in all its images
    mesh = replace(build(finger), mirrors=())
    space = TaylorHood(mesh)
    places = space.displacement.doflocs.T
    rotations = [np.cross(axis, places) for axis in np.eye(3)]
    size = np.abs(rotations[0]).max()
    strain = max(_largest_strain(space, motion) for motion in rotations)
    yield Case("rigid rotation, strain", "largest strain of a unit rotation (exactly 0)", strain, GIVEN.bound)
    motions = np.stack(rotations + [size * np.broadcast_to(axis, places.shape) for axis in np.eye(3)])
    interface = surfaces_of(finger)["interface"]
    measure = f"largest of 5 gauges and 6 motions of up to {size:.0f} mm (exactly 0)"
    for name, unit, make in (("strain", "", strain_functional), ("curvature", ", in 1/mm", curvature_functional)):
        worst = 0.0
        for gauge in finger.gauges:
            functional = make(gauge, gauge_frame(finger, gauge, interface), interface)
            at_points = interpolation(space, functional.points)
            worst = max(worst, *(abs(float(np.sum(functional.weights * (at_points @ motion)))) for motion in motions))
        yield Case(f"rigid motions, gauge {name}", measure + unit, worst, GIVEN.bound)


def _largest_strain(space: TaylorHood, motion: np.ndarray) -> float:
    gradient = np.stack([space.displacement.interpolate(motion[:, c].copy()).grad for c in range(3)])
    return float(np.abs(gradient + gradient.swapaxes(0, 1)).max() / 2)
