"""What a calibration would make of a design's presses, without one: surfaces of S_d and of the gauges, and their
errors."""

import math
from dataclasses import dataclass, replace

import numpy as np

from papilla.calibration import GaugeSurface, SdSurface, Uncertainty
from papilla.calibration.fitting.surface_fit import usable_part
from papilla.core.errors import InputError
from papilla.core.units import TINY_DIVISOR, UM_PER_MM, to_microstrain
from papilla.design.geometry import gains_of
from papilla.design.presses import DesignPresses
from papilla.design.scene import DesignScene
from papilla.fem.finite.strain_tables import RELATIVE_TABLE_FORCES
from papilla.fem.pressing.large_strain import CONTINUED_GAUGE, CONTINUED_SD, LARGEST_FORCE_RATIO, TABLE_LOG_MARGIN
from papilla.mesh.body import narrowest_mm
from papilla.model.finger import Finger

CALIBRATED_DEPTH_ERROR = 0.005
"""Relative one sigma of a calibrated indentation: mesh scatter, fit and large strain."""
MESH_SCATTER = 0.0025
"""One sigma by the scatter between meshes, relative to the part of a gauge's reading that is membrane strain: 0.1 to
0.17 % at 0.6 N and up to 0.4 % at 0.05 N in calibrations of seven pairs of moduli, times 1.6 for a comparison of three
meshes."""
SWEEP_STEPS = 6, 3
"""A calibration's sweep is thinned to every sixth force and every third modulus."""


@dataclass(frozen=True, eq=False)
class DesignSurfaces:
    """Input of the estimators, as from a calibration: one surface a gauge, and that of S_d."""

    gauges: list[GaugeSurface]
    surface: SdSurface | None = None


def surfaces_of(presses: DesignPresses) -> DesignSurfaces:
    """The surfaces of a design; raises `InputError` unless it has at least two gauges that differ."""
    scene, sd = presses.scene, presses.sd
    sd_error, errors = calibration_errors(presses)
    if len(presses.finger.gauges) < 2 or not (sd > 0).all():
        raise InputError("S_d needs at least two gauges whose readings differ")
    channels = zip(presses.finger.gauges, np.moveaxis(presses.readings, 2, 0), errors, strict=True)
    gauges = [_channel(scene, gauge.name, readings, error) for gauge, readings, error in channels]
    value, change = _calibrated(scene, np.log(sd))
    fitted = scene.solver.surface(value).surface
    return DesignSurfaces(gauges, SdSurface(fitted, *usable_part(fitted), _uncertainty(scene, sd_error, change)))


def depth_surface(presses: DesignPresses) -> DesignSurfaces:
    """The surface of the depth, as one "gauge" that reads micrometres."""
    depths = UM_PER_MM * presses.depths
    size = float(_rms(_calibrated(presses.scene, depths / presses.scene.grid[0])[0]))
    return DesignSurfaces([_channel(presses.scene, "depth", depths, CALIBRATED_DEPTH_ERROR * size)])


def calibration_errors(presses: DesignPresses) -> tuple[float, np.ndarray]:
    """One sigma of the design's calibration, without friction: of S_d (relative), and of each gauge (g,) in
    microstrain / N.

    Large strain is treated as in `papilla.calibration.fit`: the error of the tables and of presses beyond their
    forces, relative to the rms of a gauge over the calibration's own sweep. Meshes: `MESH_SCATTER`.
    """
    finger, stuck = presses.finger, presses.scene.unknown.friction != 0
    end, (outer, inner) = presses.ends[stuck], presses.moduli
    swept, moduli = map(np.array, presses.scene.swept(finger))
    if end.large_strain:
        swept = swept[_between_forces(finger, swept, math.log(LARGEST_FORCE_RATIO))]
    # Errors are relative to means over a sweep; a thinner one has the same means.
    force, modulus = map(np.ravel, np.meshgrid(swept[:: SWEEP_STEPS[0]], moduli[:: SWEEP_STEPS[1]]))
    valid = (modulus >= presses.softest_MPa) & end.inside(force, modulus, outer, inner)
    if not valid.any():
        raise InputError("no press of a calibration of this finger lies within the range of the model")
    force, modulus = force[valid], modulus[valid]
    felt = end.felt(force, modulus, outer, inner).values
    parts = to_microstrain(felt * gains_of(finger)) / force[:, None, None]
    reading, membrane = parts.sum(axis=1), parts[:, 0]
    continued = math.sqrt(np.mean(~_between_forces(finger, swept, TABLE_LOG_MARGIN))) if end.large_strain else 0.0
    table = presses.geometry.strain_error(finger, stuck)
    deviation = reading - reading.mean(axis=1, keepdims=True)
    # S_d is the root of the mean square deviation: its relative change by a change of each gauge.
    moved = np.linalg.norm(deviation * membrane, axis=1) / np.maximum((deviation**2).sum(axis=1), TINY_DIVISOR)
    of_sd = math.hypot(table, CONTINUED_SD * continued, MESH_SCATTER * _rms(moved))
    strain = math.hypot(table, CONTINUED_GAUGE * continued)
    return of_sd, np.hypot(strain * _rms(reading), MESH_SCATTER * _rms(membrane))


def _between_forces(finger: Finger, force: np.ndarray, beyond: float) -> np.ndarray:
    """Whether forces (N) lie within those of the tables of large strain, or at most `beyond` outside in the
    logarithm."""
    scaled = np.log(force / (finger.inner.modulus * narrowest_mm(finger) ** 2))
    least, most = (math.log(RELATIVE_TABLE_FORCES[end]) for end in (0, -1))
    return (scaled >= least - beyond) & (scaled <= most + beyond)


def _channel(scene: DesignScene, name: str, values: np.ndarray, error: float) -> GaugeSurface:
    """The surface over force and modulus for a channel's values (2, n) without friction and stuck.

    error : one sigma of its value / force."""
    value, change = _calibrated(scene, values / scene.grid[0])
    return GaugeSurface(name, scene.solver.surface(value).surface, _uncertainty(scene, error, change))


def _calibrated(scene: DesignScene, values: np.ndarray) -> tuple[np.ndarray, np.ndarray | None]:
    """From values (2, n): those (n,) that a calibration uses, and their change without friction if friction is not
    known."""
    free, stuck = values
    if scene.unknown.friction == "unknown":
        return stuck, free - stuck
    return (stuck if scene.unknown.friction == "stick" else free), None


def _uncertainty(scene: DesignScene, error: float, change: np.ndarray | None) -> Uncertainty:
    """The uncertainty of a surface with a constant error; the change without friction is fitted like the value."""
    certain = Uncertainty(0.0, 0.0, 0.0, np.array(scene.force_N), np.zeros(2), 0.0, 0, strain=error)
    return certain if change is None else replace(certain, friction=scene.solver.surface(change).surface)


def _rms(values: np.ndarray) -> np.ndarray:
    """Root mean square over the first axis."""
    return np.sqrt((values**2).mean(axis=0))
