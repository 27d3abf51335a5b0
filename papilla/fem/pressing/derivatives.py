"""Derivatives of a linear press without friction, of force, indentation and gauges, by all that it depends on.

While the nodes in contact stay the same, pressure p and indentation d solve A p + g = d m, m . p = F, with A the
compliance of finger and specimen, g the weak gap and m the mass of the nodes. So a derivative by a parameter t is one
more solve with the factor of A: A p' = d' m - g' - A' p, and gauges feel R p' + R' p. Where a node enters or leaves the
contact the derivative jumps by little: pressures there are zero. What `press` adds where a contact is of few elements
is not in it.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from papilla.fem.pressing.contact import contact_press
from papilla.fem.pressing.press import Press, check_scene
from papilla.fem.reduction.compliance import weak_gap
from papilla.fem.reduction.family import FingerFamily
from papilla.fem.reduction.finger_model import FingerModel
from papilla.fem.reduction.reduced import ReducedFinger
from papilla.fem.reduction.transported import transported_readings
from papilla.specimen import Specimen
from papilla.units import to_microstrain

STEP = 1e-3
"""Relative change of a specimen's measure, up and down, from which its compliance and gap tell their derivatives."""

PLACE_STEP = 0.05
"""Of the touch-down point (mm): the readings are smooth in it over the contact's millimetres."""


@dataclass(frozen=True, eq=False)
class Slope:
    """Derivatives of a press by one parameter: of its force (N), indentation (mm) and gauges' values (q, g)."""

    force: float
    indentation: float
    values: np.ndarray

    def readings(self, weights: np.ndarray) -> np.ndarray:
        """Derivatives (g,) of the readings (microstrain), their weights (q, g) being fixed."""
        return to_microstrain((weights * self.values).sum(axis=0))


@dataclass(frozen=True, eq=False)
class PressSlopes:
    """A press, and its derivatives by parameter, in the parameter's unit (MPa, mm, N).

    by : "outer_modulus" and "inner_modulus"; each measure of the specimen, such as "specimen_modulus" and
    "specimen_thickness"; and the load, "force" or "indentation", whichever was given.
    """

    press: Press
    by: Mapping[str, Slope]


def press_slopes(
    relatives: FingerFamily,
    outer: float,
    inner: float,
    specimen: Specimen,
    *,
    force: float | None = None,
    indentation: float | None = None,
) -> PressSlopes:
    """The linear frictionless press of a family's finger with moduli `outer` and `inner` (MPa), with its derivatives.

    It is the contact of the nodes alone (`on_nodes`): what a light press takes from its ellipse is not in it.
    force (N) or indentation (mm) : the one that is given is kept when anything else changes. By a touch-down that is
    told t mm early: a depth of the bench is indentation + t, so by t the derivatives at a given depth are those by
    indentation, with the other sign. Raises what `press` and `FingerFamily.at` raise.
    """
    reduced = relatives.at(outer, inner)
    check_scene(specimen, reduced.outer_modulus, reduced.patch.finest_edge, force=force, indentation=indentation)
    found = contact_press(reduced, specimen, force, indentation, None, 0.0)
    system = _Linearised(reduced, specimen, found, keeps_force=force is not None)
    finger = relatives.slope(outer, inner)
    by = {
        f"{layer}_modulus": system.slope(finger["compliance"][k], finger["rows"][k])
        for k, layer in enumerate(("outer", "inner"))
    }
    for item in fields(specimen):
        value = getattr(specimen, item.name)
        if isinstance(value, float | int) and not isinstance(value, bool):
            by[f"specimen_{item.name}"] = system.slope(*_of_specimen(reduced, specimen, item.name, float(value)))
    by["force" if force is not None else "indentation"] = system.by_load()
    return PressSlopes(found, by)


def place_slope(model: FingerModel, reduced: ReducedFinger, found: Press) -> np.ndarray:
    """Derivative (g,) of a press's readings by the x of its touch-down point, microstrain / mm, at the apex.

    model : of the finger that `reduced` is of. The press's tractions move with the skin (`transported_readings`); its
    force and indentation do not change, by symmetry. Raises `InputError` for another finger's model.
    """
    steps = [-PLACE_STEP, PLACE_STEP]
    back, forth = transported_readings(model, reduced.patch, found.traction[None], steps)[:, 0]
    return (forth - back) / (2 * PLACE_STEP)


class _Linearised:
    """The equations of a solved press with its nodes in contact, factorised."""

    def __init__(self, reduced: ReducedFinger, specimen: Specimen, found: Press, keeps_force: bool):
        self.reduced, self.found, self.keeps_force = reduced, found, keeps_force
        self.index = np.flatnonzero(found.active)
        self.mass = reduced.patch.mass[self.index]
        matrix = reduced.total_compliance(specimen)
        self.factor = cho_factor(matrix[np.ix_(self.index, self.index)])
        self.per_depth = cho_solve(self.factor, self.mass)
        self.stiffness = float(reduced.multiplicity * self.mass @ self.per_depth)

    def slope(self, compliance: np.ndarray, rows: np.ndarray | float = 0.0, gap: np.ndarray | None = None) -> Slope:
        """By a parameter with these derivatives of compliance (n, n), gauges' rows (q, g, n) and weak gap (n,)."""
        pressure = self.found.pressure
        right = -(compliance @ pressure)[self.index]
        if gap is not None:
            right -= gap[self.index]
        change = cho_solve(self.factor, right)
        force, depth = float(self.reduced.multiplicity * self.mass @ change), 0.0
        if self.keeps_force:
            depth = -force / self.stiffness
            change, force = change + depth * self.per_depth, 0.0
        return Slope(force, depth, self._felt(change) + np.sum(rows * pressure, axis=-1))

    def by_load(self) -> Slope:
        """By the force or the indentation, whichever is given."""
        if self.keeps_force:
            return Slope(1.0, 1 / self.stiffness, self._felt(self.per_depth) / self.stiffness)
        return Slope(self.stiffness, 1.0, self._felt(self.per_depth))

    def _felt(self, change: np.ndarray) -> np.ndarray:
        return self.reduced.rows[..., self.index] @ change


def _of_specimen(reduced: ReducedFinger, specimen: Specimen, name: str, value: float) -> tuple:
    """Derivatives by a measure of the specimen: compliance (n, n), nothing of the rows, and weak gap (n,)."""
    step = STEP * value
    if name == "nu" and value + step > 0.5:
        step = 0.5 - value or STEP * value
    sides = [replace(specimen, **{name: value + sign * step}) for sign in (1, -1)]
    up, down = (reduced.specimen_compliance(one) for one in sides)
    above, below = (weak_gap(reduced.patch, one) for one in sides)
    return (up - down) / (2 * step), 0.0, (above - below) / (2 * step)
