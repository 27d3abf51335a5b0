"""What a simulated sensor samples: one gauge that slides over a texture, or a whole finger on a soft specimen."""

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

GAUGES_MM = 6.0
"""From one gauge to the next along the movement, about as in the default finger."""
SLIP_MM_S = 1.0
"""Friction is mu N tanh(v / this), in place of a step at rest."""
FORCE_SIGMA_N = 1e-3
"""Noise of both forces, that which `Pipeline` expects."""
FORCES = 400
"""Of the table of readings; between two of them a reading is on a straight line."""
SCALE_SIGMA = 1e-3
"""The sensor's arm has an encoder: its path is right to 0.1 %."""


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
        """Forces (n,) in N, and readings (n, g) of the press in microstrain; none in the air.

        Raises `InputError` where the calibration has none at this modulus.
        """
        forces = np.geomspace(*self.calibration.domain["force_N"], FORCES)
        readings = self.calibration.predict_readings(forces, np.full(FORCES, self.modulus_MPa))
        if not np.isfinite(readings).all():
            raise InputError(f"the calibration has no readings of every gauge at {self.modulus_MPa:g} MPa")
        return np.insert(forces, 0, 0.0), np.insert(readings, 0, 0.0, axis=0)


class Touch:
    """Rows of a sensor under a hand: readings of its gauges, then `columns`.

    Without a `Soft`, one gauge over the texture and the place. With one, all gauges: the press at the apex as the
    calibration has it, and the texture, which reaches one gauge after the other; then force, place and tangential
    force. `texture` is what is touched, noise_microstrain the standard deviation of a reading.

    Raises `InputError` for a noise out of range, and as `Soft.readings`.
    """

    def __init__(self, texture: Texture, noise_microstrain: float = 3.5, soft: Soft | None = None):
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
        """What is sampled at a place, a speed and a pressing force; normal : `numbers` standard normal numbers.

        Readings are NaN where the texture or the calibration has none.
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
        """Readings of all gauges under a force (N), on a straight line between tabulated forces; NaN outside."""
        after = bisect_left(self._forces, force_N)
        if not (force_N >= 0 and after < len(self._forces)):
            return [math.nan] * self.gauges
        if after == 0:
            return self._readings[0]
        low, high = self._forces[after - 1], self._forces[after]
        share = (force_N - low) / (high - low)
        return [a + share * (b - a) for a, b in zip(self._readings[after - 1], self._readings[after], strict=True)]

    def sensing(self, components: int = 1) -> Sensing:
        """The estimators for these rows, which know the noise, and that the path is an encoder's."""
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
