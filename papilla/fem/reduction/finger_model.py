"""`FingerModel`: a finger on a mesh, factorised once and condensed to a `ReducedFinger`.

Mirror planes reduce the cost: any load is split into parts that are symmetric or antisymmetric about each plane, and
each part is solved on the quarter cell. A press at the apex needs only the symmetric part; one elsewhere needs all
four, and still uses only a quarter of the mesh.
"""

import math
from collections.abc import Callable, Mapping
from functools import cached_property, partial
from weakref import WeakValueDictionary

import numpy as np
import scipy.sparse as sp

from papilla.core import checks
from papilla.core.errors import InputError
from papilla.core.memory import refuse_reduction
from papilla.fem.discrete.assembly import lame, restricted, scaled
from papilla.fem.discrete.elements import DEFAULT_ELEMENT, SYMMETRIC_PARITY, fold, interpolation, parity_signs, space_of
from papilla.fem.discrete.solver import RIGHT_SIDES_AT_ONCE, Factor, factorise
from papilla.fem.reduction.compliance import half_space_compliance
from papilla.fem.reduction.gauges import GAUGE_QUANTITIES, PointFunctional, gauge_functionals, gauge_weights
from papilla.fem.reduction.loaded_patch import LoadedPatch, build_patch, image_signs
from papilla.fem.reduction.patch import Frame
from papilla.fem.reduction.reduced import ReducedFinger
from papilla.mesh.body import facet_deviation, patch_radius_mm, surfaces_of
from papilla.mesh.layered import BONE_LAYER, INNER_LAYER, OUTER_LAYER, LayeredMesh
from papilla.mesh.surfaces import Surface
from papilla.model.finger import Finger, Layer

INCOMPRESSIBLE_RATIO = 1e-7
"""Value of mu/lambda below which the pressure block is nearly empty, so that a stabilised matrix is factored
instead."""

PRESSURE_STABILISATION = 1e-5
"""Pressure mass that is added to the stabilised matrix, in units of 1/mu; solves are refined with the true matrix."""

WALK_POINTS = 4001
"""Number of points on a line into the finger, at which the layers below the touch-down point are found."""

_LIVING: WeakValueDictionary = WeakValueDictionary()
_LATEST: list["FingerModel"] = []
"""Models that are still in use after a reduction, and the latest one of `model_of`, so that nothing is factorised
twice."""


class FingerModel:
    """Linear elasticity of `finger` on `mesh` (mm, MPa).

    `element` is "Taylor-Hood", or "P2" or "P1" in displacements alone; these lock near nu = 0.5 and serve for
    comparisons. Raises `InputError` for another name, or a mesh that is not the finger's.
    """

    def __init__(self, finger: Finger, mesh: LayeredMesh, element: str = DEFAULT_ELEMENT):
        if (finger.bone is not None) != bool((mesh.layer == BONE_LAYER).any()):
            raise InputError("the mesh does not fit the finger: bone cells and a bone with a modulus go together")
        self.finger = finger
        self.mesh = mesh
        self.surfaces = surfaces_of(finger)
        self.space = space_of(element, mesh.cell())
        self._factors: dict[tuple[int, int], tuple[np.ndarray, Factor]] = {}

    def __repr__(self) -> str:
        return f"FingerModel({self.finger.name!r}, {len(self.mesh.tets)} tetrahedra, {self.space.name})"

    @cached_property
    def layers(self) -> dict[int, Layer]:
        """Layer number -> material."""
        layers = {OUTER_LAYER: self.finger.outer, INNER_LAYER: self.finger.inner}
        return layers if self.finger.bone is None else layers | {BONE_LAYER: self.finger.bone}

    def reduce(self, at: tuple[float, float] = (0.0, 0.0)) -> ReducedFinger:
        """Condense the finger to contact compliance and gauge influence for a specimen that touches down at `at`.

        `at` is (x, y) in mm; the specimen comes along the skin's inward normal there. Raises `InputError` if there is
        no skin, `MemoryEstimateError` if the mesh needs more memory than is free, `SolverError` if the equations cannot
        be solved.
        """
        loaded, parities = self._patch(at)
        compliance, rows = self._condense(loaded, parities, (0,), (0,))
        # The tangential part is computed when a press needs it. It keeps no model alive, except one of a derived class,
        # whose surfaces another model would not have.
        tangential: Callable = partial(self.reduce_tangential, at)
        if type(self) is FingerModel:
            _LIVING[self.finger.sha256, self.mesh.sha256, self.space.name] = self
            tangential = partial(tangential_of, self.finger, self.mesh, self.space.name, at)
        gauges = self.finger.gauges
        return ReducedFinger(
            finger_name=self.finger.name,
            finger_sha256=self.finger.sha256,
            mesh_sha256=self.mesh.sha256,
            mesh_size_mm=self.mesh.size_mm,
            at=(float(at[0]), float(at[1])),
            gauge_names=tuple(gauge.name for gauge in gauges),
            outer_modulus=self.finger.outer.modulus / (1 - self.finger.outer.nu**2),
            patch=loaded.patch,
            compliance=(compliance + compliance.T) / 2,
            half_space=half_space_compliance(loaded.patch),
            rows=rows,
            weights=gauge_weights(self.finger),
            layers=layers_below(self.finger, self.surfaces, loaded.frame, self.mesh),
            strain_key=self.finger.strain_sha256,
            bench=self.finger.bench,
            facets=facet_deviation(self.surfaces["skin"], loaded.frame.origin, patch_radius_mm(self.finger) / 4),
            element=self.space.name,
            tangential_source=tangential,
        )

    def reduce_tangential(self, at: tuple[float, float] = (0.0, 0.0)) -> tuple[np.ndarray, np.ndarray]:
        """The effect of tangential tractions on the finger reduced at `at`: `ReducedFinger.tangential`."""
        loaded, parities = self._patch(at)
        compliance, rows = self._condense(loaded, parities, (0, 1, 2), (1, 2))
        n = len(loaded.patch.xy)
        # Only the block between shears is square, and symmetric by reciprocity up to rounding.
        compliance[n:] = (compliance[n:] + compliance[n:].T) / 2
        return compliance, rows

    def cell_displacements(self, traction: np.ndarray, at: tuple[float, float] = (0.0, 0.0)) -> dict:
        """Parity -> displacement (nodes of the cell, 3) in mm under nodal patch pressures (n,), or pressures and
        tangential tractions (3, n), in MPa."""
        loads = self._loads(traction, at)
        return {parity: self._solve(parity, load)[: len(load), 0].reshape(-1, 3) for parity, load in loads.items()}

    def cell_pressures(self, traction: np.ndarray, at: tuple[float, float] = (0.0, 0.0)) -> dict:
        """Parity -> pressure unknowns of the cell, in MPa, under tractions as of `cell_displacements`."""
        loads = self._loads(traction, at)
        return {parity: self._solve(parity, load)[len(load) :, 0] for parity, load in loads.items()}

    def _loads(self, traction: np.ndarray, at: tuple[float, float]) -> dict:
        """Parity -> displacement load (3 * nodes, 1): the part of the patch's tractions with this parity."""
        loaded, parities = self._patch(at)
        components = np.atleast_2d(traction)
        if components.shape not in ((1, len(loaded.patch.xy)), (3, len(loaded.patch.xy))):
            raise InputError(f"pressure must have {len(loaded.patch.xy)} nodal values, got shape {np.shape(traction)}")
        return {
            parity: sum(loaded.loads(parity, c) @ values[:, None] for c, values in enumerate(components))
            / len(parities)
            for parity in parities
        }

    def gauge_adjoints(self) -> dict:
        """Parity -> displacement (nodes of the cell, 3, gauges) whose value at a point is each gauge's strain per
        newton of force there, component by component (reciprocity)."""
        functionals = gauge_functionals(self.finger, self.surfaces["interface"])
        return self.adjoints(functionals[: len(self.finger.gauges)])  # Strain is the first quantity

    def reading_adjoints(self) -> dict:
        """As `gauge_adjoints`, for each gauge's reading (the weighted sum of its quantities, as strain), and only for
        fields that are symmetric in y, which are all that loads symmetric in y excite."""
        mixing = sp.hstack([sp.diags(gains) for gains in gauge_weights(self.finger)])
        parities = [parity for parity in image_signs(self.mesh.mirrors) if parity[1] > 0]
        return self.adjoints(gauge_functionals(self.finger, self.surfaces["interface"]), parities, mixing)

    def adjoints(
        self,
        functionals: list[PointFunctional],
        parities: list[tuple[int, int]] | None = None,
        mixing: sp.spmatrix | None = None,
    ) -> dict:
        """As `gauge_adjoints`, for k functionals of the displacement, or for the combinations of them that the rows of
        `mixing` (k, functionals) give; for all parities by default."""
        every = image_signs(self.mesh.mirrors)
        by_parity = {}
        for parity in every if parities is None else parities:
            rows = self.rows(functionals, parity)
            load = (rows if mixing is None else mixing @ rows).T.toarray()
            by_parity[parity] = self._solve(parity, load / len(every))[: len(load)].reshape(-1, 3, load.shape[1])
        return by_parity

    def factor(self, parity: tuple[int, int] = SYMMETRIC_PARITY) -> tuple[np.ndarray, Factor]:
        """Free unknowns (mask) and factorised dimensionless matrix, for fields of one parity; made once and kept."""
        if parity not in self._factors:
            free = self.space.free(parity, self.mesh.mirrors)
            matrix = restricted(self.matrix, free)
            # The matrix is indefinite: each pressure is a multiplier, and gives one negative eigenvalue.
            negative = int(free[self.space.unknowns - self.space.pressures :].sum())
            self._factors[parity] = free, factorise(matrix, negative, stabilised=self._stabilised(matrix, free))
        return self._factors[parity]

    @cached_property
    def _scale(self) -> np.ndarray:
        """Factors (unknowns,) that make the matrix dimensionless, so that its residual does not depend on units.

        Blocks of the matrix have the units mu L, L^2 and L^3 / mu. The factors are powers of 2, so scaling causes no
        rounding.
        """
        size = float(np.ptp(self.mesh.points, axis=0).max())
        mu, length = (4.0 ** np.round(np.log2(x) / 2) for x in (max(lame(x)[0] for x in self.layers.values()), size))
        pressures = self.space.pressures
        counts = self.space.unknowns - pressures, pressures
        return np.repeat([(mu * length) ** -0.5, (mu / length**3) ** 0.5], counts)

    @cached_property
    def matrix(self) -> sp.csc_matrix:
        """Lower triangle of the assembled, dimensionless matrix, before boundary conditions are applied."""
        return scaled(self.space.matrix(self.layers), self._scale)

    def _stabilised(self, matrix: sp.csc_matrix, free: np.ndarray) -> sp.csc_matrix | None:
        """The matrix with some pressure mass added to layers that are so incompressible that they have almost none."""
        empty = [number for number, layer in self.layers.items() if math.prod(lame(layer)) < INCOMPRESSIBLE_RATIO]
        for number in empty:
            mu = lame(self.layers[number])[0]
            mass = scaled(self.space.part("mass", number), self._scale)
            matrix = matrix - PRESSURE_STABILISATION / mu * restricted(mass, free)
        return matrix.tocsc() if empty else None

    def _solve(self, parity: tuple[int, int], load: np.ndarray) -> np.ndarray:
        """All unknowns (displacements, then pressures, k) under displacement loads (3 * nodes, k)."""
        free, factor = self.factor(parity)
        size = len(load)
        rhs = np.zeros((int(free.sum()), load.shape[1]))
        # Loads act on displacements alone; both sides are scaled, so that the solver sees no units.
        rhs[: int(free[:size].sum())] = load[free[:size]] * self._scale[0]
        solution = np.zeros((len(free), load.shape[1]))
        solution[free] = factor.solve(rhs) * self._scale[free, None]
        return solution

    def _patch(self, at: tuple[float, float]) -> tuple[LoadedPatch, list[tuple[int, int]]]:
        """The loaded patch at a touch-down point and the parities that its loads excite."""
        x, y = checks.place("at", at)
        frame = Frame.at(self.surfaces["skin"], x, y)
        mirrors = self.mesh.mirrors
        symmetric = bool(mirrors) and all(frame.origin["xyz".index(axis)] == 0 for axis in mirrors)
        loaded = build_patch(
            self.space, self.mesh, self.surfaces["skin"], frame, patch_radius_mm(self.finger), symmetric
        )
        # Any field can be split into as many parities as there are images of the cell.
        return loaded, [SYMMETRIC_PARITY] if symmetric else image_signs(mirrors)

    def rows(self, functionals: list[PointFunctional], parity: tuple[int, int]) -> sp.csr_matrix:
        """Functionals as rows (k, 3 * nodes) on the cell's displacement of one parity."""
        points = np.concatenate([functional.points for functional in functionals])
        weights = np.concatenate([functional.weights for functional in functionals])
        # Points in another quadrant are evaluated at their mirror image in the cell, with the signs of the parity.
        folded, images = fold(points, self.mesh.mirrors)
        values = interpolation(self.space, folded)
        starts = np.cumsum([0] + [functional.points.size for functional in functionals])
        signed = (weights * parity_signs(parity, images)).ravel()
        pick = sp.csr_matrix((signed, np.arange(points.size), starts), shape=(len(functionals), points.size))
        return pick @ sp.kron(values, sp.eye(3), format="csr")

    def _condense(self, loaded, parities, moved: tuple, loaded_by: tuple) -> tuple[np.ndarray, np.ndarray]:
        """Weak displacements (components in `moved` * n) and gauge rows (q, g) under nodal tractions (components in
        `loaded_by` * n). Raises `MemoryEstimateError` if this does not fit into memory."""
        cells, unfactored = len(self.space.mesh.tets), len(set(parities) - set(self._factors))
        refuse_reduction(cells, self.space.unknowns, len(loaded.patch.xy), unfactored, self.mesh.size_mm)
        functionals = gauge_functionals(self.finger, self.surfaces["interface"])
        n = len(loaded.patch.xy)
        compliance, influence = np.zeros((len(moved) * n, len(loaded_by) * n)), []
        for parity in parities:
            loads = [loaded.loads(parity, component) for component in range(3)]
            felt = sp.hstack([loads[c] for c in moved], format="csc").T
            rows, pushed = self.rows(functionals, parity), sp.hstack([loads[c] for c in loaded_by], format="csc")
            solved = []
            # In batches of right-hand sides: all responses at once would need too much memory.
            for first in range(0, pushed.shape[1], RIGHT_SIDES_AT_ONCE):
                block = slice(first, first + RIGHT_SIDES_AT_ONCE)
                solution = self._solve(parity, pushed[:, block].toarray())[: pushed.shape[0]] / len(parities)
                # What the patch feels under its own unit tractions: the displacement weighted by the same loads
                # (reciprocity makes it symmetric).
                compliance[:, block] += felt @ solution
                solved.append(rows @ solution)
            influence.append(np.hstack(solved))
        return compliance, np.sum(influence, axis=0).reshape(len(GAUGE_QUANTITIES), len(self.finger.gauges), -1)


def layers_below(finger: Finger, surfaces: Mapping[str, Surface], frame: Frame, mesh: LayeredMesh) -> np.ndarray:
    """Thickness (mm) and Young's modulus (MPa) (k, 2) of the layers below a touch-down point, down to a clamped
    surface: a rigid bone or the base plane."""
    # Walk down along the inward normal and note where the levels of the surfaces change sign. A level is positive
    # outside of its surface; the walk is longer than the finger, so that it meets the base in any case.
    down = np.linspace(0, 2 * np.abs(mesh.points).max(), WALK_POINTS)[1:]
    points = frame.origin - down[:, None] * frame.axes[2]
    levels = [surfaces["interface"].level(points), surfaces["bone"].level(points)]
    *ends, base = (_crossing(down, level) for level in (*levels, points[:, 2] - mesh.points[:, 2].min()))
    moduli = [layer.modulus for layer in (finger.outer, finger.inner, finger.bone) if layer]
    # The last layer ends at the clamped surface: the bone if it is rigid, else the base. Nothing is below the base.
    depths = np.minimum([*ends, base][: len(moduli)], base)
    thickness = np.diff(np.maximum.accumulate(np.append(0, depths)))
    return np.column_stack([thickness, moduli])[thickness > 0]


def tangential_of(finger: Finger, mesh: LayeredMesh, element: str, at: tuple[float, float]):
    """The effect of tangential tractions on a reduced finger, from its model or, if that no longer exists, from a new
    one."""
    return model_of(finger, mesh, element).reduce_tangential(at)


def model_of(finger: Finger, mesh: LayeredMesh, element: str = DEFAULT_ELEMENT) -> FingerModel:
    """The model of a finger on a mesh, which may already be factorised; the latest one is kept alive."""
    model = _LIVING.get((finger.sha256, mesh.sha256, element)) or FingerModel(finger, mesh, element)
    _LATEST[:] = [model]
    return model


def _crossing(down: np.ndarray, level: np.ndarray) -> float:
    """Distance at which a level (k,), given at distances (k,), first falls below zero; infinity if it does not."""
    k = int((level <= 0).argmax())
    if level[k] > 0:
        return np.inf
    return float(np.interp(0.0, -level[k - 1 : k + 1], down[k - 1 : k + 1])) if k else float(down[0])
