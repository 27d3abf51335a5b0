"""A calibration from measured presses: few moduli, noise, and forces that no grid planned."""

import numpy as np

from papilla.calibrate.fitting import provenance
from papilla.calibrate.regression import fit_quadratic
from papilla.calibrate.surface_fit import SurfaceFit, bench_resolution, uncertainty, usable_part
from papilla.calibration import Calibration, GaugeSurface, SdSurface
from papilla.errors import InputError
from papilla.logs import BenchLog

FORCE_DEGREE, MODULUS_DEGREE = 3, 2
"""Polynomials of ln S_d: cubic in ln force, at most quadratic in ln modulus (less where values are few)."""


def fit_bench(log: BenchLog, finger: dict | None = None) -> Calibration:
    """Fit a calibration to a bench log.

    The surfaces are low-order polynomials over the forces that every modulus was pressed with; presses outside these
    are used by the quadratic alone, and a note counts them. finger : {"name", "sha256"} for the record.

    Raises `InputError` for fewer than three moduli, fewer than three forces, moduli that share no range of forces, an
    S_d of zero, or off-centre presses.
    """
    _refuse_off_centre(log)
    sd = log.sd_microstrain
    if (sd <= 0).any():
        row = int(np.argmax(sd <= 0))
        raise InputError(f"press {row + 1} of the bench log has the same reading on all gauges, so S_d is 0")
    moduli = np.unique(log.modulus_MPa)
    if len(moduli) < 3:
        raise InputError(f"a bench calibration needs specimens of three moduli at least, got {len(moduli)}")
    forward = fit_quadratic(log.force_N, log.modulus_MPa, sd)
    shared = _shared_forces(log, moduli)
    force, modulus = log.force_N[shared], log.modulus_MPa[shared]
    solver = SurfaceFit(
        force, modulus, (bench_resolution(force, FORCE_DEGREE), bench_resolution(modulus, MODULUS_DEGREE))
    )
    fitted = solver.surface(np.log(sd[shared]))
    surface = fitted.surface
    usable, twofold = usable_part(surface)
    gauges = []
    for number, name in enumerate(log.gauge_names):
        gauge = solver.surface(log.readings[shared, number] / force)
        gauges.append(GaugeSurface(name, gauge.surface, uncertainty(gauge)))
    return Calibration(
        finger=finger or {"name": "", "sha256": ""},
        mesh={},
        forward=forward,
        inverse=forward.inverse,
        surface=SdSurface(surface, usable, twofold, uncertainty(fitted)),
        gauges=tuple(gauges),
        provenance=provenance("bench log", presses=len(log), left_out=int((~shared).sum())),
        notes=(*forward.notes, *_doubts(solver, len(moduli), shared, usable)),
    )


def _refuse_off_centre(log: BenchLog) -> None:
    """One calibration is for one touch-down point."""
    for name in ("x_mm", "y_mm"):
        place = getattr(log, name)
        if place is not None and np.ptp(place) > 0:
            raise InputError(
                f"the presses differ in {name} ({place.min():g} to {place.max():g}): "
                "a calibration is for one touch-down point, keep the presses of one"
            )


def _shared_forces(log: BenchLog, moduli: np.ndarray) -> np.ndarray:
    """(n,) presses inside the range of forces that every modulus was pressed with."""
    groups = [log.force_N[log.modulus_MPa == modulus] for modulus in moduli]
    low, high = max(group.min() for group in groups), min(group.max() for group in groups)
    if not low < high:
        raise InputError(f"the moduli share no range of forces: one starts at {low:g} N, another ends at {high:g} N")
    return (log.force_N >= low) & (log.force_N <= high)


def _doubts(solver: SurfaceFit, moduli: int, shared: np.ndarray, usable: np.ndarray) -> list[str]:
    along_force, along_modulus = solver.along
    notes = [f"ln S_d is {along_force.in_words} in ln force and {along_modulus.in_words} in ln modulus"]
    if along_modulus.degree is not None and moduli == along_modulus.degree + 1:
        notes.append(f"between the {moduli} moduli S_d is assumed to follow this curve: no interval includes that")
    share = 1 - float((usable[:, 1] - usable[:, 0]).mean()) / along_modulus.cells
    if share > 0:
        notes.append(
            f"S_d does not rise with the modulus in {100 * share:.0f} % of the domain: no modulus is told there"
        )
    if solver.freedom < 0.5:
        notes.append("as many presses as coefficients: the surface has no residual, its intervals leave noise out")
    if outside := int((~shared).sum()):
        notes.append(f"{outside} presses lie outside the forces that all moduli share: the surface does not use them")
    return notes
