"""The calibration record: S_d from force and modulus, and the modulus from S_d, with its uncertainty.

`softness.surface` of the file is ln S_d over (ln force, ln modulus) and is what `predict` and `invert` use. The
published form, S_d = a f^2 + b f + c E^2 + d E + e (2006, eq. 9) with f in gram-force, E in MPa and S_d in microstrain,
is kept for comparison, with its exact inverse.
"""

import math
import warnings
from dataclasses import dataclass, fields
from os import PathLike
from pathlib import Path
from typing import cast

import numpy as np
from numpy.typing import ArrayLike

from papilla.calibration import readouts
from papilla.calibration.published import Quadratic, QuadraticInverse
from papilla.calibration.readouts import Compact, GaugeSurface, PositionTerms, SdSurface, SoftnessStatus
from papilla.core import checks
from papilla.core.errors import InputError
from papilla.core.sealed import write_sealed
from papilla.core.short_repr import html_table, short_repr
from papilla.core.units import PER_CENT

ERROR_GRID_POINTS = 8
"""Points along each axis of the domain over which an error is averaged."""


@dataclass(frozen=True)
class Inversion:
    """The modulus behind S_d; scalars, or arrays of one shape.

    modulus_MPa, sigma_MPa : estimate and its standard deviation; NaN if there is none.
    lower_MPa, upper_MPa : 95 % interval; 0 or inf if it leaves the calibrated moduli, NaN if S_d has no inverse.
    dominant : the largest contribution to sigma: "measurement", "fit", "mesh", "large strain" or "friction"; "" without
    sigma.
    status : `SoftnessStatus`, or an int array of its values. NOT_IDENTIFIABLE may come with an estimate: then its
    sigma is more than half of it, and only the interval means something.
    """

    modulus_MPa: float | np.ndarray
    sigma_MPa: float | np.ndarray
    lower_MPa: float | np.ndarray
    upper_MPa: float | np.ndarray
    status: SoftnessStatus | np.ndarray
    dominant: str | np.ndarray = ""
    __repr__ = short_repr

    @property
    def interval(self) -> tuple[float | np.ndarray, float | np.ndarray]:
        """(lower, upper) in MPa."""
        return self.lower_MPa, self.upper_MPa

    @property
    def sentence(self) -> str | np.ndarray:
        """The status in words: a string, or an array of strings."""
        if isinstance(self.status, SoftnessStatus):
            return self.status.sentence
        return np.array(SoftnessStatus.in_words(self.status.ravel())).reshape(self.status.shape)


@dataclass(frozen=True, eq=False, repr=False)
class Calibration:
    """A finger's calibration: predicts S_d and inverts it.

    Parameters
    ----------
    finger : {"name", "sha256"}, "ridge_pitch_mm" (0 for a smooth skin); mesh : what the sweep was computed on
        (empty for a bench calibration).
    forward, inverse : the published quadratic form and its exact inverse (gf, MPa, microstrain).
    surface : ln S_d, used by `predict` and `invert`; gauges : one surface a gauge.
    provenance : versions, hashes, when; notes : limitations, a sentence each.
    position : changes by contacts beside the apex; None if they are not known.
    compact : five coefficients with a closed-form inverse, for a microcontroller; None if they do not fit.
    file_note : a warning about the file that it was loaded from; empty if the file is as papilla wrote it.
    """

    finger: dict
    mesh: dict
    forward: Quadratic
    inverse: QuadraticInverse
    surface: SdSurface
    gauges: tuple[GaugeSurface, ...]
    provenance: dict
    notes: tuple[str, ...] = ()
    position: PositionTerms | None = None
    file_note: str = ""
    compact: Compact | None = None

    @property
    def domain(self) -> dict[str, tuple[float, float]]:
        """{"force_N", "modulus_MPa"}: the calibrated ranges."""
        return {"force_N": self.surface.surface.force_N, "modulus_MPa": self.surface.surface.modulus_MPa}

    @property
    def doubt(self) -> str:
        """Why no answer of this calibration is plainly ok: a warning about its file, or a check that it failed; empty
        if there is nothing."""
        return self.file_note or str(self.provenance.get("unconfirmed", ""))

    @property
    def ridge_pitch_mm(self) -> float | None:
        """Pitch of the finger's ridges in mm, 0 for a smooth skin, None if it was not stated; raises `InputError`."""
        pitch = self.finger.get("ridge_pitch_mm")
        return None if pitch is None else checks.within("the calibration's finger.ridge_pitch_mm", pitch, 0, 100)

    def __repr__(self) -> str:
        force, modulus = ("-".join(f"{limit:g}" for limit in self.domain[key]) for key in ("force_N", "modulus_MPa"))
        name, count = self.finger.get("name") or "a measured finger", len(self.gauges)
        lacks = self.provenance.get("lacks")
        short = f"; intervals lack {' and '.join(map(str, lacks))}" if isinstance(lacks, list) and lacks else ""
        return f"<Calibration of {name}: {count} gauges, {force} N, {modulus} MPa, {len(self.notes)} notes{short}>"

    def _repr_html_(self) -> str:
        """Domain, uncertainties and notes as a table, for notebooks."""
        rows: list[tuple[str, object]] = [("gauges", len(self.gauges))]
        rows += [(key, f"{low:g} to {high:g}") for key, (low, high) in self.domain.items()]
        rows += [(f"S_d, one sigma of {name}", f"{PER_CENT * sigma:.2g} %") for name, sigma in self.sigmas.items()]
        rows += [("note", note) for note in self.notes]
        return html_table(f"Calibration of {self.finger.get('name') or 'a measured finger'}", rows)

    @classmethod
    def load(cls, path: str | PathLike) -> "Calibration":
        """Read a calibration file.

        A file that was changed after papilla wrote it, or that has no checksum, comes with a `file_note` and a
        `UserWarning`. Raises `FileAccessError` if it cannot be read, `FileFormatError` if it is truncated, has an
        unknown schema or a wrong value; the message names the file and the key.
        """
        # Imported here: pydantic is slow to import, and an estimator that receives a calibration does not need it.
        from papilla.calibration.document import read_calibration

        calibration = read_calibration(cls, Path(path))
        if calibration.file_note:
            warnings.warn(f"{path}: {calibration.file_note}", stacklevel=2)
        return calibration

    def save(self, path: str | PathLike) -> None:
        """Write the calibration as JSON, whole or not at all; raises `FileAccessError`."""
        from papilla.calibration.document import to_document

        write_sealed(to_document(self), Path(path))

    def predict(self, force_N: ArrayLike, modulus_MPa: ArrayLike) -> np.ndarray:
        """S_d in microstrain at forces (N) and moduli (MPa) that broadcast; NaN outside the domain."""
        return np.exp(self.surface.surface(force_N, modulus_MPa))

    def predict_readings(
        self, force_N: ArrayLike, modulus_MPa: ArrayLike, position_mm: ArrayLike | None = None
    ) -> np.ndarray:
        """(..., g) gauge readings in microstrain at forces and moduli that broadcast; NaN outside the domain.

        position_mm : x of the contact along the finger, None means the apex; it broadcasts, too. Raises `InputError`
        for a calibration of the apex alone.
        """
        apex = np.stack([gauge.reading(force_N, modulus_MPa) for gauge in self.gauges], axis=-1)
        if position_mm is None:
            return apex
        change = self.position_terms.change(force_N, modulus_MPa, position_mm)
        return apex + np.asarray(force_N, float)[..., None] * change

    @property
    def position_terms(self) -> PositionTerms:
        """How readings change with the place of contact; raises `InputError` if the calibration lacks this."""
        if self.position is None:
            raise InputError(
                "this calibration has no contact positions (softness.position): make it again with papilla calibrate, "
                "from a finger's design"
            )
        return self.position

    def invert(
        self,
        sd_microstrain: ArrayLike,
        force_N: ArrayLike,
        *,
        sd_sigma: ArrayLike = 0.0,
        force_sigma: ArrayLike = 0.0,
        interval: bool = True,
    ) -> Inversion:
        """The modulus behind S_d at a force; scalars, or arrays that broadcast.

        Parameters
        ----------
        sd_microstrain, force_N : S_d (population standard deviation of the readings) and force.
        sd_sigma, force_sigma : standard deviations of the two (microstrain, N). The residual of the fit, the mesh
            scatter and the uncertainty of large strain and friction are added: sigma_lnE = sigma_lnS / (d ln S_d / d ln
            E). Unknown friction widens the interval on one side, towards the press without friction.
        interval : whether to compute the 95 % interval; it takes most of the time, and is NaN otherwise.

        It does not extrapolate: outside the domain there is no modulus, and the status says why. Raises `InputError`
        for a negative standard deviation.
        """
        arguments = (sd_microstrain, force_N, sd_sigma, force_sigma)
        if all(np.ndim(value) == 0 for value in arguments):
            return self._invert_one(*map(float, cast(tuple[float, ...], arguments)), interval=interval)
        inputs = np.broadcast_arrays(*(np.asarray(value, float) for value in arguments))
        rows = zip(*(values.ravel().tolist() for values in inputs), strict=True)
        answers = [self._invert_one(*press, interval=interval) for press in rows]
        columns = ([getattr(answer, item.name) for answer in answers] for item in fields(Inversion))
        return Inversion(*(np.array(column).reshape(inputs[0].shape) for column in columns))

    def _invert_one(self, sd: float, force: float, sd_sigma: float, force_sigma: float, *, interval: bool) -> Inversion:
        """`invert` for single numbers."""
        if not (sd_sigma >= 0 and force_sigma >= 0):
            raise InputError(f"sd_sigma and force_sigma must not be negative, got {sd_sigma} and {force_sigma}")
        status = self.check_force(force) if 0 < sd < math.inf else SoftnessStatus.BAD_INPUT
        if status is not SoftnessStatus.OK:
            return Inversion(math.nan, math.nan, math.nan, math.nan, status)
        ln_force, ln_sd = math.log(force), math.log(sd)
        ln_modulus, status = self.surface.ln_modulus(ln_force, ln_sd)
        # Beyond the usable range the slope over force is taken from its nearest end.
        at = ln_modulus
        if status is not SoftnessStatus.OK:
            axis, nodes = self.surface.surface.modulus_axis, self.surface.usable_nodes(ln_force)
            at = axis.start + axis.step * nodes[status is SoftnessStatus.HARDER]
        (_, along_modulus), (along_force, _) = self.surface.surface.spline.at(ln_force, at)[..., 0].tolist()
        doubt = self.surface.uncertainty
        sigmas = {"measurement": math.hypot(sd_sigma / sd, along_force * force_sigma / force)}
        sigmas |= doubt.sigmas(ln_force, at)
        factors = {"fit": doubt.fit_factor, "friction": 0.0}
        half = math.hypot(*(factors.get(name, readouts.NORMAL_FACTOR) * sigma for name, sigma in sigmas.items()))
        ends = (-half, half) if interval else ()
        lower, upper = [self._end(ln_force, ln_sd, end, at) for end in ends] or (math.nan, math.nan)
        if status is not SoftnessStatus.OK:
            return Inversion(math.nan, math.nan, lower, upper, status)
        relative = math.hypot(*sigmas.values()) / along_modulus if along_modulus > 0 else math.inf
        if relative > readouts.IDENTIFIABLE_SIGMA:
            status = SoftnessStatus.NOT_IDENTIFIABLE
        modulus, dominant = math.exp(ln_modulus), max(sigmas, key=lambda name: sigmas[name])
        return Inversion(modulus, relative * modulus, lower, upper, status, dominant)

    @property
    def sigmas(self) -> dict[str, float]:
        """Relative standard deviation of S_d, root mean square over the domain, by its cause."""
        low, high = (np.log(limits) for limits in zip(*self.domain.values(), strict=True))
        grid = np.linspace(low, high, 2 * ERROR_GRID_POINTS + 1)[1::2]
        parts = [self.surface.uncertainty.sigmas(x, y) for x in grid[:, 0].tolist() for y in grid[:, 1].tolist()]
        return {name: float(np.sqrt(np.mean([point[name] ** 2 for point in parts]))) for name in parts[0]}

    @property
    def dominant(self) -> str:
        """The largest contribution to the sigma of a modulus, without that of the measurement."""
        sigmas = self.sigmas
        return max(sigmas, key=lambda name: sigmas[name])

    def check_force(self, force_N: float) -> SoftnessStatus:
        """OK inside the domain of forces, or the side on which a force lies outside."""
        low, high = self.surface.surface.force_N
        if low <= force_N <= high:
            return SoftnessStatus.OK
        if not 0 < force_N < math.inf:
            return SoftnessStatus.BAD_INPUT
        return SoftnessStatus.FORCE_BELOW if force_N < low else SoftnessStatus.FORCE_ABOVE

    def _end(self, ln_force: float, ln_sd: float, half: float, at: float) -> float:
        """An end of an interval: 0 or inf if it leaves the calibrated moduli, NaN if S_d has no inverse.

        The effect of friction is evaluated at the end itself, which is found iteratively from `at`.
        """
        doubt, ln_modulus, status = self.surface.uncertainty, at, SoftnessStatus.OK
        for _ in range(1 if doubt.friction is None else 3):
            shift = doubt.friction_at(ln_force, ln_modulus)
            reach = math.copysign(readouts.two_ended(abs(half), shift), half)
            # Without friction S_d is larger by `shift`, so the same S_d then belongs to a lower modulus.
            drawn = max(shift, 0.0) if half < 0 else min(shift, 0.0)
            ln_modulus, status = self.surface.ln_modulus(ln_force, ln_sd - drawn + reach)
            if status is not SoftnessStatus.OK:
                return {SoftnessStatus.SOFTER: 0.0, SoftnessStatus.HARDER: math.inf}.get(status, math.nan)
        return math.exp(ln_modulus)
