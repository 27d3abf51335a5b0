"""Readings of a gauge, as linear functionals of the displacement.

Strain is the mean over the grid: along it the elongation between two points of the interface a grid length apart,
across it by Gauss' rule (a point gradient at the interface scatters by 12 % from mesh to mesh). Curvature change is
that of a paraboloid fitted to the outward displacement over the foil's backing. A reading is membrane_gain * strain +
lever_mm * curvature change. A further quantity is one more entry of `GAUGE_QUANTITIES`; all arrays are (quantities,
gauges, ...)."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from papilla.fem.reduction.patch import onto
from papilla.mesh.body import gauge_site
from papilla.mesh.surfaces import Surface
from papilla.model.finger import Finger, Gauge

BACKING_GRID = (9, 5)
"""Number of points of the paraboloid fit along and across the grid direction."""

GRID_LINES, LINE_SHARES = np.sqrt(0.15) * np.array([-1.0, 0.0, 1.0]), np.array([5.0, 8.0, 5.0]) / 18
"""Gauss' rule of three lines across the grid; places in grid widths."""


@dataclass(frozen=True, eq=False)
class PointFunctional:
    """A linear functional of the displacement: sum over points (k, 3) of weights (k, 3) . u(point)."""

    points: np.ndarray
    weights: np.ndarray


@dataclass(frozen=True, eq=False)
class GaugeFrame:
    """A gauge's site on the interface (3,) with its unit grid direction, cross direction and outward normal (mm)."""

    site: np.ndarray
    along: np.ndarray
    across: np.ndarray
    normal: np.ndarray


def gauge_frame(finger: Finger, gauge: Gauge, interface: Surface) -> GaugeFrame:
    """Site and directions of a gauge; the grid lies along the interface's x-z tangent, rotated by `direction_deg`."""
    site = gauge_site(finger, gauge, interface)
    normal = interface.normal(site[None])[0]
    tangent = np.array([normal[2], 0.0, -normal[0]])
    tangent /= np.linalg.norm(tangent)
    crosswise = np.cross(normal, tangent)
    turn = math.radians(gauge.direction_deg)
    along = math.cos(turn) * tangent + math.sin(turn) * crosswise
    return GaugeFrame(site, along, np.cross(normal, along), normal)


def strain_functional(gauge: Gauge, frame: GaugeFrame, interface: Surface) -> PointFunctional:
    """Mean elongation of the grid's `GRID_LINES`, each between two interface points half a grid length to either
    side."""
    half = gauge.length_mm / 2 * frame.along
    middles = frame.site + gauge.width_mm * GRID_LINES[:, None] * frame.across
    flat = np.stack([middles - half, middles + half], axis=1)
    # The lines are chords: their ends lie on the interface, which may be curved along them.
    ends = onto(interface, flat.reshape(-1, 3), frame.normal).reshape(flat.shape)
    chord = ends[:, 1] - ends[:, 0]
    weight = (LINE_SHARES / (chord**2).sum(axis=1))[:, None] * chord
    return PointFunctional(ends.reshape(-1, 3), np.stack([-weight, weight], axis=1).reshape(-1, 3))


def curvature_functional(gauge: Gauge, frame: GaugeFrame, interface: Surface) -> PointFunctional:
    """Second derivative (1/mm) along the grid of the paraboloid fitted to the outward displacement over the backing."""
    length, width = gauge.backing_mm
    s, t = np.meshgrid(*(np.linspace(-0.5, 0.5, n) for n in BACKING_GRID), indexing="ij")
    s, t = length * s.ravel(), width * t.ravel()
    flat = frame.site + s[:, None] * frame.along + t[:, None] * frame.across
    # Least squares fit w = c0 + c1 s + c2 t + c3 s^2 + ...: row 3 of the pseudoinverse gives c3, and w'' = 2 c3.
    monomials = np.stack([np.ones_like(s), s, t, s * s, s * t, t * t], axis=1)
    second_derivative = 2 * np.linalg.pinv(monomials)[3]
    return PointFunctional(onto(interface, flat, frame.normal), second_derivative[:, None] * frame.normal)


def elongation(functional: PointFunctional, moved: np.ndarray) -> float:
    """Mean (l - L)/L of the grid's lines, with ends displaced by `moved` (k, 3); no cancellation for small changes."""
    chord, change = (np.diff(ends.reshape(-1, 2, 3), axis=1)[:, 0] for ends in (functional.points, moved))
    length, longer = (np.linalg.norm(line, axis=1) for line in (chord, chord + change))
    return float(LINE_SHARES @ (((2 * chord + change) * change).sum(axis=1) / (length * (longer + length))))


def linear_value(functional: PointFunctional, moved: np.ndarray) -> float:
    """The functional's value for displacements (k, 3) of its points."""
    return float((functional.weights * moved).sum())


@dataclass(frozen=True)
class ReadingComponent:
    """A quantity that a gauge measures: a functional for small displacements, its value for finite ones, and its weight
    in a reading.

    weight : name of the field of `Gauge`.
    """

    functional: Callable[[Gauge, GaugeFrame, Surface], PointFunctional]
    weight: str
    finite: Callable[[PointFunctional, np.ndarray], float] = linear_value


GAUGE_QUANTITIES = {
    "strain": ReadingComponent(strain_functional, "membrane_gain", elongation),
    "curvature": ReadingComponent(curvature_functional, "lever_mm"),
}
"""The measured quantities, in the order of all arrays: strain, and curvature change in 1/mm."""


def gauge_functionals(finger: Finger, interface: Surface) -> list[PointFunctional]:
    """All functionals (q * g of them) of a finger's gauges, quantity by quantity."""
    frames = [(gauge, gauge_frame(finger, gauge, interface)) for gauge in finger.gauges]
    return [quantity.functional(*pair, interface) for quantity in GAUGE_QUANTITIES.values() for pair in frames]


def gauge_weights(finger: Finger) -> np.ndarray:
    """Weights (q, g) of the quantities in the readings of a finger's gauges."""
    return np.array(
        [[getattr(g, quantity.weight) for g in finger.gauges] for quantity in GAUGE_QUANTITIES.values()], float
    )
