"""Unknown errors of finger, sensors and specimen that are constant during a touch: one standard deviation for each."""

import math
from dataclasses import dataclass, fields
from typing import ClassVar

from papilla.errors import InputError
from papilla.specimen import THICKNESS_MM

THIN_MM = 3.0
"""Thickness that lies 1.7 standard deviations below the mean if the thickness is unknown."""
SHIFT_PER_FORCE, SHIFT_POWER = 10.2, 0.72
"""A bonded block h mm thick instead of h0 presses like one whose ln E is higher by 10.2 f^0.72 (h^-1.5 - h0^-1.5), f in
N: presses of the default finger, 0.05-0.72 MPa, 3 to 20 mm, within 0.1 or a tenth of it."""


@dataclass(frozen=True)
class Doubts:
    """Standard deviations of errors that are constant in a touch; all of them are in the modulus' sigma.

    gauge_gain : relative, of each gauge; creep : relative, of all gauges alike. zero_microstrain : of each gauge, half
    of that once it was seen in the air. force_gain : relative. force_offset_N : of the force's zero, half of that too
    once it was seen. beside_mm : distance of the contact from the row of gauges (y), which the row cannot
    measure; x is an unknown of its own. thickness_mm : of the specimen, None where it is not known (then 3 mm are 1.7
    standard deviations from the calibrated thickness); thickness_error : relative, of a stated one. The defaults are
    what a careful lab has; `Doubts.NONE` has none.

    Raises `InputError` for values below 0, or a thickness that is not above 0.
    """

    gauge_gain: float = 0.03
    creep: float = 0.02
    zero_microstrain: float = 200.0
    force_gain: float = 0.02
    force_offset_N: float = 0.006
    beside_mm: float = 1.0
    thickness_mm: float | None = None
    thickness_error: float = 0.05

    NONE: ClassVar["Doubts"]

    def __post_init__(self):
        for name in (field.name for field in fields(self)):
            value = getattr(self, name)
            if value is not None and not 0 <= value < math.inf:
                raise InputError(f"{name} must be at least 0 and finite, got {value}")
        if self.thickness_mm == 0:
            raise InputError("thickness_mm must be greater than 0, or None where it is not known, got 0")

    def thickness_shift(self, calibrated_mm: float) -> tuple[float, float]:
        """Mean and standard deviation of what the thickness adds to the apparent ln E at 1 N."""

        def shift(thickness: float) -> float:
            return SHIFT_PER_FORCE * (thickness**-1.5 - calibrated_mm**-1.5)

        if self.thickness_mm is None:
            return 0.0, abs(shift(min(THIN_MM, calibrated_mm / 2))) / 1.7
        along = 1.5 * SHIFT_PER_FORCE * self.thickness_mm**-1.5 * self.thickness_error
        mean = shift(self.thickness_mm)
        return mean, math.hypot(along, 0.1 * mean)


Doubts.NONE = Doubts(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, THICKNESS_MM, 0.0)
