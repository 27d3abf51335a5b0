"""Result of an identification: the `[identified]` table of a design file."""

import math
from dataclasses import dataclass

from papilla.errors import InputError


@dataclass(frozen=True)
class Identified:
    """Parameters of a finger fitted to measured presses, their covariance, and the zeros of its bench.

    Parameters
    ----------
    status : one sentence. presses : number of fitted presses. specimen, friction : of these presses.
    zeros_microstrain : (g,) readings of the gauges in the air. touch_down_mm : measured indentation less the approach.
        A `Press` contains neither.
    parameters : (p,) names. values, lower, upper : (p,) values and ends of the 95 % intervals, in their units.
    logarithmic : (p,) whether `covariance` (p, p) is that of the parameter's logarithm.
    chi_square, freedom : of the weighted residuals, and its degrees of freedom.
    force_error, noise_microstrain : standard deviations of the force (relative) and of a reading, as stated or
        estimated from repeated presses.
    notes : weaknesses of the fit, a sentence each.
    relaxation_shares, relaxation_times_s : Prony series of the silicone; empty if no hold was measured.
    crept : lowest and highest ratio of equivalent force to force in the fitted touches (creep), or empty.

    Raises `InputError` if the lists do not fit together or a number is not finite.
    """

    status: str
    presses: int
    specimen: str
    friction: float | str
    zeros_microstrain: tuple[float, ...]
    touch_down_mm: float
    parameters: tuple[str, ...]
    logarithmic: tuple[bool, ...]
    values: tuple[float, ...]
    lower: tuple[float, ...]
    upper: tuple[float, ...]
    covariance: tuple[tuple[float, ...], ...]
    chi_square: float
    freedom: float
    force_error: float
    noise_microstrain: float
    notes: tuple[str, ...] = ()
    relaxation_shares: tuple[float, ...] = ()
    relaxation_times_s: tuple[float, ...] = ()
    crept: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        count = len(self.parameters)
        lists = ("logarithmic", "values", "lower", "upper", "covariance")
        for name in lists:
            if len(getattr(self, name)) != count:
                raise InputError(f"identified {name} must hold {count} entries, one a parameter")
        if any(len(row) != count for row in self.covariance):
            raise InputError(f"identified covariance must be {count} x {count}")
        numbers = (*self.values, *self.lower, *self.upper, *(value for row in self.covariance for value in row))
        if not all(map(math.isfinite, (*numbers, *self.zeros_microstrain, self.touch_down_mm))):
            raise InputError("identified numbers must be finite")
        if any(row[place] < 0 for place, row in enumerate(self.covariance)):
            raise InputError("identified covariance has a negative variance")
        if len(self.relaxation_shares) != len(self.relaxation_times_s):
            raise InputError("identified relaxation_shares and relaxation_times_s must be as many")
        if len(self.crept) not in (0, 2) or not all(map(math.isfinite, self.crept)):
            raise InputError(f"identified crept must be two numbers, lowest and highest, got {list(self.crept)}")
        for name, value, logarithmic in zip(self.parameters, self.values, self.logarithmic, strict=True):
            if logarithmic and value <= 0:
                raise InputError(f"identified {name} must be greater than 0, got {value:g}")

    def sigma(self, name: str) -> float:
        """Standard deviation of a parameter in its unit; relative if the parameter is logarithmic."""
        place = self.parameters.index(name)
        return math.sqrt(self.covariance[place][place])
