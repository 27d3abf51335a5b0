"""Response of the gauges of a finger to presses: the responses of its family, mixed according to a vector of
parameters."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from papilla.core import checks
from papilla.core.errors import InputError
from papilla.fem.pressing.off_apex import MoveLimits, OffApex
from papilla.fem.pressing.response import RATIO_LIMITS, Response
from papilla.fem.reduction.gauges import GAUGE_QUANTITIES
from papilla.identification.parameters import CONTACT_MOVES, PARAMETERS_BY_NAME
from papilla.logs import PressLog
from papilla.model.specimen import Friction, Specimen, friction_words, physics_words

NOT_STATED = "not told"
"""Friction of presses, in records and JSON, if it is not stated: responses with and without it are mixed."""

LOAD_QUANTITIES = ("force", "modulus", "outer_modulus_MPa", "inner_modulus_MPa", "thickness_mm", "stick_share")
"""Quantities by which every press has derivatives: by their logarithms, but for the share of stick. The logarithm of
the outer modulus is that of the ratio of the moduli."""


@dataclass(frozen=True, eq=False)
class PressedShape:
    """The presses (rows of the log) on one shape of specimen, and the responses to it at rising thicknesses (mm).

    responses : one per thickness; if the friction is not known, first those with stick, then those without friction;
    `stick_share` mixes them.
    off_apex : changes by contacts beside the apex and by moved gauges; None if there are none.
    """

    rows: np.ndarray
    specimen: Specimen
    responses: tuple[Response, ...]
    thicknesses: tuple[float, ...] = ()
    off_apex: OffApex | None = None

    @property
    def friction_open(self) -> bool:
        """Whether responses with and without friction are mixed."""
        return len(self.responses) > max(len(self.thicknesses), 1)

    @property
    def friction(self) -> Friction:
        """Friction of the presses: Coulomb's coefficient, "stick", or `NOT_STATED`."""
        return NOT_STATED if self.friction_open else friction_words(self.responses[0].friction)

    @property
    def physics(self) -> str:
        """The physics of the presses in words."""
        friction = "not stated" if self.friction_open else self.friction
        return physics_words(self.specimen, friction, self.responses[0].large_strain)


@dataclass(frozen=True, eq=False)
class Known:
    """A specimen whose modulus is known to `sigma` (relative), and the rows of the log on it."""

    sigma: float
    rows: np.ndarray


@dataclass(frozen=True, eq=False)
class FeltBy:
    """Gauge values (n, q, g) and indentations (n,) in mm of n presses, with the derivatives of both by parameter name.

    changed : (n, q, g) the part of the gauge values that comes from contacts beside the apex and from moved gauges.
    """

    values: np.ndarray
    depth: np.ndarray
    changed: np.ndarray
    slopes: dict[str, np.ndarray] = field(default_factory=dict)
    depth_slopes: dict[str, np.ndarray] = field(default_factory=dict)


def felt_by(
    shapes: tuple[PressedShape, ...],
    log: PressLog,
    moduli: np.ndarray,
    values: Mapping[str, float],
    gauges: tuple[str, ...],
) -> FeltBy:
    """The presses of a log, on specimens of moduli (n,), by a finger and bench with these parameter values."""
    inner, outer = values["inner_modulus_MPa"], values["outer_modulus_MPa"]
    ratio = float(np.clip(outer / inner, *RATIO_LIMITS))
    shape_of = (len(log), len(GAUGE_QUANTITIES), len(gauges))
    felt, depth = np.zeros(shape_of), np.zeros(len(log))
    pressed = FeltBy(felt, depth, np.zeros(shape_of))
    for name in LOAD_QUANTITIES:
        pressed.slopes[name], pressed.depth_slopes[name] = np.zeros(shape_of), np.zeros(len(log))
    for shape in shapes:
        rows = shape.rows
        loads = log.force_N[rows], moduli[rows], ratio * inner, inner
        felts = [response.felt(*loads) for response in shape.responses]
        # Each response belongs to one thickness, and to stick or to no friction. Their weights are products of a
        # polynomial in ln thickness and of the share of stick, which is linear.
        weight, steep = _between(shape.thicknesses, values["thickness_mm"])
        by_share = np.zeros_like(weight)
        if shape.friction_open:
            stuck = values.get("stick_share", 1.0)
            share = np.array([stuck, 1 - stuck])
            by_share = np.kron([1.0, -1.0], weight)
            weight, steep = np.kron(share, weight), np.kron(share, steep)
        parts = (
            (felt, pressed.slopes, [a.values for a in felts], [a.slope_values for a in felts]),
            (depth, pressed.depth_slopes, [a.indentation for a in felts], [a.slope_indentation for a in felts]),
        )
        for value, slope, of_all, slopes_of_all in parts:
            value[rows] = np.tensordot(weight, of_all, 1)
            force, modulus, by_ratio = np.tensordot(weight, slopes_of_all, 1)
            # Responses depend on F / E_inner, E / E_inner and E_outer / E_inner: E_inner stands below in all three.
            by_thickness, by_stick = (np.tensordot(weights, of_all, 1) for weights in (steep, by_share))
            by = (force, modulus, by_ratio, -force - modulus - by_ratio, by_thickness, by_stick)
            for name, derivative in zip(LOAD_QUANTITIES, by, strict=True):
                slope[name][rows] = derivative
        if shape.off_apex is not None:
            _move(pressed, shape, loads, log, values, gauges)
    return pressed


def places(log: PressLog) -> np.ndarray:
    """(n, 2) touch-down points in mm; the apex if the log states none."""
    at = [getattr(log, axis) for axis in ("x_mm", "y_mm")]
    return np.column_stack([np.zeros(len(log)) if coordinate is None else coordinate for coordinate in at])


def rolled(limits: MoveLimits, values: Mapping[str, float]) -> tuple[np.ndarray, np.ndarray]:
    """Displacement (2,) in mm of the contact along x and y by the tilt of the finger, and its derivative per degree
    about y and x.

    A finger that is turned about y (from z to x) touches with the part of the skin that then faces the specimen: at
    smaller x.
    """
    per_degree = np.radians(1.0) * np.array([-1.0, 1.0]) * limits.rolling
    tilt = np.array([values["tilt_y_deg"], values["tilt_x_deg"]])
    return np.where(tilt == 0, 0.0, tilt * np.where(tilt == 0, 0.0, per_degree)), per_degree


def _move(
    felt: FeltBy,
    shape: PressedShape,
    loads: tuple[np.ndarray, np.ndarray, float, float],
    log: PressLog,
    values: Mapping[str, float],
    gauges: tuple[str, ...],
) -> None:
    """Add the changes by contacts beside the apex and by moved gauges, for the presses on one shape."""
    off_apex, rows = shape.off_apex, shape.rows
    assert off_apex is not None
    offset, per_degree = rolled(off_apex.limits, values)
    along = [values["row_along_mm"] + values[f"place_mm.{gauge}"] for gauge in gauges]
    shift = np.array([along, [values["row_across_mm"]] * len(gauges)])
    changed = off_apex.changed(*loads, places(log)[rows] + offset, shift)
    felt.values[rows] += changed.values
    felt.changed[rows] = changed.values
    by = changed.slopes
    parts = by["force"], by["modulus"], by["ratio"], -by["force"] - by["modulus"] - by["ratio"]
    for name, slope in zip(LOAD_QUANTITIES, parts, strict=False):
        felt.slopes[name][rows] += slope
    steep = np.where(np.isfinite(per_degree), per_degree, 0.0)
    moves = {"row_along_mm": by["along"], "row_across_mm": by["across"]}
    moves |= {"tilt_y_deg": steep[0] * by["x"], "tilt_x_deg": steep[1] * by["y"]}
    moves |= {f"place_mm.{gauge}": by["along"] * (np.arange(len(gauges)) == k) for k, gauge in enumerate(gauges)}
    for name, slope in moves.items():
        felt.slopes.setdefault(name, np.zeros_like(felt.values))[rows] = slope
        felt.depth_slopes.setdefault(name, np.zeros_like(felt.depth))


def needs_places(log: PressLog, free: tuple[str, ...], fixed: Mapping[str, float]) -> bool:
    """Whether the log and the parameters require contacts or gauges to be moved."""
    moved = any(value != 0 for name, value in fixed.items() if name.split(".")[0] in CONTACT_MOVES)
    return moved or bool(places(log).any()) or any(name.split(".")[0] in CONTACT_MOVES for name in free)


def refuse_far(log: PressLog, limits: MoveLimits, free: tuple[str, ...]) -> None:
    """Raise `InputError` for contacts too far from the apex, or for a tilt that no press could determine."""
    room = np.full(2, limits.reach)
    for axis, name in enumerate(("tilt_y_deg", "tilt_x_deg")):
        if name in free:
            if not np.isfinite(limits.rolling[axis]):
                raise InputError(f"{name} cannot be free: the skin is straight along {'xy'[axis]}")
            room[axis] -= np.radians(PARAMETERS_BY_NAME[name].high) * limits.rolling[axis]
    if (far := np.abs(places(log)) > room + checks.ROUNDING_SHARE).any():
        press, axis = (int(index) for index in np.argwhere(far)[0])
        raise InputError(
            f"{'xy'[axis]}_mm is {places(log)[press, axis]:g} in press {press + 1}: contacts are known within "
            f"{max(room[axis], 0.0):.3g} mm of the apex{', tilt included' if room[axis] < limits.reach else ''}"
        )


def _between(thicknesses: tuple[float, ...], thickness: float) -> tuple[np.ndarray, np.ndarray]:
    """Weights of the responses at their thicknesses, and their derivatives by the logarithm of the thickness
    (Lagrange)."""
    if len(thicknesses) < 2:
        return np.ones(1), np.zeros(1)
    nodes, at = np.log(thicknesses), np.log(thickness)
    powers = np.vander(nodes, increasing=True)
    degree = np.arange(len(nodes))
    steep = degree * np.concatenate([[0.0], at ** degree[:-1]])
    return np.linalg.solve(powers.T, at**degree), np.linalg.solve(powers.T, steep)
