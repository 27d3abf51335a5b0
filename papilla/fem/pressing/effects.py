"""Effects that other presses leave out: adhesion, silicone that relaxes, gauges that are stiff foils, and own weight.

Adhesion holds the contact area open, so the same area needs a smaller force F than the force P of a frictionless press
without adhesion. The two states differ by a flat punch that is pulled with P - F. Equilibrium of the edge, with work of
adhesion w, requires

  (P - F)^2 / 2 * (-dC/dA) = w,

where C is the punch's compliance and A the contact area (Shull 2002, doi:10.1016/S0927-796X(01)00039-0; for a sphere on
a half-space this is JKR, doi:10.1098/rspa.1971.0141). Pressure vanishes at the edge, so a growing contact costs no
energy there, and C is the slope of indentation against force of the press itself. So w is assumed to be even along the
edge.

Relaxation: both layers have one Prony series; the specimen is elastic. Under pressures p(s) the displacement of the
finger is its elastic displacement under

  P(t) = integral of E(0) J(t - s) dp(s),

and the same holds for the gauges. If p is linear over a step, then P = a p + m, with m known from the earlier steps.
Each step is therefore an elastic contact with compliance a A_finger + A_specimen and a gap that has grown by A_finger
m. While the contact grows on a rigid specimen this is Lee and Radok's solution; it also holds while the contact
shrinks.

Foils: the membrane stiffness of the gauges is part of the finger's matrix, on the area of their backings. The bending
stiffness k acts on the curvature of the backing that a gauge measures, one more spring for each gauge. With the gauge's
functional c the solution is corrected without a new factorisation (Woodbury):

  (K + k c c^T)^-1 f = u - K^-1 c k (c . u) / (1 + k c . K^-1 c),    u = K^-1 f.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from time import perf_counter

import numpy as np
import scipy.sparse as sp
from numpy.polynomial import Polynomial
from numpy.typing import ArrayLike
from scipy.optimize import brentq
from skfem import Basis, BilinearForm, ElementVector, FacetBasis, LinearForm
from skfem.helpers import ddot, grad

from papilla import checks
from papilla.errors import InputError, SolverError
from papilla.fem.discrete.assembly import scaled
from papilla.fem.discrete.elements import parity_signs
from papilla.fem.pressing.contact import contact_press
from papilla.fem.pressing.contact_path import ContactProblem
from papilla.fem.pressing.contact_step import StepState, contact_step, first_touch
from papilla.fem.pressing.press import Press, check_scene, refuse_detail, refuse_rim
from papilla.fem.reduction.finger_model import FingerModel
from papilla.fem.reduction.gauges import curvature_functional, gauge_frame
from papilla.fem.reduction.patch import weak_gap
from papilla.fem.reduction.reduced import ReducedFinger
from papilla.finger import Finger
from papilla.mesh.layered import LayeredMesh
from papilla.references.viscoelastic import Prony
from papilla.short_repr import short_repr
from papilla.specimen import Specimen
from papilla.units import GRAVITY_N_MM3, J_M2_PER_N_MM, MICROSTRAIN_PER_STRAIN, N_MM_PER_J_M2, TINY, to_microstrain

KNOTS, DEGREE = 17, 4
"""Number of presses along the force, and the degree of the polynomials of ln indentation and ln area over ln force:
their slopes vary smoothly."""

STEP = 0.05
"""Relative step of the force over which readings and pressure are differentiated."""

WIDER, WIDEST = 1.6, 12
"""Factor by which the range of forces grows, and the largest number of times, until the range contains the press that
makes the contact."""


FOIL_NU = 0.34
"""Poisson's ratio of polyimide."""

INDICATOR_ORDER = 8
"""Order of the quadrature on the interface's triangles, because backings end inside them."""

BENT_ORDER = 4
"""Order of the quadrature over cells with bent edges."""


def adhesive_press(reduced: ReducedFinger, specimen: Specimen, work_J_m2: float, *, force_N: float) -> Press:
    """The linear, frictionless press by a force (N) on a specimen with a work of adhesion (J/m2, which equals mN/mm).

    Raises `ContactRangeError` if the contact area that adhesion produces is too large for `press`, and `InputError` as
    `press` does.
    """
    began = perf_counter()
    force, _ = check_scene(specimen, reduced.outer_modulus, reduced.patch.finest_edge, force_N=force_N)
    assert force is not None
    work = N_MM_PER_J_M2 * checks.positive("work of adhesion (J/m2)", work_J_m2)

    def plain(load: float) -> Press:
        return contact_press(reduced, specimen, (float(load), None))

    holding = _holding_force(plain, force, work)
    found, less, more = (plain(holding * factor) for factor in (1, 1 - STEP, 1 + STEP))
    pull = (holding - force) / (more.force - less.force)
    status = f"{found.status}; adhesion holds the contact of {holding:.3g} N"
    return replace(
        found,
        seconds=perf_counter() - began,
        values=found.values - pull * (more.values - less.values),
        force=force,
        indentation=found.indentation - pull * (more.indentation - less.indentation),
        finger_share=np.nan,
        status=status,
        pressure=found.pressure - pull * (more.pressure - less.pressure),
    )


def _holding_force(plain, force: float, work: float) -> float:
    """The force (N) of the press without adhesion whose contact is that of `force` (N) with `work` (N/mm)."""
    top = WIDER * force
    for _ in range(WIDEST):
        forces = np.geomspace(force / 2, top, KNOTS)
        presses = [plain(load) for load in forces]
        depth, area = (
            Polynomial.fit(np.log(forces), np.log([getattr(one, name) for one in presses]), DEGREE)
            for name in ("indentation", "contact_area")
        )

        def excess(load: float, depth=depth, area=area) -> float:
            x = np.log(load)
            slope, bend = depth.deriv()(x), depth.deriv(2)(x)
            # C = dd/dP; with d = exp(depth), dC/dA = d / P^2 (slope^2 - slope + bend) over A' = A area' / P
            stiffening = -np.exp(depth(x) - area(x)) * (slope**2 - slope + bend) / (load * area.deriv()(x))
            return float(load - np.sqrt(2 * work / max(stiffening, TINY)) - force)

        if excess(top) > 0:
            return float(brentq(excess, force, top, rtol=1e-9))
        top *= WIDER
    raise SolverError(
        f"no contact found that {J_M2_PER_N_MM * work:g} J/m2 hold at {force:g} N: adhesion outweighs the force"
    )


@dataclass(frozen=True, eq=False)
class CreepingPress:
    """A history of n states; g gauges, q quantities of a gauge.

    time_s, force (N), indentation (mm) : (n,). values : (n, q, g) what the gauges feel. reading : (n, g), microstrain.
    """

    time_s: np.ndarray
    force: np.ndarray
    indentation: np.ndarray
    values: np.ndarray
    reading: np.ndarray

    __repr__ = short_repr

    @property
    def lost_work(self) -> float:
        """Energy that the history dissipated, N mm: the area of its loop, if it ends at the state in which it began."""
        return float(np.trapezoid(self.force, self.indentation))


def creeping_press(
    reduced: ReducedFinger,
    specimen: Specimen,
    prony: Prony,
    time_s: ArrayLike,
    *,
    force: ArrayLike | None = None,
    indentation: ArrayLike | None = None,
) -> CreepingPress:
    """Press a specimen along a history of force (N) or indentation (mm), small-strain and without friction.

    The finger's moduli are the instantaneous ones, E(0). time_s : (n,) rising. The first state is reached in a jump;
    between states pressures change linearly. Steps of a tenth of the shortest relaxation time are accurate to 1e-3.
    Raises `InputError` for histories that do not fit together or are not positive, `ContactRangeError` where the
    contact reaches the rim of its patch, or is smaller than the mesh can resolve.
    """
    time = np.asarray(time_s, float)
    if (force is None) == (indentation is None):
        raise InputError("give exactly one history, of force or of indentation")
    load = np.asarray(force if indentation is None else indentation, float)
    if time.ndim != 1 or time.shape != load.shape or not len(time) or not (np.diff(time) > 0).all():
        raise InputError("a history needs as many loads as times, and times that rise")
    if not (np.isfinite(load).all() and (load > 0).all()):
        raise InputError("every force or indentation of a history must be greater than 0")
    refuse_detail(specimen, reduced.patch, reduced.mesh_size_mm)
    gap, images = weak_gap(reduced.patch, specimen), reduced.multiplicity
    theirs, mass = reduced.specimen_compliance(specimen), reduced.patch.mass
    rows: list[tuple[float, float, np.ndarray]] = []
    memory = _Memory(prony, len(mass))
    state: StepState | None = None
    for step, value in zip(np.diff(time, prepend=time[0]), load.tolist(), strict=True):
        more, left = memory.over(float(step))
        wanted = {"indentation": value} if force is None else {"force": value / images}
        problem = ContactProblem(more * reduced.compliance + theirs, mass, gap + reduced.compliance @ left)
        state = contact_step(problem, state or first_touch(problem), **wanted)
        refuse_rim(reduced.patch, state.active)
        pressure = state.traction[0]
        memory.accept(pressure, float(step))
        rows.append((images * state.force, state.indentation, reduced.rows @ (more * pressure + left)))
    forces, depths, values = (np.array(column) for column in zip(*rows, strict=True))
    reading = to_microstrain((reduced.weights * values).sum(axis=1))
    return CreepingPress(time, forces, depths, values, reading)


class _Memory:
    """Effect of earlier pressures (n,) on the present displacement; only `accept` changes it."""

    def __init__(self, prony: Prony, nodes: int):
        self.terms, self.pressure = prony.retardation, np.zeros(nodes)
        self.kept = [np.zeros(nodes) for _ in self.terms]

    def over(self, step: float) -> tuple[float, np.ndarray]:
        """Factor a and pressure m (n,) of P = a p + m, `step` seconds later."""
        more, left = 1.0, np.zeros_like(self.pressure)
        for (share, tau), kept in zip(self.terms, self.kept, strict=True):
            fade, mean = _decay(step, tau)
            more += share * (1 - mean)
            left += share * (mean * self.pressure - fade * kept)
        return more, left

    def accept(self, pressure: np.ndarray, step: float) -> None:
        """Advance by `step` with the pressure (n,) that was found."""
        for k, (_, tau) in enumerate(self.terms):
            fade, mean = _decay(step, tau)
            self.kept[k] = fade * self.kept[k] + mean * (pressure - self.pressure)
        self.pressure = pressure


def _decay(step: float, tau: float) -> tuple[float, float]:
    """exp(-step / tau), and its mean over the step."""
    fade = float(np.exp(-step / tau))
    return fade, (1 - fade) * tau / step if step > 0 else 1.0


class FoiledModel(FingerModel):
    """`FingerModel` with foils of `membrane` (E t / (1 - nu^2), N/mm) and `bending` (N mm) stiffness.

    A polyimide foil of 0.1 mm has 300 N/mm and 0.25 N mm. Raises `InputError` for negative values.
    """

    def __init__(self, finger: Finger, mesh: LayeredMesh, membrane: float, bending: float = 0.0):
        super().__init__(finger, mesh)
        self.membrane = checks.within("foil membrane (N/mm)", membrane, 0.0, 1e9)
        self.bending = checks.within("foil bending (N mm)", bending, 0.0, 1e9)
        self._frames = [(gauge, gauge_frame(finger, gauge, self.surfaces["interface"])) for gauge in finger.gauges]
        self._springs: dict[tuple[int, int], tuple[sp.csr_matrix, np.ndarray, np.ndarray]] = {}

    @cached_property
    def matrix(self) -> sp.csc_matrix:
        """Lower triangle of the dimensionless matrix, with the foils' membranes."""
        facets = self.space.facets(self.space.mesh.boundaries["interface"])
        element = ElementVector(self.space.scalar_element)
        basis = FacetBasis(self.space.skmesh, element, facets=facets, intorder=INDICATOR_ORDER)
        cover = self._cover(np.asarray(basis.global_coordinates()))

        @BilinearForm
        def membrane(u, v, w):
            tangent = np.eye(3)[:, :, None, None] - np.einsum("i...,j...->ij...", w.n, w.n)
            strains = [np.einsum("ik...,kl...,lj...->ij...", tangent, grad(x), tangent) for x in (u, v)]
            first, second = ((one + one.swapaxes(0, 1)) / 2 for one in strains)
            trace = np.einsum("ii...->...", first) * np.einsum("ii...->...", second)
            return cover * ((1 - FOIL_NU) * ddot(first, second) + FOIL_NU * trace)

        size = self.space.unknowns
        foil = sp.tril(self.membrane * membrane.assemble(basis)).tocoo()
        whole = sp.csc_matrix((foil.data, (foil.row, foil.col)), shape=(size, size))
        return (super().matrix + scaled(whole, self._scale)).tocsc()

    def _cover(self, points: np.ndarray) -> np.ndarray:
        """Number of backings, mirror images included, that cover points (3, ...) of the cell's interface."""
        total = np.zeros(points.shape[1:])
        for gauge, frame in self._frames:
            for sign in (np.array([*image, 1]) for image in _images(self.mesh)):
                offset = points * sign[:, None, None] - frame.site[:, None, None]
                sides = zip((frame.along, frame.across), gauge.backing_mm, strict=True)
                inside = [np.abs(np.einsum("i,i...->...", axis, offset)) <= side / 2 for axis, side in sides]
                near = np.einsum("i,i...->...", frame.normal, offset) > -max(gauge.backing_mm)
                total += inside[0] & inside[1] & near
        return total

    def _solve(self, parity: tuple[int, int], load: np.ndarray) -> np.ndarray:
        """Displacement (3 * nodes, k) under displacement loads (3 * nodes, k)."""
        found = super()._solve(parity, load)
        if self.bending == 0:
            return found
        if parity not in self._springs:
            functionals = [curvature_functional(*pair, self.surfaces["interface"]) for pair in self._frames]
            rows = self.rows(functionals, parity)
            moved = super()._solve(parity, rows.T.toarray())
            areas = np.array([np.prod(gauge.backing_mm) for gauge, _ in self._frames])
            soft = np.diag(len(self._all_parities()) / (self.bending * areas))
            self._springs[parity] = rows, moved, np.linalg.inv(soft + rows @ moved)
        rows, moved, stiff = self._springs[parity]
        return found - moved @ (stiff @ (rows @ found))


def weight_readings(model: FingerModel, density_g_cm3: float = 1.0) -> np.ndarray:
    """Readings (g,) in microstrain under the finger's own weight, which acts from the apex towards the base."""
    # Integrals (nodes,) of the displacement's shape functions over the cell, mm3
    basis = Basis(model.space.skmesh, model.space.scalar_element, intorder=BENT_ORDER)
    nodes = LinearForm(lambda v, w: v).assemble(basis)
    total = np.zeros(len(model.finger.gauges))
    for parity, field in model.reading_adjoints().items():
        signs = sum(parity_signs(parity, image)[..., 2] for image in _images(model.mesh))
        total += signs * np.einsum("n,ng->g", nodes, field[:, 2])
    return -MICROSTRAIN_PER_STRAIN * GRAVITY_N_MM3 * checks.positive("density (g/cm3)", density_g_cm3) * total


def _images(mesh: LayeredMesh) -> list[np.ndarray]:
    """Signs (2,) along x and y of the cell's images by the mirrors of the mesh."""
    return [np.array(signs) for signs in product(*((1, -1) if axis in mesh.mirrors else (1,) for axis in "xy"))]
