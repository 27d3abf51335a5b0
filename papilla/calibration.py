"""The calibration record: S_d from force and modulus, and the modulus back from S_d, with what is known of its error.

Made by `papilla.calibrate`; this module needs NumPy only, so estimators use it anywhere. `softness.surface` of the
file is ln S_d over (ln force, ln modulus) and is what `predict` and `invert` use; the published quadratic is kept
beside it for comparison.
"""

import math
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property
from pathlib import Path

import numpy as np

from papilla.errors import InputError
from papilla.point_surface import PointSurface, inside
from papilla.quadratic import Quadratic, QuadraticInverse
from papilla.surface import Surface

LEVEL = 0.95
"""Probability of the stated intervals."""
NORMAL_FACTOR = 1.959963984540054
"""Half width of the central 95 % of a normal distribution, in standard deviations."""
IDENTIFIABLE = 0.5
"""sigma_E / E above which a modulus is called not identifiable (the sensor cannot tell)."""


class SoftnessStatus(IntEnum):
    """What became of an answer; `sentence` says it in words."""

    OK = 0
    NOT_IDENTIFIABLE = 1
    SOFTER = 2
    HARDER = 3
    FORCE_BELOW = 4
    FORCE_ABOVE = 5
    NO_CONTACT = 6
    BAD_GAUGE = 7
    BAD_INPUT = 8

    @property
    def sentence(self) -> str:
        """The status in words."""
        return _SENTENCES[self]


_SENTENCES = {
    SoftnessStatus.OK: "ok",
    SoftnessStatus.NOT_IDENTIFIABLE: "not identifiable: sigma is more than half of the modulus, or S_d fits two",
    SoftnessStatus.SOFTER: "softer than calibrated",
    SoftnessStatus.HARDER: "harder than the sensor can tell",
    SoftnessStatus.FORCE_BELOW: "force below the calibrated domain",
    SoftnessStatus.FORCE_ABOVE: "force above the calibrated domain",
    SoftnessStatus.NO_CONTACT: "no contact",
    SoftnessStatus.BAD_GAUGE: "bad gauge: a reading is missing, saturated or stuck, so there is no S_d",
    SoftnessStatus.BAD_INPUT: "force or S_d is not a positive finite number",
}


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """How far a fitted surface may be off, in the units of the surface.

    fit_rms, fit_max : residuals of the fit (rms with the degrees of freedom taken off).
    scatter_force_N, scatter : (k,) rms difference of independent meshes from this one, at rising forces; zero where
    none was given. scatter_factor : half width of the 95 % interval in `scatter`.
    meshes : how many meshes the scatter comes from.
    """

    fit_rms: float
    fit_max: float
    scatter_force_N: np.ndarray
    scatter: np.ndarray
    scatter_factor: float
    meshes: int

    def scatter_at(self, force_N: float) -> float:
        """Mesh scatter at one force, linear in ln force between the stated ones, constant beyond."""
        return float(np.interp(math.log(force_N), self._ln_force, self.scatter))

    @cached_property
    def _ln_force(self) -> np.ndarray:
        return np.log(self.scatter_force_N)


@dataclass(frozen=True, eq=False)
class SdSurface:
    """ln S_d (S_d in microstrain) with the part of it that can be inverted.

    usable : (m, 2) int, per force cell the first and last modulus node between which data are and S_d rises.
    twofold : (m, 2) range of ln S_d that a falling part of the force cell takes up too; NaN where there is none.
    """

    surface: Surface
    usable: np.ndarray
    twofold: np.ndarray
    uncertainty: Uncertainty

    @cached_property
    def point(self) -> PointSurface:
        """The surface for one point at a time."""
        return PointSurface(self.surface)

    @cached_property
    def _limits(self) -> tuple[tuple[int, int, float, float], ...]:
        rows = zip(self.usable.tolist(), self.twofold.tolist(), strict=True)
        return tuple((low, high, first, last) for (low, high), (first, last) in rows)

    def usable_nodes(self, ln_force: float) -> tuple[int, int]:
        """First and last usable modulus node at a force of the domain (equal where there is none)."""
        low, high, *_ = self._limits[self.point.force_cell(ln_force)]
        return low, high

    def ln_modulus(self, ln_force: float, ln_sd: float) -> tuple[float, SoftnessStatus]:
        """ln E at a force of the domain, and OK; or NaN and the side on which ln S_d leaves the usable range."""
        low, high, first, last = self._limits[self.point.force_cell(ln_force)]
        if low >= high or first <= ln_sd <= last:
            return math.nan, SoftnessStatus.NOT_IDENTIFIABLE
        bottom, top = self.point.node_value(ln_force, low), self.point.node_value(ln_force, high)
        if not inside(ln_sd, bottom, top):
            return math.nan, SoftnessStatus.SOFTER if ln_sd < bottom else SoftnessStatus.HARDER
        return self.point.solve(ln_force, ln_sd, low, high), SoftnessStatus.OK


@dataclass(frozen=True, eq=False)
class GaugeSurface:
    """Reading / force of one gauge (microstrain / N) over (ln force, ln modulus)."""

    name: str
    surface: Surface
    uncertainty: Uncertainty

    def reading(self, force_N, modulus_MPa):
        """Reading in microstrain at forces and moduli that broadcast; NaN outside the domain."""
        return np.asarray(force_N, float) * self.surface(force_N, modulus_MPa)


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
class Calibration:
    """A finger's calibration.

    Parameters
    ----------
    finger : {"name", "sha256"}; mesh : what the sweep was computed on (empty for a bench calibration).
    forward, inverse : the published quadratic form and its exact inverse (gf, MPa, microstrain).
    surface : ln S_d, used by `predict` and `invert`; gauges : one surface a gauge.
    provenance : versions, hashes, when; notes : what a user has to doubt, a sentence each.
    """

    finger: dict
    mesh: dict
    forward: Quadratic
    inverse: QuadraticInverse
    surface: SdSurface
    gauges: tuple[GaugeSurface, ...]
    provenance: dict
    notes: tuple[str, ...] = ()

    @property
    def domain(self) -> dict[str, tuple[float, float]]:
        """{"force_N", "modulus_MPa"}: the ranges that were calibrated."""
        return {"force_N": self.surface.surface.force_N, "modulus_MPa": self.surface.surface.modulus_MPa}

    @classmethod
    def load(cls, path) -> "Calibration":
        """Read a calibration file.

        Raises `FileAccessError` where it cannot be read, `FileFormatError` where it is truncated, of an unknown schema
        or holds something else than it should; the message names the file and the key.
        """
        from papilla.calibration_file import read_calibration

        return read_calibration(Path(path))

    def save(self, path) -> None:
        """Write the calibration as JSON, whole or not at all; raises `FileAccessError`."""
        from papilla.calibration_file import write_calibration

        write_calibration(self, Path(path))

    def predict(self, force_N, modulus_MPa):
        """S_d in microstrain at forces (N) and moduli (MPa) that broadcast; NaN outside the domain."""
        return np.exp(self.surface.surface(force_N, modulus_MPa))

    def predict_readings(self, force_N, modulus_MPa) -> np.ndarray:
        """(..., g) gauge readings in microstrain at forces and moduli that broadcast; NaN outside the domain."""
        return np.stack([gauge.reading(force_N, modulus_MPa) for gauge in self.gauges], axis=-1)

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
        random = math.hypot(known.fit_rms, sd_sigma / sd, along_force * force_sigma / force)
        scatter = known.scatter_at(force)
        half = math.hypot(NORMAL_FACTOR * random, known.scatter_factor * scatter)
        lower, upper = self._end(ln_force, ln_sd - half), self._end(ln_force, ln_sd + half)
        if status is not SoftnessStatus.OK:
            return Inversion(math.nan, math.nan, lower, upper, status)
        relative = math.hypot(random, scatter) / along_modulus if along_modulus > 0 else math.inf
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
