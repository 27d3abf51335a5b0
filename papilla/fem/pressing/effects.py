"""Presses of the condensed finger with an effect that other presses leave out: adhesion, and silicone that relaxes.

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
"""

from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from papilla import checks
from papilla.errors import InputError, SolverError
from papilla.fem.pressing.contact import contact_press
from papilla.fem.pressing.contact_path import ContactProblem
from papilla.fem.pressing.contact_step import StepState, contact_step, first_touch
from papilla.fem.pressing.press import Press, check_scene, refuse_detail, refuse_rim
from papilla.fem.reduction.patch import weak_gap
from papilla.fem.reduction.reduced import ReducedFinger
from papilla.references.viscoelastic import Prony
from papilla.short_repr import short_repr
from papilla.specimen import Specimen
from papilla.units import J_M2_PER_N_MM, N_MM_PER_J_M2, TINY, to_microstrain

KNOTS, DEGREE = 17, 4
"""Number of presses along the force, and the degree of the polynomials of ln indentation and ln area over ln force:
their slopes vary smoothly."""

STEP = 0.05
"""Relative step of the force over which readings and pressure are differentiated."""

WIDER, WIDEST = 1.6, 12
"""Factor by which the range of forces grows, and the largest number of times, until the range contains the press that
makes the contact."""


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
