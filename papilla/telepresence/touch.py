"""A simulated sensor over a texture: gratings, two side by side or a recorded one, under one gauge that slides over it,
or under a whole finger on a soft specimen."""

import math
from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from papilla.calibration import Calibration
from papilla.core import checks
from papilla.core.errors import InputError
from papilla.estimators import Doubts, Pipeline
from papilla.estimators.wavelength.lines import find_lines, travelled
from papilla.logs import TimeLog
from papilla.telepresence.sensing import ContactArea, Sensing

GRATING_HARMONICS = (1, 3, 5)
SKIN_MM = 0.1
"""Standard deviation of the Gaussian that models the skin's averaging of a profile."""
PASS_BAND_HZ = 400.0
"""Cut-off of an amplifier's anti-aliasing filter: higher harmonics do not exist at 1 kHz."""

LEAST_MM = 10.0
"""Smallest path of a recorded texture."""


class ReadingSource(Protocol):
    """Something that gives a reading at a place."""

    def reading(self, place_mm: float, speed_mm_s: float) -> float:
        """Reading of the gauge at a place, in microstrain, at this speed."""

    def wavelength(self, place_mm: float) -> float:
        """The true wavelength at a place, in mm; NaN if there is none or it is not known."""


class GratingTexture:
    """A grating with groove = ridge, felt through the skin; the fundamental has this amplitude in microstrain."""

    def __init__(self, wavelength_mm: float, amplitude_microstrain: float = 50.0):
        self.wavelength_mm = checks.positive("wavelength_mm", wavelength_mm)
        self.amplitude = checks.positive("amplitude_microstrain", amplitude_microstrain)
        turn = 2 * math.pi * SKIN_MM / self.wavelength_mm
        # A square wave has the odd harmonics (-1)^((n-1)/2) / n; the Gaussian skin weakens the n-th by
        # exp(-(n turn)^2 / 2), and the fundamental keeps the stated amplitude.
        self._sizes = [math.exp(-0.5 * (n * n - 1) * turn * turn) / n * (1, -1)[n // 2 % 2] for n in GRATING_HARMONICS]

    def reading(self, place_mm: float, speed_mm_s: float) -> float:
        """Reading of the gauge at a place."""
        turn = 2 * math.pi * place_mm / self.wavelength_mm
        rate = abs(speed_mm_s) / self.wavelength_mm
        shares = (
            size * math.cos(n * turn)
            for n, size in zip(GRATING_HARMONICS, self._sizes, strict=True)
            if n * rate < PASS_BAND_HZ
        )
        return self.amplitude * sum(shares)

    def wavelength(self, place_mm: float) -> float:
        """The wavelength, the same everywhere."""
        return self.wavelength_mm


class SideBySide:
    """One texture left of `border_mm`, another right of it."""

    def __init__(self, left: ReadingSource, right: ReadingSource, border_mm: float):
        self.left, self.right, self.border_mm = left, right, checks.finite("border_mm", border_mm)

    def _of(self, place_mm: float) -> ReadingSource:
        return self.left if place_mm < self.border_mm else self.right

    def reading(self, place_mm: float, speed_mm_s: float) -> float:
        """Reading of the gauge at a place."""
        return self._of(place_mm).reading(place_mm, speed_mm_s)

    def wavelength(self, place_mm: float) -> float:
        """The wavelength of the texture at a place."""
        return self._of(place_mm).wavelength(place_mm)


class RecordedTexture:
    """Readings over the path of a log: its longest stroke in one direction; there are no readings outside.

    positions_mm, readings : (n,). `wavelength_mm` is the strongest line over that path, NaN if none is significant.
    Raises `InputError` for a stroke shorter than `LEAST_MM`.
    """

    def __init__(self, positions_mm: ArrayLike, readings: ArrayLike):
        place, value = np.asarray(positions_mm, float), np.asarray(readings, float)
        valid = np.isfinite(place) & np.isfinite(value)
        place, value = place[valid], value[valid]
        moved = np.flatnonzero(np.diff(place, prepend=math.nan) != 0)
        place, value = place[moved], value[moved]
        # Split where the direction changes; the longest stroke is the texture.
        turns = np.flatnonzero(np.diff(np.sign(np.diff(place))) != 0) + 1 if place.size > 2 else np.array([], int)
        ends = np.concatenate([[0], turns, [max(0, place.size - 1)]]).astype(int)
        longest = int(np.argmax(np.abs(np.diff(place[ends])))) if place.size else 0
        rows = slice(ends[longest], ends[longest + 1] + 1)
        order = np.argsort(place[rows])
        self.place, self.value = place[rows][order], value[rows][order]
        length = float(np.ptp(self.place)) if self.place.size else 0.0
        if length < LEAST_MM:
            raise InputError(f"the longest stroke in one direction is {length:.3g} mm, {LEAST_MM:g} mm are needed")
        self.value = self.value - self.value.mean()
        lines = find_lines(self.place, self.value).lines
        self.wavelength_mm = lines[0].wavelength_mm if lines else math.nan

    @classmethod
    def of_log(cls, log: TimeLog, gauge: int = 0) -> "RecordedTexture":
        """The texture of a gauge of a log with a position or a velocity; raises `InputError` without either."""
        place = log.position_mm
        if place is None and log.velocity_mm_s is not None:
            place = travelled(log.t_s, log.velocity_mm_s)
        if place is None:
            raise InputError("a recorded texture needs a column position_mm or velocity_mm_s")
        return cls(place, log.readings[:, gauge])

    @property
    def reach_mm(self) -> tuple[float, float]:
        """First and last place of the stroke."""
        return float(self.place[0]), float(self.place[-1])

    def reading(self, place_mm: float, speed_mm_s: float) -> float:
        """The recorded reading at a place; NaN outside."""
        return float(np.interp(place_mm, self.place, self.value, left=math.nan, right=math.nan))

    def wavelength(self, place_mm: float) -> float:
        """The wavelength of the strongest line."""
        return self.wavelength_mm


SIMULATED_NOISE_MICROSTRAIN = 3.5
"""Standard deviation of a reading of the simulated gauges: 20 dB below a grating of 50 microstrain."""
GAUGES_MM = 6.0
"""Distance of neighbouring gauges along the movement (mm), about as in the default finger."""
SLIP_MM_S = 1.0
"""Speed (mm/s) in the friction mu N tanh(v / this), which avoids a step at rest."""
FORCE_SIGMA_N = 1e-3
"""Noise of both forces (N), as `Pipeline` expects it."""
TABLE_FORCES = 400
"""Number of forces in the table of readings, with linear interpolation between them."""
ENCODER_SCALE_SIGMA = 1e-3
"""Relative error of the path: the sensor's arm has an encoder."""


@dataclass(frozen=True, eq=False)
class Soft:
    """A soft specimen under a calibrated finger.

    Parameters
    ----------
    calibration : of the finger. modulus_MPa : of the specimen, within the calibrated range.
    friction : coefficient between both, static and kinetic alike.
    thickness_mm : of the specimen, if the sensor's side knows it; None: unknown, so the sigma of the modulus is larger.
    area : contact area of a force and a modulus; None: none is sent.

    Raises `InputError` for values out of range.
    """

    calibration: Calibration
    modulus_MPa: float
    friction: float = 0.5
    thickness_mm: float | None = None
    area: ContactArea | None = None

    def __post_init__(self):
        checks.within("modulus_MPa", self.modulus_MPa, *self.calibration.domain["modulus_MPa"])
        checks.within("friction", self.friction, 0, 10)

    def readings(self) -> tuple[np.ndarray, np.ndarray]:
        """Forces (n,) in N, and readings (n, g) of the press in microstrain; zero in the air.

        Raises `InputError` if the calibration has none at this modulus.
        """
        forces = np.geomspace(*self.calibration.domain["force_N"], TABLE_FORCES)
        readings = self.calibration.predict_readings(forces, np.full(TABLE_FORCES, self.modulus_MPa))
        if not np.isfinite(readings).all():
            raise InputError(f"the calibration has no readings of every gauge at {self.modulus_MPa:g} MPa")
        return np.insert(forces, 0, 0.0), np.insert(readings, 0, 0.0, axis=0)


class TouchLog:
    """Rows of a sensor under a hand: readings of its gauges, then `columns`.

    Without a `Soft`: one gauge over the texture, and the place. With a `Soft`: all gauges, with the press at the apex
    from the calibration and the texture, which reaches one gauge after the other; then force, place and tangential
    force. `texture` is the touched one, noise_microstrain the standard deviation of a reading.

    Raises `InputError` for a noise out of range, and as `Soft.readings`.
    """

    def __init__(
        self, texture: ReadingSource, noise_microstrain: float = SIMULATED_NOISE_MICROSTRAIN, soft: Soft | None = None
    ):
        self.texture, self.soft = texture, soft
        self._noise = checks.within("noise_microstrain", noise_microstrain, 0, 1e6)
        self.columns: tuple[str, ...] = ("position_mm",)
        self.gauges = self.numbers = 1
        if soft is not None:
            self.columns = ("force_N", "position_mm", "tangential_N")
            self.gauges = len(soft.calibration.gauges)
            self.numbers = self.gauges + 2
            forces, readings = soft.readings()
            self._forces, self._readings = forces.tolist(), readings.tolist()

    def row(self, place_mm: float, speed_mm_s: float, force_N: float, normal: Sequence[float]) -> tuple[float, ...]:
        """The sample at a place, a speed and a pressing force; normal : `numbers` standard normal numbers.

        Readings are NaN if the texture or the calibration has none.
        """
        texture, noise = self.texture, self._noise
        if self.soft is None:
            return texture.reading(place_mm, speed_mm_s) + noise * normal[0], place_mm
        gauges = [
            pressed + texture.reading(place_mm - number * GAUGES_MM, speed_mm_s) + noise * normal[number]
            for number, pressed in enumerate(self._pressed(force_N))
        ]
        pull = self.soft.friction * force_N * math.tanh(speed_mm_s / SLIP_MM_S) + FORCE_SIGMA_N * normal[-1]
        return *gauges, force_N + FORCE_SIGMA_N * normal[-2], place_mm, pull

    def _pressed(self, force_N: float) -> Sequence[float]:
        """Readings of all gauges under a force (N), linear between tabulated forces; NaN outside."""
        after = bisect_left(self._forces, force_N)
        if not (force_N >= 0 and after < len(self._forces)):
            return [math.nan] * self.gauges
        if after == 0:
            return self._readings[0]
        low, high = self._forces[after - 1], self._forces[after]
        share = (force_N - low) / (high - low)
        return [a + share * (b - a) for a, b in zip(self._readings[after - 1], self._readings[after], strict=True)]

    def sensing(self, components: int = 1) -> Sensing:
        """The estimators for these rows, with their noise and the accuracy of an encoder's path."""
        soft = self.soft
        pipeline = Pipeline(
            None if soft is None else soft.calibration,
            gauges=self.gauges,
            columns=self.columns,
            scale_sigma=ENCODER_SCALE_SIGMA,
            latency_s=0.0,
            gauge_sigma=max(self._noise, 1e-3),
            doubts=None if soft is None or soft.thickness_mm is None else Doubts(thickness_mm=soft.thickness_mm),
        )
        return Sensing(pipeline, components=components, area=None if soft is None else soft.area)
