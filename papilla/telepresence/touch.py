"""Samples of a simulated sensor: one gauge that slides over a texture, or a whole finger on a soft specimen."""

import math
from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from papilla import checks
from papilla.calibration import Calibration
from papilla.errors import InputError
from papilla.estimators import Doubts, Pipeline
from papilla.telepresence.contact_area import ContactArea
from papilla.telepresence.sensing import Sensing
from papilla.telepresence.texture import Texture

NOISE_MICROSTRAIN = 3.5
"""Standard deviation of a reading of the simulated gauges: 20 dB below a grating of 50 microstrain."""
GAUGES_MM = 6.0
"""Distance of neighbouring gauges along the movement (mm), about as in the default finger."""
SLIP_MM_S = 1.0
"""Speed (mm/s) in the friction mu N tanh(v / this), which avoids a step at rest."""
FORCE_SIGMA_N = 1e-3
"""Noise of both forces (N), as `Pipeline` expects it."""
FORCES = 400
"""Number of forces in the table of readings, with linear interpolation between them."""
SCALE_SIGMA = 1e-3
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
        forces = np.geomspace(*self.calibration.domain["force_N"], FORCES)
        readings = self.calibration.predict_readings(forces, np.full(FORCES, self.modulus_MPa))
        if not np.isfinite(readings).all():
            raise InputError(f"the calibration has no readings of every gauge at {self.modulus_MPa:g} MPa")
        return np.insert(forces, 0, 0.0), np.insert(readings, 0, 0.0, axis=0)


class Touch:
    """Rows of a sensor under a hand: readings of its gauges, then `columns`.

    Without a `Soft`: one gauge over the texture, and the place. With a `Soft`: all gauges, with the press at the apex
    from the calibration and the texture, which reaches one gauge after the other; then force, place and tangential
    force. `texture` is the touched one, noise_microstrain the standard deviation of a reading.

    Raises `InputError` for a noise out of range, and as `Soft.readings`.
    """

    def __init__(self, texture: Texture, noise_microstrain: float = NOISE_MICROSTRAIN, soft: Soft | None = None):
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
            scale_sigma=SCALE_SIGMA,
            latency_s=0.0,
            gauge_sigma=max(self._noise, 1e-3),
            doubts=None if soft is None or soft.thickness_mm is None else Doubts(thickness_mm=soft.thickness_mm),
        )
        return Sensing(pipeline, components=components, area=None if soft is None else soft.area)
