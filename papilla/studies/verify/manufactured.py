"""Manufactured solutions: the orders of convergence of the elements, separately for flat and for curved boundaries.

u = w + v mu/lambda and p = mu cos(x) sin(y) with the ABC flow w (no divergence, laplace w = -4 w) and
v = -(sin x sin y, 0, 0), whose divergence is -p/mu: so div u = -p/lambda for any nu, 0.5 included, and the body force
is f = -mu laplace u + (1 + mu/lambda) grad p.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from papilla.fem.discrete.assembly import lame
from papilla.finger import Layer
from papilla.mesh.layered import LayeredMesh
from papilla.studies import parameters
from papilla.studies.case import Case
from papilla.studies.verify.elements import Discretisation, one_material
from papilla.studies.verify.structured import cube, shell

GIVEN = parameters.parameters(__name__)


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
    for boundary, solve in (("flat", _solve_flat), ("curved", _solve_curved)):
        for element, nu in GIVEN.runs:
            errors = np.array([solve(mesh, element, nu) for mesh in _meshes(boundary, element)])
            slopes = np.log2(errors[0] / errors[1])
            name, degree = f"{element}, nu {nu:g}, {boundary} boundary", "P1" if element == "P1" else "P2"
            orders, caps = (own[boundary][degree] for own in (GIVEN.orders, GIVEN.caps))
            for norm, slope, order in zip(("L2", "H1"), slopes, orders, strict=True):
                measure = f"shortfall of the slope, {slope:.2f}, from the order {order:g} (exact solution)"
                yield Case(f"{name}, order in {norm}", measure, max(0.0, float(order - slope)), GIVEN.shortfall)
            for norm, error, cap in zip(("L2", "H1"), errors[1], caps, strict=True):
                yield Case(f"{name}, error in {norm}", f"{norm} norm of the error (exact solution)", float(error), cap)


@lru_cache(maxsize=4)
def _meshes(boundary: str, element: str) -> list[LayeredMesh]:
    """A mesh and one of half its element size; P1 takes finer ones."""
    if boundary == "flat":
        return [cube(4), cube(8)]
    divisions = (12, 24) if element == "P1" else (6, 12)
    return [shell(np.linspace(1, 2, 1 + number // 2), number) for number in divisions]


def _solve_flat(mesh: LayeredMesh, element: str, nu: float) -> tuple[float, float]:
    """Errors on the cube: displacement given below, exact tractions on the other sides."""
    exact, discrete = Manufactured(Layer(GIVEN.modulus_MPa, nu)), Discretisation(mesh, element)
    load = discrete.body_load(exact.body_force)
    for axis, value in ((0, 0), (0, 1), (1, 0), (1, 1), (2, 1)):
        load += _plane_load(discrete, exact, axis, value)
    return _errors(discrete, exact, load, discrete.points[2] == 0, discrete.points)


def _solve_curved(mesh: LayeredMesh, element: str, nu: float) -> tuple[float, float]:
    """Errors on the shell, displacement given on the core and in z = 0, exact tractions elsewhere.

    Boundary values on a sphere are known only on the true sphere, and are taken from it.
    """
    exact, discrete = Manufactured(Layer(GIVEN.modulus_MPa, nu)), Discretisation(mesh, element)

    def pull(x):
        outward = x / np.linalg.norm(x, axis=0)
        return exact.traction(2 * outward, outward)

    load = discrete.body_load(exact.body_force)
    load += discrete.surface_load(pull, discrete.space.facets(mesh.boundaries["skin"]))
    for axis in (0, 1):
        load += _plane_load(discrete, exact, axis, 0)
    core = np.zeros(discrete.space.nodes, dtype=bool)
    core[discrete.space.nodes_on(mesh.boundaries["base"])] = True
    places = np.where(core, discrete.points / np.linalg.norm(discrete.points, axis=0), discrete.points)
    return _errors(discrete, exact, load, core | (discrete.points[2] == 0), places)


def _plane_load(discrete: Discretisation, exact: Manufactured, axis: int, value: float) -> np.ndarray:
    """The load of the exact traction on the flat side where a coordinate has a value, the smallest or the largest."""
    normal = np.zeros((3, 1, 1))
    normal[axis] = 1 if value else -1
    facets = discrete.space.skmesh.facets_satisfying(lambda x: np.abs(x[axis] - value) < 1e-9)
    return discrete.surface_load(lambda x: exact.traction(x, normal * np.ones_like(x)), facets)


def _errors(discrete: Discretisation, exact: Manufactured, load, held, places: np.ndarray) -> tuple[float, float]:
    """Errors of the solution whose nodes `held` (mask) have the exact displacement of `places` (3, nodes)."""
    found = discrete.solve(one_material(exact.layer), load, held, exact.displacement(places).T)
    return discrete.errors(found, exact.displacement, exact.gradient)
