"""Contacts beside the apex: presses at the apex, moved along the finger, fitted as `PositionTerms`."""

from dataclasses import replace

import numpy as np
from scipy.linalg import null_space

from papilla import cache
from papilla.calibrate.press_table import default_specimen
from papilla.calibrate.surface_fit import Resolution, SurfaceFit
from papilla.calibration import Calibration, PositionTerms
from papilla.calibration.surface import POWERS, power_vector
from papilla.errors import ContactRangeError, InputError
from papilla.fem import ReducedFinger, press
from papilla.fem.reduction.finger_model import FingerModel
from papilla.fem.reduction.transported import transported_readings
from papilla.finger import Finger
from papilla.mesh import build

FORCES, MODULI = 10, 12
"""Presses along each axis of the domain, its ends among them."""
ALONG_FORCE, ALONG_MODULUS = Resolution(4), Resolution(6)
REACH = 1 / 6
"""Calibrated |x| in half widths of the finger: 4 mm of 24."""
CELLS = 8
PLACES_PER_CELL = 2
ERROR = 0.02
"""One sigma of a reading's change: presses solved beside the apex, on this mesh and on another, differ by so much of it
(docs/adr/0009)."""

LEAST_GAUGES = 3
"""With the force, one channel more than modulus, force and position have unknowns."""


def with_positions(calibration: Calibration, finger: Finger, reduced: ReducedFinger) -> Calibration:
    """The calibration of a finger and what contacts beside the apex change in it; a note where that has no answer.

    reduced : of the same finger on its own mesh. What is computed comes from the cache the second time.
    """
    if len(finger.gauges) < LEAST_GAUGES:
        return calibration
    domain = calibration.domain
    key = cache.key(__name__, finger.sha256, reduced.to_arrays(), domain)
    try:
        moved = cache.fetch("positions", key, lambda: move_presses(FingerModel(finger, build(finger)), reduced, domain))
        return replace(calibration, position=fit_positions(moved))
    except InputError as error:
        return replace(calibration, notes=(*calibration.notes, f"the apex alone is calibrated: {error}"))


def position_places(model: FingerModel) -> np.ndarray:
    """(p,) places x (mm) at which contacts are computed; the middle one is exactly 0."""
    reach = REACH * float(np.ptp(model.mesh.points[:, 0])) / 2
    half = CELLS * PLACES_PER_CELL // 2
    return reach / half * np.arange(-half, half + 1)


def move_presses(
    model: FingerModel, reduced: ReducedFinger, domain: dict[str, tuple[float, float]]
) -> dict[str, np.ndarray]:
    """Presses over a calibration's domain at the apex, and what they read elsewhere: named arrays.

    force_N, modulus_MPa : (m,); place_mm : (p,); reading : (p, m, g) in microstrain. A press that leaves what the model
    covers is left out. Raises `InputError` where a contact beside the apex would leave the skin.
    """
    rows, pressures = [], []
    for modulus in np.geomspace(*domain["modulus_MPa"], MODULI).tolist():
        start = None
        for force in np.geomspace(*domain["force_N"], FORCES).tolist():
            try:
                found = press(reduced, default_specimen(modulus), force=force, fidelity="contact", start=start)
            except ContactRangeError:
                break
            start = found.active
            rows.append((force, modulus))
            pressures.append(found.pressure)
    force_N, modulus_MPa = np.array(rows).reshape(-1, 2).T
    places = position_places(model)
    readings = transported_readings(model, reduced.patch, np.array(pressures).reshape(len(rows), -1), places.tolist())
    return {"force_N": force_N, "modulus_MPa": modulus_MPa, "place_mm": places, "reading": readings}


def fit_positions(moved: dict[str, np.ndarray]) -> PositionTerms:
    """`PositionTerms` through what `move_presses` found; raises `InputError` for too few presses."""
    force, places = moved["force_N"], moved["place_mm"]
    change = (moved["reading"] - moved["reading"][len(places) // 2]) / force[:, None]
    surfaces = SurfaceFit(force, moved["modulus_MPa"], (ALONG_FORCE, ALONG_MODULUS))
    basis = _basis(places)
    # Splines that vanish at x = 0, where the gauges' own surfaces hold.
    free = null_space(basis[[len(places) // 2]])
    across = free @ np.linalg.lstsq(basis @ free, change.reshape(len(places), -1), rcond=None)[0]
    across = across.reshape(-1, *change.shape[1:])
    coefficients = np.array([[surfaces.surface(row).surface.coefficients for row in part.T] for part in across])
    terms = PositionTerms(
        surfaces.force_N,
        surfaces.modulus_MPa,
        float(places[-1]),
        np.moveaxis(coefficients, 0, -1),
        np.zeros((change.shape[2], CELLS + 1)),
    )
    missed = change - terms.change(force, moved["modulus_MPa"], places[:, None])
    square = (missed**2 + (ERROR * change) ** 2).mean(axis=1)[::PLACES_PER_CELL]
    return replace(terms, error=np.sqrt(square).T)


def _basis(places: np.ndarray) -> np.ndarray:
    """(p, CELLS + 3) weights of the B-spline coefficients at each place."""
    at = (places - places[0]) / (places[-1] - places[0]) * CELLS
    cell = np.minimum(at.astype(int), CELLS - 1)
    basis = np.zeros((len(places), CELLS + 3))
    np.put_along_axis(basis, cell[:, None] + np.arange(4), power_vector(at - cell) @ POWERS.T, axis=1)
    return basis
