"""The calibration record (NumPy; pydantic to load a file): `papilla.calibrate` makes it, estimators use it."""

from papilla.calibration.readouts import (
    IDENTIFIABLE,
    LEVEL,
    NORMAL_FACTOR,
    GaugeSurface,
    PositionTerms,
    SdSurface,
    SoftnessStatus,
    Uncertainty,
)
from papilla.calibration.record import Calibration, Inversion, Quadratic, QuadraticInverse
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
