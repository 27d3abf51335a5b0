"""What an identification found out about a finger: the `[identified]` table of its design file."""

import math
from dataclasses import dataclass

from papilla.errors import InputError


@dataclass(frozen=True)
class Identified:
    """Parameters of a finger that were fitted to measured presses, with covariance, and what its bench read.

    status : in a sentence. presses : how many were fitted. specimen, friction : what was pressed, and how it rubs.
    zeros_microstrain : readings of the gauges in the air; touch_down_mm : what a measured indentation is more than the
    approach. Neither is in a `Press`.
    parameters : names, p of them. values, lower, upper : (p,) in their units, with 95 % intervals. logarithmic : (p,)
    whose logarithm `covariance` (p, p) is of. chi_square, freedom : of the weighted residuals. force_error,
    noise_microstrain : errors of a press that the fit took or told. notes : what to doubt, a sentence each.
    relaxation_shares, relaxation_times_s : of the silicone's Prony series, where a hold told it; crept : range of the
    equivalent force over the force in the touches that were fitted, two numbers, or none.

    Raises `InputError` for lists that do not fit together, or numbers that are not finite.
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
        """Standard deviation of a parameter, relative for a logarithmic one."""
        place = self.parameters.index(name)
        return math.sqrt(self.covariance[place][place])
