"""The calibration record (NumPy only): `papilla.calibrate` makes it, estimators use it, files keep it."""

from papilla.calibration.position import PositionTerms
from papilla.calibration.quadratic import Quadratic, QuadraticInverse
from papilla.calibration.readouts import LEVEL, NORMAL_FACTOR, GaugeSurface, SdSurface, Uncertainty
from papilla.calibration.record import Calibration, Inversion
from papilla.calibration.status import IDENTIFIABLE, SoftnessStatus
from papilla.calibration.surface import Surface

__all__ = [
    "IDENTIFIABLE",
    "LEVEL",
    "NORMAL_FACTOR",
    "Calibration",
    "GaugeSurface",
    "Inversion",
    "PositionTerms",
    "Quadratic",
    "QuadraticInverse",
    "SdSurface",
    "SoftnessStatus",
    "Surface",
    "Uncertainty",
]
