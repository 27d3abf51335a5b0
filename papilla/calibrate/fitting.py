"""From a table of presses to a `Calibration`: the quadratic, the surfaces, their uncertainty and provenance."""

import platform
from collections.abc import Sequence
from datetime import UTC, datetime
from importlib.metadata import version

import numpy as np

from papilla import __version__
from papilla.calibrate.press_table import Sweep
from papilla.calibrate.published_form import fit_quadratic
from papilla.calibrate.surface_fit import SurfaceFit, table_resolution, uncertainty, usable_part
from papilla.calibration import Calibration, GaugeSurface, SdSurface, Surface
from papilla.errors import InputError


def fit(sweep: Sweep, scatter: Sequence[Sweep] = ()) -> Calibration:
    """Fit a calibration to a sweep.

    Parameters
    ----------
    sweep : at least three forces and three moduli; presses without readings are left out, and the part of the domain
        around them is not inverted.
    scatter : sweeps of the same finger on independent meshes (any table of forces and moduli): what they differ by
        becomes part of every sigma and interval.

    Raises `InputError` where the sweep is too small to fit, or a scatter sweep has other gauges.
    """
    for other in scatter:
        if other.reading.shape[1] != sweep.reading.shape[1]:
            raise InputError(f"a scatter sweep has {other.reading.shape[1]} gauges, not {sweep.reading.shape[1]}")
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
    usable, twofold = usable_part(
        surface,
        sweep.force_N[missing],
        sweep.modulus_MPa[missing],
        np.unique(sweep.force_N),
        np.unique(sweep.modulus_MPa),
    )
    others = [(s.force_N, s.modulus_MPa, np.log(s.sd_microstrain)) for s in scatter]
    return Calibration(
        finger={"name": sweep.finger_name, "sha256": sweep.finger_sha256},
        mesh={
            "sha256": sweep.mesh_sha256,
            "size_mm": sweep.mesh_size_mm if np.isfinite(sweep.mesh_size_mm) else None,
            "scatter_sha256": [other.mesh_sha256 for other in scatter],
        },
        forward=forward,
        inverse=forward.inverse,
        surface=SdSurface(surface, usable, twofold, uncertainty(fitted, others)),
        gauges=gauge_surfaces(sweep, solver, scatter),
        provenance=provenance(
            "sweep",
            presses=int(valid.sum()),
            left_out=int(missing.sum()),
            specimen=sweep.specimen,
            friction=sweep.friction,
        ),
        notes=(*forward.notes, *_doubts(sweep, surface, usable, scatter)),
    )


def gauge_surfaces(sweep: Sweep, solver: SurfaceFit, scatter: Sequence[Sweep] = ()) -> tuple[GaugeSurface, ...]:
    """A surface of reading / force (microstrain / N) for each gauge: it may cross zero, so it has no logarithm."""
    valid, surfaces = sweep.valid, []
    for number, name in enumerate(sweep.gauge_names):
        fitted = solver.surface(sweep.reading[valid, number] / sweep.force_N[valid])
        others = [(s.force_N, s.modulus_MPa, s.reading[:, number] / s.force_N) for s in scatter]
        surfaces.append(GaugeSurface(name, fitted.surface, uncertainty(fitted, others)))
    return tuple(surfaces)


def provenance(source: str, **facts) -> dict:
    """Where a calibration comes from: source, facts, versions, and when (UTC)."""
    versions = {"papilla": __version__, "python": platform.python_version()}
    versions |= {name: version(name) for name in ("numpy", "scipy", "scikit-fem")}
    return {"source": source, **facts, "versions": versions, "created": datetime.now(UTC).isoformat(timespec="seconds")}


def _refuse_no_spread(force: np.ndarray, modulus: np.ndarray, sd: np.ndarray) -> None:
    """ln S_d needs S_d > 0: it is zero for a finger with one gauge, or with gauges that all read the same."""
    if (sd <= 0).any():
        row = int(np.argmax(sd <= 0))
        where = f"{force[row]:g} N on {modulus[row]:g} MPa"
        raise InputError(f"S_d is 0 at {where}: a calibration needs at least two gauges whose readings differ")


def _doubts(sweep: Sweep, surface: Surface, usable: np.ndarray, scatter: Sequence[Sweep]) -> list[str]:
    """What a user of the surface has to doubt."""
    notes = []
    missing, coarse = int((~sweep.valid).sum()), int((sweep.valid & ~sweep.resolved).sum())
    if missing:
        notes.append(f"{missing} of {len(sweep)} presses left what the model covers and have no readings")
    if coarse:
        notes.append(f"{coarse} of {len(sweep)} presses are too light for the mesh: S_d may be off by over 3 % there")
    n = surface.cells[1]
    blocked = int((n - (usable[:, 1] - usable[:, 0])).sum())
    if blocked:
        notes.append(f"S_d does not rise with the modulus, or has no data, in {blocked} of {usable.shape[0] * n} cells")
    if not scatter:
        notes.append("no independent mesh was compared: intervals do not include mesh scatter")
    return notes
