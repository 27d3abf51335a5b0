"""The elements against exact solutions: patch test and rigid motions, and manufactured solutions.

Elasticity is solved on a mesh by any of papilla's elements, with loads and prescribed displacements. The manufactured
solution is u = w + v mu/lambda and p = mu cos(x) sin(y) with the ABC flow w (no divergence, laplace w = -4 w) and
v = -(sin x sin y, 0, 0), whose divergence is -p/mu: so div u = -p/lambda for any nu, 0.5 included, and the body force
is f = -mu laplace u + (1 + mu/lambda) grad p. Orders of convergence differ between flat and curved boundaries.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import product

import numpy as np
import scipy.sparse as sp
from skfem import Basis, FacetBasis, LinearForm

from papilla.core import settings
from papilla.core.checks import ROUNDING_SHARE
from papilla.fem.discrete.assembly import lame
from papilla.fem.discrete.elements import ELEMENTS_BY_NAME, Space, TaylorHood, interpolation, space_of
from papilla.fem.discrete.solver import factorise
from papilla.fem.reduction.finger_model import INCOMPRESSIBLE_RATIO, PRESSURE_STABILISATION
from papilla.fem.reduction.gauges import curvature_functional, gauge_frame, strain_functional
from papilla.mesh import build
from papilla.mesh.body import surfaces_of
from papilla.mesh.layered import INNER_LAYER, OUTER_LAYER, LayeredMesh
from papilla.model.finger import Finger, Layer
from papilla.verify.case import Case
from papilla.verify.structured import cube, shell

ELEMENTS_PARAMETERS = settings.parameters(__name__)
PATCH_SETTINGS, MANUFACTURED_SETTINGS = ELEMENTS_PARAMETERS.patch, ELEMENTS_PARAMETERS.manufactured

ERROR_QUADRATURE_ORDER = 5
"""Quadrature order for loads and errors, which are not polynomials."""

ERROR_NORMS = ("L2", "H1")
VectorField = Callable[[np.ndarray], np.ndarray]
"""Points (3, ...) in mm -> values (3, ...)."""


@dataclass(frozen=True, eq=False)
class Discretisation:
    """One element on one mesh; fields are displacements (nodes, 3) in mm."""

    mesh: LayeredMesh
    element: str

    @cached_property
    def space(self) -> Space:
        """The element's space on the mesh."""
        return space_of(self.element, self.mesh)

    @cached_property
    def basis(self) -> Basis:
        """Scalar basis for loads and errors."""
        return Basis(self.space.skmesh, self.space.scalar_element, intorder=ERROR_QUADRATURE_ORDER)

    @property
    def points(self) -> np.ndarray:
        """Positions (3, nodes) in mm."""
        return self.space.displacement.doflocs

    def solve(self, layers: dict[int, Layer], load: np.ndarray, fixed: np.ndarray, values: np.ndarray) -> np.ndarray:
        """Displacement (nodes, 3) under a load (nodes, 3), the nodes `held` (mask) having the given values (nodes, 3).

        Pressure mass is added to the factored matrix if a layer has almost none, as in `FingerModel`.
        """
        space, size = self.space, load.size
        matrix = near = space.matrix(layers)
        for number in space.layer_numbers:
            mu, compressibility = lame(layers[number])
            if space.pressures and mu * compressibility < INCOMPRESSIBLE_RATIO:
                near = near - PRESSURE_STABILISATION / mu * space.part("mass", number)
        prescribed, free = np.zeros(space.unknowns), np.ones(space.unknowns, dtype=bool)
        prescribed[:size], free[:size] = np.where(fixed[:, None], values, 0.0).ravel(), np.repeat(~fixed, 3)
        rhs = -(matrix + sp.tril(matrix, -1).T) @ prescribed
        rhs[:size] += load.ravel()
        lower, stabilised = (stiffness.tocsr()[free][:, free].tocsc() for stiffness in (matrix, near))
        factor = factorise(lower, space.pressures, stabilised=None if near is matrix else stabilised)
        prescribed[free] = factor.solve(rhs[free, None])[:, 0]
        return prescribed[:size].reshape(-1, 3)

    def body_load(self, force: VectorField) -> np.ndarray:
        """Load (nodes, 3) of a body force (N/mm3)."""
        return _load(self.basis, force)

    def surface_load(self, traction: VectorField, facets: np.ndarray) -> np.ndarray:
        """Load (nodes, 3) of a traction (MPa) on some facets."""
        mesh, element = self.space.skmesh, self.space.scalar_element
        return _load(FacetBasis(mesh, element, facets=facets, intorder=ERROR_QUADRATURE_ORDER), traction)

    def errors(self, solution: np.ndarray, field: VectorField, gradient: VectorField) -> tuple[float, float]:
        """Relative errors in L2 and in the H1 seminorm; the gradient (3, 3, ...) has the derivative's axis last."""
        fields = [self.basis.interpolate(component) for component in solution.T.copy()]
        x = np.asarray(self.basis.global_coordinates())
        values, slopes = (
            np.stack([np.asarray(component) for component in fields]),
            np.stack([component.grad for component in fields]),
        )
        norms = ((values - field(x), field(x)), (slopes - gradient(x), gradient(x)))
        low, high = (np.sqrt((e**2 * self.basis.dx).sum() / (n**2 * self.basis.dx).sum()) for e, n in norms)
        return float(low), float(high)


def _load(basis: Basis, field: VectorField) -> np.ndarray:
    values = field(np.asarray(basis.global_coordinates()))
    return np.stack([LinearForm(lambda v, w: w["f"] * v).assemble(basis, f=component) for component in values], axis=1)


def patch_test() -> Iterator[Case]:
    """Constant strain, constant stress across the layers, and rigid motions."""
    yield from exact_fields()
    yield from _rigid_motions()


def exact_fields() -> Iterator[Case]:
    """Constant strain, and constant stress across the layers."""
    mesh = cube(4, jitter=PATCH_SETTINGS.jitter, split=True)

    def stretched(x):
        return np.einsum("ij,j...->i...", np.array(PATCH_SETTINGS.gradient), x)

    for element in ELEMENTS_BY_NAME:
        for nu in PATCH_SETTINGS.poissons:
            layers = dict.fromkeys((OUTER_LAYER, INNER_LAYER), Layer(PATCH_SETTINGS.strain_modulus_MPa, nu))
            error = _interior_error(Discretisation(mesh, element), layers, stretched)
            measure = "displacement inside, linear on the boundary (exact solution)"
            yield Case(f"constant strain, {element}, nu {nu:g}", measure, error, PATCH_SETTINGS.bound)
    for contrast in PATCH_SETTINGS.contrasts:
        error = _constant_stress(Discretisation(mesh, "Taylor-Hood"), contrast)
        measure = "displacement that bends on the interface, pressure that jumps there (exact solution)"
        yield Case(f"constant stress, layer contrast {contrast:g}", measure, error, PATCH_SETTINGS.bound)


def _constant_stress(discrete: Discretisation, contrast: float) -> float:
    """Shear and confined compression by a stress that is the same above and below z = 1/2."""
    (nu, incompressible), modulus = PATCH_SETTINGS.poissons, PATCH_SETTINGS.stress_modulus_MPa
    layers = {OUTER_LAYER: Layer(modulus * contrast, nu), INNER_LAYER: Layer(modulus, incompressible)}
    along, across, through = PATCH_SETTINGS.stress_MPa
    slopes = {}
    for number, layer in layers.items():
        mu, compressibility = lame(layer)
        slopes[number] = np.array([along / mu, across / mu, through / (2 * mu + 1 / compressibility)])

    def field(x):
        below, above = np.minimum(x[2], 0.5), np.maximum(x[2] - 0.5, 0)
        return np.multiply.outer(slopes[INNER_LAYER], below) + np.multiply.outer(slopes[OUTER_LAYER], above)

    return _interior_error(discrete, layers, field)


def _interior_error(discrete: Discretisation, layers: dict[int, Layer], field) -> float:
    """Largest error in the unknowns inside a cube with the field given on its whole boundary, relative to the field."""
    x, exact = discrete.points, field(discrete.points).T
    fixed = ((x == 0) | (x == 1)).any(axis=0)
    solution = discrete.solve(layers, np.zeros_like(exact), fixed, exact)
    return float(np.abs(solution - exact).max() / np.abs(exact).max())


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
    yield Case("rigid rotation, strain", "largest strain of a unit rotation (exactly 0)", strain, PATCH_SETTINGS.bound)
    motions = np.stack(rotations + [size * np.broadcast_to(axis, places.shape) for axis in np.eye(3)])
    interface = surfaces_of(finger)["interface"]
    measure = f"largest of 5 gauges and 6 motions of up to {size:.0f} mm (exactly 0)"
    for name, unit, make in (("strain", "", strain_functional), ("curvature", ", in 1/mm", curvature_functional)):
        worst = 0.0
        for gauge in finger.gauges:
            functional = make(gauge, gauge_frame(finger, gauge, interface), interface)
            at_points = interpolation(space, functional.points)
            worst = max(worst, *(abs(float(np.sum(functional.weights * (at_points @ motion)))) for motion in motions))
        yield Case(f"rigid motions, gauge {name}", measure + unit, worst, PATCH_SETTINGS.bound)


def _largest_strain(space: TaylorHood, motion: np.ndarray) -> float:
    gradient = np.stack([space.displacement.interpolate(motion[:, c].copy()).grad for c in range(3)])
    return float(np.abs(gradient + gradient.swapaxes(0, 1)).max() / 2)


@dataclass(frozen=True)
class Manufactured:
    """The exact solution for one material; points (3, ...) in mm."""

    layer: Layer

    def displacement(self, x: np.ndarray) -> np.ndarray:
        """u (3, ...) in mm."""
        return self._flow(x) + self._ratio * self._squeeze(x)

    def gradient(self, x: np.ndarray) -> np.ndarray:
        """du_i/dx_j (3, 3, ...)."""
        result = np.zeros((3, *x.shape))
        for i, (j, k) in enumerate(((1, 2), (2, 0), (0, 1))):
            result[i, j] = 2 * np.cos(2 * x[j])
            result[i, k] = -2 * np.sin(2 * x[k])
        result[0, 0] -= self._ratio * np.cos(x[0]) * np.sin(x[1])
        result[0, 1] -= self._ratio * np.sin(x[0]) * np.cos(x[1])
        return result

    def traction(self, x: np.ndarray, normal: np.ndarray) -> np.ndarray:
        """Stress 2 mu eps - p I times a normal (3, ...), in MPa."""
        mu = lame(self.layer)[0]
        slope = self.gradient(x)
        strain = (slope + slope.swapaxes(0, 1)) / 2
        pressure = mu * np.cos(x[0]) * np.sin(x[1])
        return 2 * mu * np.einsum("ij...,j...->i...", strain, normal) - pressure * normal

    def body_force(self, x: np.ndarray) -> np.ndarray:
        """f = -mu laplace u + (1 + mu/lambda) grad p in N/mm3."""
        mu = lame(self.layer)[0]
        slope = np.stack([-np.sin(x[0]) * np.sin(x[1]), np.cos(x[0]) * np.cos(x[1]), np.zeros_like(x[0])])
        return mu * (4 * self._flow(x) + 2 * self._ratio * self._squeeze(x) + (1 + self._ratio) * slope)

    @property
    def _ratio(self) -> float:
        return float(np.prod(lame(self.layer)))

    @staticmethod
    def _flow(x: np.ndarray) -> np.ndarray:
        return np.stack([np.sin(2 * x[j]) + np.cos(2 * x[k]) for j, k in ((1, 2), (2, 0), (0, 1))])

    @staticmethod
    def _squeeze(x: np.ndarray) -> np.ndarray:
        return np.stack([-np.sin(x[0]) * np.sin(x[1]), np.zeros_like(x[0]), np.zeros_like(x[0])])


def manufactured() -> Iterator[Case]:
    """Slopes between two meshes and caps on the finer one, for every element, nu, boundary and norm."""
    for boundary, (element, nu) in product(MANUFACTURED_SETTINGS.orders, MANUFACTURED_SETTINGS.runs):
        meshes = _meshes(boundary, element)
        coarse, fine = (np.array(_errors(mesh, element, nu, boundary == "curved")) for mesh in meshes)
        name, degree = f"{element}, nu {nu:g}, {boundary} boundary", "P1" if element == "P1" else "P2"
        for norm, slope, order in zip(
            ERROR_NORMS, np.log2(coarse / fine), MANUFACTURED_SETTINGS.orders[boundary][degree], strict=True
        ):
            measure = f"shortfall of the slope, {slope:.2f}, from the order {order:g} (exact solution)"
            yield Case(
                f"{name}, order in {norm}", measure, max(0.0, float(order - slope)), MANUFACTURED_SETTINGS.shortfall
            )
        for norm, error, cap in zip(
            ERROR_NORMS, fine.tolist(), MANUFACTURED_SETTINGS.caps[boundary][degree], strict=True
        ):
            yield Case(f"{name}, error in {norm}", f"{norm} norm of the error (exact solution)", error, cap)


@lru_cache(maxsize=4)
def _meshes(boundary: str, element: str) -> list[LayeredMesh]:
    """A mesh and one of half its element size; P1 takes finer ones."""
    if boundary == "flat":
        return [cube(4), cube(8)]
    divisions = (12, 24) if element == "P1" else (6, 12)
    return [shell(np.linspace(1, 2, 1 + number // 2), number) for number in divisions]


def _errors(mesh: LayeredMesh, element: str, nu: float, curved: bool) -> tuple[float, float]:
    """Errors on the cube or, `curved`, on the shell: displacement given in z = 0 and on the core, and exact tractions
    on the other sides.

    Boundary values on a sphere are known only on the true sphere, and are taken from it.
    """
    exact, discrete = Manufactured(Layer(MANUFACTURED_SETTINGS.modulus_MPa, nu)), Discretisation(mesh, element)
    places, load = discrete.points, discrete.body_load(exact.body_force)
    fixed, on_sphere = places[2] == 0, np.zeros(discrete.space.nodes, dtype=bool)
    if curved:

        def pull(x):
            outward = x / np.linalg.norm(x, axis=0)
            return exact.traction(2 * outward, outward)

        load += discrete.surface_load(pull, discrete.space.facets(mesh.boundaries["skin"]))
        on_sphere[discrete.space.nodes_on(mesh.boundaries["base"])] = True
        places = np.where(on_sphere, places / np.linalg.norm(places, axis=0), places)
    for axis, value in ((0, 0), (1, 0)) if curved else ((0, 0), (0, 1), (1, 0), (1, 1), (2, 1)):
        load += _plane_load(discrete, exact, axis, value)
    layers = dict.fromkeys((OUTER_LAYER, INNER_LAYER), exact.layer)
    solution = discrete.solve(layers, load, fixed | on_sphere, exact.displacement(places).T)
    return discrete.errors(solution, exact.displacement, exact.gradient)


def _plane_load(discrete: Discretisation, exact: Manufactured, axis: int, value: float) -> np.ndarray:
    """The load of the exact traction on the flat side where a coordinate has a value, the smallest or the largest."""
    normal = np.zeros((3, 1, 1))
    normal[axis] = 1 if value else -1
    facets = discrete.space.skmesh.facets_satisfying(lambda x: np.abs(x[axis] - value) < ROUNDING_SHARE)
    return discrete.surface_load(lambda x: exact.traction(x, normal * np.ones_like(x)), facets)
