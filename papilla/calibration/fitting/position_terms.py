"""Contacts beside the apex: presses at the apex, moved along the finger, fitted as `PositionTerms`.

A reading beside the apex is r(f, E, x) = r(f, E, 0) + f d(ln f, ln E, x). A contact is small compared with the finger,
so its tractions at the apex are moved to x along the skin and loaded there, without another contact problem. The change
per newton, d, is a product of splines: along x one that is zero at x = 0, where the gauges' own surfaces hold, and
along force and modulus a coarse one, because d changes slowly with both.
"""

import math
from dataclasses import replace

import numpy as np
from scipy.linalg import null_space

from papilla.calibration import Calibration, PositionTerms
from papilla.calibration.fitting.surface_fit import Resolution, SurfaceFit
from papilla.calibration.surface import SPLINE_DEGREE, SPLINE_ORDER, SPLINE_POWERS, power_vector
from papilla.core import cache
from papilla.core.errors import InputError
from papilla.fem import ReducedFinger
from papilla.fem.pressing.fidelity import press_grid
from papilla.fem.pressing.off_apex import transported_readings
from papilla.fem.reduction.finger_model import FingerModel, model_of
from papilla.mesh import build
from papilla.model.finger import Finger
from papilla.model.specimen import Friction

POSITION_FORCES, POSITION_MODULI = 10, 12
"""Number of presses along each axis of the domain, its ends included."""
ALONG_FORCE, ALONG_MODULUS = Resolution(4), Resolution(6)
POSITION_REACH_WIDTHS = 1 / 6
"""Largest calibrated |x| in half widths of the finger: 4 mm of 24."""
POSITION_CELLS = 8
PLACES_PER_CELL = 2
READING_CHANGE_ERROR = 0.04
"""Relative error (one sigma) of a reading's change: presses at finite strain beside the apex differ by this much from
linear presses that were moved, and linear presses solved there by half of it (docs/adr/0009)."""
UNKNOWN_FRICTION_ERROR = 0.06
"""The same if friction is not known: half of the difference between the changes of stuck and frictionless presses."""

LEAST_GAUGES = 3
"""Smallest number of gauges: with the force they are one channel more than the unknowns modulus, force and position."""


def with_positions(
    calibration: Calibration, finger: Finger, reduced: ReducedFinger, friction: Friction = 0.0
) -> Calibration:
    """The calibration of a finger with the changes by contacts beside the apex; if they cannot be computed, a note says
    why.

    reduced : of the same finger on its own mesh. friction : of the presses. The second time the results come from the
    cache.
    """
    if len(finger.gauges) < LEAST_GAUGES:
        return calibration
    domain = calibration.domain
    error = (
        READING_CHANGE_ERROR
        if calibration.surface.uncertainty.friction is None
        else math.hypot(READING_CHANGE_ERROR, UNKNOWN_FRICTION_ERROR)
    )

    def make() -> dict[str, np.ndarray]:
        return move_presses(model_of(finger, build(finger, reduced.mesh_size_mm)), reduced, domain, friction)

    try:
        bench = vars(finger.bench.specimen(1.0))
        key = cache.key(__name__, finger.sha256, reduced.to_arrays(), domain, friction, bench)
        return replace(calibration, position=fit_positions(cache.fetch("positions", key, make), error))
    except InputError as error:
        return replace(calibration, notes=(*calibration.notes, f"the apex alone is calibrated: {error}"))


def move_presses(
    model: FingerModel, reduced: ReducedFinger, domain: dict[str, tuple[float, float]], friction: Friction = 0.0
) -> dict[str, np.ndarray]:
    """Presses over a calibration's domain at the apex, and their readings at other places, as named arrays.

    force_N, modulus_MPa : (m,); place_mm : (p,) along x, the middle one exactly 0; reading : (p, m, g) in microstrain.
    A press outside the range of the model is left out. Raises `InputError` if a contact beside the apex would leave the
    skin.
    """
    forces = np.geomspace(*domain["force_N"], POSITION_FORCES)
    moduli = np.geomspace(*domain["modulus_MPa"], POSITION_MODULI)
    presses = press_grid(reduced, map(model.finger.bench.specimen, moduli.tolist()), forces, friction)
    pressed = [press for _, press in presses if not isinstance(press, Exception)]
    force_N, modulus_MPa = np.array([(press.force, press.modulus) for press in pressed]).reshape(-1, 2).T
    half = POSITION_CELLS * PLACES_PER_CELL // 2
    places = POSITION_REACH_WIDTHS * float(np.ptp(model.mesh.points[:, 0])) / 2 / half * np.arange(-half, half + 1)
    tractions = np.array([press.traction for press in pressed])
    readings = transported_readings(model, reduced.patch, tractions, places.tolist())
    return {"force_N": force_N, "modulus_MPa": modulus_MPa, "place_mm": places, "reading": readings}


def fit_positions(moved: dict[str, np.ndarray], error: float = READING_CHANGE_ERROR) -> PositionTerms:
    """`PositionTerms` fitted to the result of `move_presses`, with a relative error of each change. Raises `InputError`
    for too few presses."""
    force, places = moved["force_N"], moved["place_mm"]
    change = (moved["reading"] - moved["reading"][len(places) // 2]) / force[:, None]
    surfaces = SurfaceFit(force, moved["modulus_MPa"], (ALONG_FORCE, ALONG_MODULUS))
    basis = _basis(places)
    # Splines that are zero at x = 0, where the gauges' own surfaces hold.
    free = null_space(basis[[len(places) // 2]])
    across = free @ np.linalg.lstsq(basis @ free, change.reshape(len(places), -1), rcond=None)[0]
    across = across.reshape(-1, *change.shape[1:])
    coefficients = np.array([[surfaces.surface(gauge).surface.coefficients for gauge in term.T] for term in across])
    domain = surfaces.force_N, surfaces.modulus_MPa, float(places[-1])
    terms = PositionTerms(*domain, np.moveaxis(coefficients, 0, -1), np.zeros((change.shape[2], POSITION_CELLS + 1)))
    # What the splines miss and the known error of moved presses, per place; a cell's end is every second place.
    missed = change - terms.change(force, moved["modulus_MPa"], places[:, None])
    square = (missed**2 + (error * change) ** 2).mean(axis=1)[::PLACES_PER_CELL]
    return replace(terms, error=np.sqrt(square).T)


def _basis(places: np.ndarray) -> np.ndarray:
    """(p, POSITION_CELLS + 3) weights of the B-spline coefficients at each place."""
    at = (places - places[0]) / (places[-1] - places[0]) * POSITION_CELLS
    cell = np.minimum(at.astype(int), POSITION_CELLS - 1)
    basis = np.zeros((len(places), POSITION_CELLS + SPLINE_DEGREE))
    np.put_along_axis(basis, cell[:, None] + np.arange(SPLINE_ORDER), power_vector(at - cell) @ SPLINE_POWERS.T, axis=1)
    return basis
