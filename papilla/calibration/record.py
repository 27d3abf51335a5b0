"""The calibration record: S_d from force and modulus, and the modulus back from S_d, with what is known of its error.

`softness.surface` of the file is ln S_d over (ln force, ln modulus) and is what `predict` and `invert` use; the
published quadratic is kept beside it for comparison.
"""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from papilla.calibration.data import CalibrationData
from papilla.calibration.document import read_calibration, write_calibration
from papilla.calibration.position import PositionTerms
from papilla.calibration.readouts import NORMAL_FACTOR
from papilla.calibration.status import IDENTIFIABLE, SoftnessStatus
from papilla.errors import InputError


@dataclass(frozen=True)
class Inversion:
    """The modulus behind S_d; scalars, or arrays of one shape.

    modulus_MPa, sigma_MPa : estimate and its standard deviation; NaN where there is none.
    lower_MPa, upper_MPa : 95 % interval; 0 or inf where it leaves the calibrated moduli, NaN where nothing is known.
    status : `SoftnessStatus`, or an int array of its values. NOT_IDENTIFIABLE may come with an estimate: then its
    sigma is more than half of it, and only the interval means something.
    """

    modulus_MPa: float | np.ndarray
    sigma_MPa: float | np.ndarray
    lower_MPa: float | np.ndarray
    upper_MPa: float | np.ndarray
    status: "SoftnessStatus | np.ndarray"

    @property
    def interval(self) -> tuple:
        """(lower, upper) in MPa."""
        return self.lower_MPa, self.upper_MPa

    @property
    def sentence(self):
        """The status in words: a string, or an array of strings."""
        if isinstance(self.status, SoftnessStatus):
            return self.status.sentence
        words = [SoftnessStatus(code).sentence for code in self.status.ravel().tolist()]
        return np.array(words).reshape(self.status.shape)


@dataclass(frozen=True, eq=False)
class Calibration(CalibrationData):
    """A finger's calibration (its fields: `CalibrationData`): predicts S_d and inverts it."""

    @classmethod
    def load(cls, path) -> "Calibration":
        """Read a calibration file.

        Raises `FileAccessError` where it cannot be read, `FileFormatError` where it is truncated, of an unknown schema
        or holds something else than it should; the message names the file and the key.
        """
        return cls(**vars(read_calibration(Path(path))))

    def save(self, path) -> None:
        """Write the calibration as JSON, whole or not at all; raises `FileAccessError`."""
        write_calibration(self, Path(path))

    def predict(self, force_N, modulus_MPa):
        """S_d in microstrain at forces (N) and moduli (MPa) that broadcast; NaN outside the domain."""
        return np.exp(self.surface.surface(force_N, modulus_MPa))

    def predict_readings(self, force_N, modulus_MPa, position_mm=None) -> np.ndarray:
        """(..., g) gauge readings in microstrain at forces and moduli that broadcast; NaN outside the domain.

        position_mm : x of the contact along the finger, at the apex where it is None; broadcasts too. Raises
        `InputError` for a calibration that knows the apex alone.
        """
        apex = np.stack([gauge.reading(force_N, modulus_MPa) for gauge in self.gauges], axis=-1)
        if position_mm is None:
            return apex
        change = self.position_terms.change(force_N, modulus_MPa, position_mm)
        return apex + np.asarray(force_N, float)[..., None] * change

    @property
    def position_terms(self) -> PositionTerms:
        """What contacts beside the apex change; raises `InputError` where this calibration does not know it."""
        if self.position is None:
            raise InputError(
                "this calibration has no contact positions (softness.position): make it anew with papilla calibrate, "
                "from a finger's design"
            )
        return self.position

    def invert(self, sd_microstrain, force_N, *, sd_sigma=0.0, force_sigma=0.0) -> Inversion:
        """The modulus behind S_d at a force; scalars, or arrays that broadcast.

        Parameters
        ----------
        sd_microstrain, force_N : S_d (population standard deviation of the readings) and force.
        sd_sigma, force_sigma : standard deviations of the two (microstrain, N); the fit's residual and the mesh
            scatter are added to them: sigma_lnE = sigma_lnS / (d ln S_d / d ln E).

        Never extrapolates: outside the domain there is no modulus, and the status says why. Raises `InputError` for
        a negative standard deviation.
        """
        arguments = (sd_microstrain, force_N, sd_sigma, force_sigma)
        if all(np.ndim(value) == 0 for value in arguments):
            return self._invert_one(*map(float, arguments))
        rows = np.broadcast_arrays(*(np.asarray(value, float) for value in arguments))
        answers = [self._invert_one(*row) for row in zip(*(row.ravel().tolist() for row in rows), strict=True)]
        names = ("modulus_MPa", "sigma_MPa", "lower_MPa", "upper_MPa", "status")
        shape = rows[0].shape
        return Inversion(*(np.array([getattr(one, name) for one in answers]).reshape(shape) for name in names))

    def _invert_one(self, sd: float, force: float, sd_sigma: float, force_sigma: float) -> Inversion:
        if not (sd_sigma >= 0 and force_sigma >= 0):
            raise InputError(f"sd_sigma and force_sigma must not be negative, got {sd_sigma} and {force_sigma}")
        status = self.check_force(force) if 0 < sd < math.inf else SoftnessStatus.BAD_INPUT
        if status is not SoftnessStatus.OK:
            return Inversion(math.nan, math.nan, math.nan, math.nan, status)
        ln_force, ln_sd = math.log(force), math.log(sd)
        ln_modulus, status = self.surface.ln_modulus(ln_force, ln_sd)
        # Beyond the usable range the force slope of its nearest end stands for the unknown one.
        at = ln_modulus if status is SoftnessStatus.OK else self._nearest_end(ln_force, status)
        _, along_force, along_modulus = self.surface.point.evaluate(ln_force, at)
        known = self.surface.uncertainty
        measured = math.hypot(sd_sigma / sd, along_force * force_sigma / force)
        scatter = known.scatter_at(force)
        half = math.hypot(NORMAL_FACTOR * measured, known.fit_factor * known.fit_rms, known.scatter_factor * scatter)
        lower, upper = self._end(ln_force, ln_sd - half), self._end(ln_force, ln_sd + half)
        if status is not SoftnessStatus.OK:
            return Inversion(math.nan, math.nan, lower, upper, status)
        relative = math.hypot(measured, known.fit_rms, scatter) / along_modulus if along_modulus > 0 else math.inf
        if relative > IDENTIFIABLE:
            status = SoftnessStatus.NOT_IDENTIFIABLE
        modulus = math.exp(ln_modulus)
        return Inversion(modulus, relative * modulus, lower, upper, status)

    def check_force(self, force_N: float) -> SoftnessStatus:
        """OK inside the domain of forces, or on which side of it a force is."""
        low, high = self.surface.surface.force_N
        if low <= force_N <= high:
            return SoftnessStatus.OK
        if not 0 < force_N < math.inf:
            return SoftnessStatus.BAD_INPUT
        return SoftnessStatus.FORCE_BELOW if force_N < low else SoftnessStatus.FORCE_ABOVE

    def _nearest_end(self, ln_force: float, status: SoftnessStatus) -> float:
        low, high = self.surface.usable_nodes(ln_force)
        axis = self.surface.surface.modulus_axis
        return axis.start + axis.step * (high if status is SoftnessStatus.HARDER else low)

    def _end(self, ln_force: float, ln_sd: float) -> float:
        """An end of an interval: 0 or inf where it leaves the calibrated moduli, NaN where S_d has no inverse."""
        ln_modulus, status = self.surface.ln_modulus(ln_force, ln_sd)
        if status is SoftnessStatus.OK:
            return math.exp(ln_modulus)
        return {SoftnessStatus.SOFTER: 0.0, SoftnessStatus.HARDER: math.inf}.get(status, math.nan)
