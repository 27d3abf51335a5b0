"""Readings, with slopes, of gauges at any place of the interface, for touches at the apex and away from it.

The adjoint fields of gauges at all sites of a quarter of the interface are solved once. The tractions of presses at the
apex are moved along the skin (`papilla.fem.pressing.off_apex`), and their work on these fields gives the readings.
The other three quarters are mirror images, touched at the mirrored place. Polynomials over force and modulus are fitted
to 140 presses, without friction and stuck. Presses are linear: large strain would change readings by some per cent.
"""

from dataclasses import dataclass, replace
from itertools import product

import numpy as np
import scipy.sparse as sp

from papilla.core.errors import InputError
from papilla.core.progress import Progress, silent
from papilla.core.units import to_microstrain
from papilla.design.geometry import FRICTION_ENDS, MESHED_DEG
from papilla.design.places import Places, foil_of, half_length
from papilla.design.scene import DesignScene
from papilla.fem.finite.strain_tables import RELATIVE_ELEMENT_SIZE
from papilla.fem.pressing.fidelity import press_grid
from papilla.fem.pressing.off_apex import MovedContact, on_each_side
from papilla.fem.pressing.response import LogPolynomial
from papilla.fem.reduction.finger_model import FingerModel
from papilla.fem.reduction.gauges import gauge_functionals, gauge_weights
from papilla.mesh import build
from papilla.mesh.body import narrowest_mm
from papilla.model.finger import Finger, Gauge

STEP_MM = 0.5
"""Half the distance of the two touches whose difference gives the slope by the place."""
PRESS_DEGREES, PRESS_TOTAL_DEGREE = (3, 5), 1.5
"""Degrees of the polynomial in ln force and ln modulus for the presses of a scene."""
INFLUENCE_DIRECTIONS_DEG = (0.0, 90.0)
"""Directions along which gauges may lie."""


@dataclass(frozen=True, eq=False)
class Influence:
    """Readings in microstrain of gauges at k places in p touches: the points of a scene, each touched at two places.

    gauges : at the places. sites : (k, 3) in mm. reading : (p, k) in stuck touches; slopes (5, p, k) : by ln E, by ln
    force, change without friction, and by the place x and y (1/mm). force_N : (p,).
    """

    gauges: tuple[Gauge, ...]
    sites: np.ndarray
    reading: np.ndarray
    slopes: np.ndarray
    force_N: np.ndarray


def influence(finger: Finger, scene: DesignScene, progress: Progress = silent) -> Influence:
    """The influence for a finger in a scene, touched at the apex and at `scene.place_mm` beside it in x and y.

    Raises `InputError` if a press of the scene leaves the range of the model.
    """
    foil = foil_of(finger.gauges)
    everywhere = replace(Places.whole(foil), turned=True)
    quarter = [gauge for gauge in everywhere.gauges(finger.shape) if gauge.direction_deg in INFLUENCE_DIRECTIONS_DEG]
    first = finger.gauges[0]
    quarter = [replace(gauge, membrane_gain=first.membrane_gain, lever_mm=first.lever_mm) for gauge in quarter]
    meshed = tuple(Gauge(f"g{k}", angle_deg=angle) for k, angle in enumerate(MESHED_DEG))
    size = RELATIVE_ELEMENT_SIZE * narrowest_mm(finger)
    mesh = build(replace(finger, gauges=meshed), size_mm=size, progress=progress)
    model = FingerModel(replace(finger, gauges=tuple(quarter)), mesh)
    progress("reducing the finger")
    reduced = model.reduce()
    tractions = [_tractions(reduced, finger, scene, friction, progress) for friction in FRICTION_ENDS]
    progress(f"gauges at {len(quarter)} places")
    functionals = gauge_functionals(model.finger, model.surfaces["interface"])
    mixing = sp.hstack([sp.diags(weight) for weight in gauge_weights(model.finger)])
    fields = on_each_side(model.adjoints(functionals, None, mixing))

    def read(x: float, y: float) -> np.ndarray:
        """(2, n, k) readings over force of touches at (x, y) mm, without friction and stuck."""
        rows = MovedContact.at(model, reduced.patch, (x, y)).rows(fields)
        readings = np.array([np.einsum("kcn,mcn->mk", rows, gauge, optimize=True) for gauge in tractions])
        return to_microstrain(readings) / scene.grid[0][:, None]

    return _everywhere(quarter, finger, scene, read, progress)


def _tractions(reduced, finger: Finger, scene: DesignScene, friction, progress) -> np.ndarray:
    """(n, 3, nodes) tractions of the presses of the scene's grid."""
    progress("presses of the scene" + (", stuck" if friction else ""))
    forces, moduli = (np.unique(axis) for axis in scene.grid)
    presses = press_grid(reduced, map(finger.bench.specimen, moduli.tolist()), forces, friction)
    by_modulus = [press for _, press in presses]
    if refused := next((press for press in by_modulus if isinstance(press, Exception)), None):
        raise InputError(f"a press of the scene leaves what the model covers: {refused}")
    table = np.array([press.traction for press in by_modulus])  # type: ignore[union-attr]
    return np.moveaxis(table.reshape(len(moduli), len(forces), *table.shape[1:]), 1, 0).reshape(table.shape)


def _everywhere(quarter: list[Gauge], finger: Finger, scene: DesignScene, read, progress) -> Influence:
    """The influence of gauges in all quarters, from touches in all quarters of gauges in one quarter."""
    force, modulus = scene.grid
    limits = (force.min(), force.max()), (modulus.min(), modulus.max())
    # A reading over force is smooth in ln f and ln E: a polynomial, fitted to the presses of the grid, gives it and its
    # two slopes at the points of the scene.
    polynomial = LogPolynomial(limits, PRESS_DEGREES, PRESS_TOTAL_DEGREE)
    solve = np.linalg.pinv(polynomial.terms((force, modulus))[0])
    at = [axis.ravel() for axis in np.meshgrid(*scene.points, indexing="ij")]
    terms = polynomial.terms((at[0], at[1]))
    gauges: list[Gauge] = []
    columns: list[np.ndarray] = []
    h, off = STEP_MM, scene.place_mm
    for sx, sy in product((1, -1), (1, -1)):
        progress(f"touches seen from quarter {2 * (sx < 0) + (sy < 0) + 1} of 4")
        # A gauge on a plane of symmetry is its own mirror image, and is kept once.
        imaged = [k for k, gauge in enumerate(quarter) if (sx > 0 or gauge.angle_deg) and (sy > 0 or gauge.y_mm)]
        parts = []
        # A gauge in another quarter reads at (x, y) what its image in this quarter reads at (sx x, sy y).
        for x, y in ((0.0, 0.0), (sx * off, sy * off)):
            centre, east, west, north, south = (
                np.einsum("tpm,mn,enk->etpk", terms, solve, read(*place)[:, :, imaged])
                for place in ((x, y), (x + h, y), (x - h, y), (x, y + h), (x, y - h))
            )
            force_N = at[0][:, None]
            value, by_force, by_modulus = centre[1]
            free = centre[0, 0] - value
            along, across = (sx * (east - west)[1, 0], sy * (north - south)[1, 0])
            # d (f r) / d ln f = f (r + d r / d ln f): the reading is the value r times the force.
            rows = [value, by_modulus, value + by_force, free, along / (2 * h), across / (2 * h)]
            parts.append(force_N * np.array(rows))
        columns.append(np.concatenate(parts, axis=1))
        gauges += [_mirrored(quarter[k], sx, sy) for k in imaged]
    table = np.concatenate(columns, axis=2)
    gauges = [replace(gauge, name=f"p{k}") for k, gauge in enumerate(gauges)]
    return Influence(tuple(gauges), _sites(gauges, finger), table[0], table[1:], np.tile(at[0], 2))


def _mirrored(gauge: Gauge, sx: int, sy: int) -> Gauge:
    return replace(gauge, angle_deg=sx * (gauge.angle_deg or 0.0), y_mm=sy * gauge.y_mm)


def _sites(gauges: list[Gauge], finger: Finger) -> np.ndarray:
    """(k, 3) places of the gauges, mm."""
    a, c, b = finger.shape.interface[0], finger.shape.interface[-1], half_length(finger.shape)
    angle, y = np.radians([gauge.angle_deg or 0.0 for gauge in gauges]), np.array([gauge.y_mm for gauge in gauges])
    narrow = np.sqrt(1 - (y / b) ** 2) if len(finger.shape.interface) == 3 else np.ones(len(y))
    return np.column_stack([a * narrow * np.sin(angle), y, c * narrow * np.cos(angle)])
