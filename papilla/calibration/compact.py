"""Five coefficients with a closed-form inverse, for a microcontroller: finger and specimen as two springs in series.

ln S_d = a + b x + c x^2 - ln(1 + exp(d + e x) / E), x = ln f: S_d is that on a rigid specimen, reduced by the
deformation of the specimen. The form has as many coefficients as the published quadratic, but it saturates with E.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from papilla.calibration.readouts import NORMAL_FACTOR
from papilla.errors import InputError
from papilla.short_repr import short_repr
from papilla.status import Named

TERMS = ("1", "ln_f", "ln_f2", "spring", "spring_ln_f")


class CompactStatus(Named):
    """Status of an answer of the compact form; the exported C code has the same numbers."""

    OK = 0
    FORCE_OUTSIDE = 1
    NO_READING = 2
    SOFTER = 3
    HARDER = 4


class CompactAnswer(NamedTuple):
    """A modulus in MPa with its standard deviation and 95 % interval; NaN if the status is not OK."""

    status: CompactStatus
    modulus_MPa: float = math.nan
    sigma_MPa: float = math.nan
    lower_MPa: float = math.nan
    upper_MPa: float = math.nan


@dataclass(frozen=True, eq=False)
class Compact:
    """The form fitted to presses.

    Parameters
    ----------
    coefficients : (5,) a ... e, with f in N, E in MPa and S_d in microstrain.
    force_N, modulus_MPa : fitted ranges; outside of them there is no answer.
    rms, max : relative errors of the modulus, over the presses that were fitted.
    sd_rms : relative rms error of S_d there.
    doubt : relative standard deviation of S_d from mesh, large strain and friction.

    Raises `InputError` for other than five finite coefficients.
    """

    coefficients: np.ndarray
    force_N: tuple[float, float]
    modulus_MPa: tuple[float, float]
    rms: float
    max: float
    sd_rms: float
    doubt: float = 0.0
    __repr__ = short_repr

    def __post_init__(self):
        if np.shape(self.coefficients) != (len(TERMS),) or not np.isfinite(self.coefficients).all():
            raise InputError("the compact form has five finite coefficients")

    def predict(self, force_N: ArrayLike, modulus_MPa: ArrayLike) -> np.ndarray:
        """S_d in microstrain at forces (N) and moduli (MPa) that broadcast, inside the ranges or not."""
        return np.exp(ln_sd(self.coefficients, np.log(force_N), np.log(modulus_MPa)))

    def invert(
        self, sd_microstrain: float, force_N: float, sd_sigma: float = 0.0, force_sigma: float = 0.0
    ) -> tuple[float, float]:
        """The modulus in MPa and its standard deviation; (NaN, NaN) if the status of `answer` is not ok."""
        found = self.answer(sd_microstrain, force_N, sd_sigma, force_sigma)
        return found.modulus_MPa, found.sigma_MPa

    def answer(
        self, sd_microstrain: float, force_N: float, sd_sigma: float = 0.0, force_sigma: float = 0.0
    ) -> "CompactAnswer":
        """The modulus with sigma, 95 % interval and status; sd_sigma, force_sigma : of the two inputs.

        E = exp(d + e x) / (exp(a + b x + c x^2) / S_d - 1); sigma_lnE^2 = rms^2 + (sigma_lnS / s)^2 with s = dlnS/dlnE.
        """
        if not self.force_N[0] <= force_N <= self.force_N[1]:
            return CompactAnswer(CompactStatus.FORCE_OUTSIDE)
        if not 0 < sd_microstrain < math.inf:
            return CompactAnswer(CompactStatus.NO_READING)
        a, b, c, d, e = map(float, self.coefficients)
        x = math.log(force_N)
        room = math.exp(a + (b + c * x) * x) / sd_microstrain - 1
        spring = math.exp(d + e * x)
        if room <= 0 or spring / room > self.modulus_MPa[1]:
            return CompactAnswer(CompactStatus.HARDER)
        if spring / room < self.modulus_MPa[0]:
            return CompactAnswer(CompactStatus.SOFTER)
        modulus = spring / room
        along_modulus = room / (1 + room)
        along_force = b + 2 * c * x - e * along_modulus
        noise = math.sqrt(self.doubt**2 + (sd_sigma / sd_microstrain) ** 2 + (along_force * force_sigma / force_N) ** 2)
        relative = math.sqrt(self.rms**2 + (noise / along_modulus) ** 2)
        ends = (modulus * math.exp(sign * NORMAL_FACTOR * relative) for sign in (-1, 1))
        return CompactAnswer(CompactStatus.OK, modulus, modulus * relative, *ends)


def ln_sd(coefficients: np.ndarray, ln_force: np.ndarray, ln_modulus: np.ndarray) -> np.ndarray:
    """The form, at arrays that broadcast."""
    a, b, c, d, e = coefficients
    x = np.asarray(ln_force, float)
    return a + (b + c * x) * x - np.log1p(np.exp(d + e * x - ln_modulus))
