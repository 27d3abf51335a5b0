"""From a table of presses to a `Calibration`: the quadratic, the surfaces, their uncertainty and provenance, and the
form of five coefficients for a microcontroller, whose fit minimises errors of the modulus, not of S_d."""

import math
import platform
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import cached_property
from importlib.metadata import version

import numpy as np

from papilla import __version__
from papilla.calibration import BicubicSurface, Calibration, GaugeSurface, SdSurface, Uncertainty
from papilla.calibration.fitting.surface_fit import (
    Fitted,
    Resolution,
    SurfaceFit,
    table_resolution,
    uncertainty,
    usable_part,
)
from papilla.calibration.fitting.sweep import COMPACT_FORCE_N, CalibrationRanges, Sweep
from papilla.calibration.published import fit_quadratic
from papilla.calibration.readouts import Compact, ln_sd
from papilla.core.errors import InputError
from papilla.core.least_squares import least_squares
from papilla.fem.pressing.large_strain import BEYOND_STRAIN_TABLES, CONTINUED_GAUGE, CONTINUED_SD, CONTINUED_WORDS

FRICTION_CELLS = (Resolution(8),) * 2
"""Number of cells over force and modulus for the change by friction, which is smooth."""

COMPACT_GRID = 24
"""Number of presses along each axis to which the compact form is fitted."""
COMPACT_START = (0.5, -0.05, -3.0, 0.2)
"""Start values of its coefficients but the first, which starts at the mean of ln S_d."""
SMALLEST_WEIGHT_SLOPE = 1e-3
"""Smallest slope d ln S_d / d ln E in the weights: a press with a smaller slope says little about the modulus, and its
weight does not grow further."""
LEAST_SPAN = 1.5
"""Smallest ratio of the ends of a range that a calibration must share with the compact form."""


def fit(
    sweep: Sweep,
    scatter: Sequence[Sweep] = (),
    *,
    frictionless: Sweep | None = None,
    friction_known: bool | None = None,
    strain: float | None = None,
    ranges: CalibrationRanges | None = None,
) -> Calibration:
    """Fit a calibration to a sweep. `notes` and `repr` state what its intervals do not contain, compared with
    `calibrate_finger`.

    Parameters
    ----------
    sweep : at least three forces and three moduli; presses without readings are left out, and the part of the domain
        around them is not inverted.
    scatter : sweeps of the same finger on independent meshes (any table of forces and moduli): their differences become
        part of every sigma and interval.
    frictionless : the same presses without friction (then `scatter` is without friction, too); None if `sweep` has no
        friction.
    friction_known : whether later presses have the sweep's friction; if not, intervals also contain presses without
        friction. None means: whether the friction was stated.
    strain : relative standard deviation of S_d by large strain; None takes that of the sweep.
    ranges : of the finger, which decide the presses of the compact form; None takes those of the default finger.

    Raises `InputError` if the sweep is too small to fit, or another sweep has other gauges or presses.
    """
    if frictionless is not None and (frictionless.reading.shape != sweep.reading.shape):
        raise InputError("the sweep without friction must be of the same presses and gauges")
    for thin in scatter:
        if thin.reading.shape[1] != sweep.reading.shape[1]:
            raise InputError(f"a scatter sweep has {thin.reading.shape[1]} gauges, not {sweep.reading.shape[1]}")
    friction_known = sweep.friction_told if friction_known is None else friction_known
    strain = sweep.strain if strain is None else strain
    friction_missing = bool(sweep.friction) and not friction_known and frictionless is None
    lacks = [name for name, missing in (("mesh scatter", not scatter), ("friction", friction_missing)) if missing]
    valid = sweep.valid
    if not valid.any():
        raise InputError(f"no press of the sweep has readings; the first says: {sweep.status[0]}")
    force, modulus, sd = sweep.force_N[valid], sweep.modulus_MPa[valid], sweep.sd_microstrain[valid]
    _refuse_no_spread(force, modulus, sd)
    forward = fit_quadratic(force, modulus, sd)
    solver = SurfaceFit(force, modulus, (table_resolution(force), table_resolution(modulus)))
    fitted = solver.surface(np.log(sd))
    surface = fitted.surface
    missing = ~valid
    table = (np.unique(axis) for axis in (sweep.force_N, sweep.modulus_MPa))
    usable, twofold = usable_part(surface, sweep.force_N[missing], sweep.modulus_MPa[missing], *table)
    doubts = ComparedSweeps(sweep, scatter, frictionless, friction_known, strain)
    calibration = Calibration(
        finger={"name": sweep.finger_name, "sha256": sweep.finger_sha256} | (ranges or CalibrationRanges()).to_json(),
        mesh={
            "sha256": sweep.mesh_sha256,
            "size_mm": sweep.mesh_size_mm if np.isfinite(sweep.mesh_size_mm) else None,
            "scatter_sha256": [thin.mesh_sha256 for thin in scatter],
        },
        forward=forward,
        inverse=forward.inverse,
        surface=SdSurface(surface, usable, twofold, doubts.of_surface(fitted, lambda s: np.log(s.sd_microstrain), 1.0)),
        gauges=gauge_surfaces(sweep, solver, doubts),
        provenance=provenance(
            "sweep",
            presses=int(valid.sum()),
            left_out=int(missing.sum()),
            specimen=sweep.specimen,
            friction=sweep.friction,
            physics=sweep.physics,
            lacks=lacks,
        ),
        notes=(*forward.notes, *_notes(sweep, surface, usable, lacks)),
    )
    return with_compact(calibration)


@dataclass(frozen=True, eq=False)
class ComparedSweeps:
    """Other sweeps that a sweep is compared with: on other meshes, and without friction; see `fit`."""

    sweep: Sweep
    scatter: Sequence[Sweep]
    frictionless: Sweep | None
    friction_known: bool
    strain: float

    def of_surface(
        self, fitted: Fitted, value: Callable[[Sweep], np.ndarray], unit: float, *, one_site: bool = False
    ) -> Uncertainty:
        """Uncertainty of a surface that was fitted to a `value` (n,) of the sweep. The part by large strain is relative
        to `unit` and covers presses beyond the measured range."""
        others = [(s.force_N, s.modulus_MPa, value(s)) for s in self.scatter]
        # Share of the presses beyond the measured range of large strain
        beyond = np.mean([BEYOND_STRAIN_TABLES in status for status in np.array(self.sweep.status)[self.sweep.valid]])
        continued = (CONTINUED_GAUGE if one_site else CONTINUED_SD) * math.sqrt(beyond)
        strain = math.hypot(self.strain, continued) * unit
        specimen = None if self.specimen is None else self.specimen + [math.log(unit), 0, 0, 0]
        if self.frictionless is None:
            return replace(uncertainty(fitted, others, one_site=one_site), strain=strain, specimen=specimen)
        change = value(self.frictionless) - value(self.sweep)
        finite = np.isfinite(change)
        solver = SurfaceFit(self.sweep.force_N[finite], self.sweep.modulus_MPa[finite], FRICTION_CELLS)
        friction = solver.surface(change[finite]).surface
        others = [(force, modulus, values - friction(force, modulus)) for force, modulus, values in others]
        left_open = None if self.friction_known else friction
        doubt = uncertainty(fitted, others, one_site=one_site)
        return replace(doubt, strain=strain, specimen=specimen, friction=left_open)

    @cached_property
    def specimen(self) -> np.ndarray | None:
        """ln of the relative sigma of S_d by the specimens' own large strain, as `Uncertainty.specimen` has it: a
        parabola in ln E, because a hard skin hinders soft specimens most. None if no press has such an error."""
        sweep = self.sweep
        known = sweep.valid & (sweep.specimen_error > 0)
        if not known.any():
            return None
        ln_force, ln_modulus = np.log(sweep.force_N[known]), np.log(sweep.modulus_MPa[known])
        terms = np.column_stack([np.ones_like(ln_force), ln_force, ln_modulus, ln_modulus**2])
        return np.linalg.lstsq(terms, np.log(sweep.specimen_error[known]))[0]


def gauge_surfaces(sweep: Sweep, solver: SurfaceFit, doubts: ComparedSweeps) -> tuple[GaugeSurface, ...]:
    """A surface of reading / force (microstrain / N) for each gauge: it may cross zero, so it has no logarithm."""
    valid, surfaces = sweep.valid, []
    for number, name in enumerate(sweep.gauge_names):

        def per_force(table: Sweep, number: int = number) -> np.ndarray:
            return table.reading[:, number] / table.force_N

        values = per_force(sweep)[valid]
        fitted, size = solver.surface(values), float(np.sqrt(np.mean(values**2)))
        surfaces.append(GaugeSurface(name, fitted.surface, doubts.of_surface(fitted, per_force, size, one_site=True)))
    return tuple(surfaces)


def provenance(source: str, **facts) -> dict:
    """Where a calibration comes from: source, facts, versions, and when (UTC)."""
    versions = {"papilla": __version__, "python": platform.python_version()}
    versions |= {name: version(name) for name in ("numpy", "scipy", "scikit-fem")}
    return {"source": source, **facts, "versions": versions, "created": datetime.now(UTC).isoformat(timespec="seconds")}


def _refuse_no_spread(force: np.ndarray, modulus: np.ndarray, sd: np.ndarray) -> None:
    """ln S_d needs S_d > 0: it is zero for a finger with one gauge, or with gauges that all read the same."""
    if (sd <= 0).any():
        press = int(np.argmax(sd <= 0))
        where = f"{force[press]:g} N on {modulus[press]:g} MPa"
        raise InputError(f"S_d is 0 at {where}: a calibration needs at least two gauges whose readings differ")


def _notes(sweep: Sweep, surface: BicubicSurface, usable: np.ndarray, lacks: list[str]) -> list[str]:
    """The doubts about a surface, as sentences."""
    notes = []
    missing, coarse = int((~sweep.valid).sum()), int((sweep.valid & ~sweep.resolved).sum())
    if missing:
        notes.append(f"{missing} of {len(sweep)} presses left what the model covers and have no readings")
    if beyond := sum(BEYOND_STRAIN_TABLES in status for status in sweep.status):
        notes.append(f"{beyond} of {len(sweep)} presses are {BEYOND_STRAIN_TABLES}: {CONTINUED_WORDS} there")
    if coarse:
        notes.append(f"{coarse} of {len(sweep)} presses are too light for the mesh: S_d may be off by over 3 % there")
    n = surface.cells[1]
    blocked = int((n - (usable[:, 1] - usable[:, 0])).sum())
    if blocked:
        notes.append(f"S_d does not rise with the modulus, or has no data, in {blocked} of {usable.shape[0] * n} cells")
    if "mesh scatter" in lacks:
        notes.append("no independent mesh was compared: intervals do not include mesh scatter")
    if "friction" in lacks:
        notes.append("friction was not stated: stick is assumed, and intervals do not include presses without friction")
    return notes


def fit_compact(calibration: Calibration) -> Compact:
    """Fit the compact form to a calibration's surface, over the part of 10-100 gf and 0.05-0.72 MPa, times the
    factors of the finger's `CalibrationRanges`, that the calibration covers.

    Residuals are of ln S_d over the form's own slope in ln E, so that they are errors of the modulus. Raises
    `InputError` if the calibration covers too little of that range, or its S_d does not follow the form.
    """
    ranges = CalibrationRanges.recorded(calibration.finger)
    force = _inside(calibration.domain["force_N"], ranges.forced(COMPACT_FORCE_N), "forces")
    modulus = _inside(calibration.domain["modulus_MPa"], ranges.checked[1], "moduli")
    x, y = (axis.ravel() for axis in np.meshgrid(np.log(force), np.log(modulus), indexing="ij"))
    target = np.log(calibration.predict(np.exp(x), np.exp(y)))
    x, y, target = (axis[np.isfinite(target)] for axis in (x, y, target))

    first = least_squares(lambda values: ln_sd(values, x, y) - target, (float(target.mean()), *COMPACT_START))
    weights = 1 / np.maximum(_slope(first.vector, x, y), SMALLEST_WEIGHT_SLOPE)
    fitted = least_squares(lambda values: weights * (ln_sd(values, x, y) - target), first.vector)
    if not fitted.converged or not np.isfinite(fitted.vector).all():
        raise InputError(f"the compact form was not fitted: {fitted.message}")
    forces, moduli = (float(force[0]), float(force[-1])), (float(modulus[0]), float(modulus[-1]))
    sd_rms = float(np.sqrt(np.mean((ln_sd(fitted.vector, x, y) - target) ** 2)))
    doubts = [value for name, value in calibration.sigmas.items() if name not in ("measurement", "fit")]
    # Moduli beyond the fitted range count as errors of the form, so they are not refused here
    wide = Compact(fitted.vector, forces, (0.0, np.inf), 0.0, 0.0, sd_rms)
    recovered = np.array([wide.invert(float(np.exp(s)), float(np.exp(f)))[0] for s, f in zip(target, x, strict=True)])
    error = recovered / np.exp(y) - 1
    if not np.isfinite(error).all():
        raise InputError("the calibration's S_d does not follow the compact form: it has no inverse there")
    rms, largest = float(np.sqrt(np.mean(error**2))), float(np.abs(error).max())
    return Compact(fitted.vector, forces, moduli, rms, largest, sd_rms, float(np.hypot.reduce(doubts)))


def _slope(values: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """d ln S_d / d ln E of the form at ln f = x and ln E = y."""
    *_, d, e = values
    softer = np.exp(d + e * x - y)
    return softer / (1 + softer)


def with_compact(calibration: Calibration) -> Calibration:
    """The calibration with its compact form, or without it if the form does not fit."""
    try:
        return replace(calibration, compact=fit_compact(calibration))
    except InputError:
        return calibration


def _inside(covered: tuple[float, float], wanted: Sequence[float], what: str) -> np.ndarray:
    low, high = max(covered[0], wanted[0]), min(covered[1], wanted[1])
    if not high > LEAST_SPAN * low:
        raise InputError(f"the calibration covers too little of the {what} that the compact form is for")
    return np.clip(np.geomspace(low, high, COMPACT_GRID), low, high)
