"""Adhesion between finger and specimen, computed from presses without adhesion.

Adhesion holds the contact area open, so the same area needs a smaller force F than the force P of a frictionless press
without adhesion. The two states differ by a flat punch that is pulled with P - F. Equilibrium of the edge, with work of
adhesion w, requires

  (P - F)^2 / 2 * (-dC/dA) = w,

where C is the punch's compliance and A the contact area (Shull 2002, doi:10.1016/S0927-796X(01)00039-0; for a sphere on
a half-space this is JKR, doi:10.1098/rspa.1971.0141). Pressure vanishes at the edge, so a growing contact costs no
energy there, and C is the slope of indentation against force of the press itself. So w is assumed to be even along the
edge.
"""

from dataclasses import replace
from time import perf_counter

import numpy as np
from numpy.polynomial import Polynomial
from scipy.optimize import brentq

from papilla import checks
from papilla.errors import SolverError
from papilla.fem.pressing.contact import contact_press
from papilla.fem.pressing.press import Press, check_scene
from papilla.fem.reduction.reduced import ReducedFinger
from papilla.specimen import Specimen
from papilla.units import J_M2_PER_N_MM, N_MM_PER_J_M2, TINY

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
        return contact_press(reduced, specimen, (float(load), None), began=began)

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
