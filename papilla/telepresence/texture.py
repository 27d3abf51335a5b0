"""Textures under a simulated sensor: gratings, two side by side, or a recorded one."""

import math
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from papilla import checks
from papilla.errors import InputError
from papilla.estimators.lines import find_lines, travelled
from papilla.logs import TimeLog

HARMONICS = (1, 3, 5)
SKIN_MM = 0.1
"""Standard deviation of the Gaussian that models the skin's averaging of a profile."""
PASS_BAND_HZ = 400.0
"""Cut-off of an amplifier's anti-aliasing filter: higher harmonics do not exist at 1 kHz."""

LEAST_MM = 10.0
"""Smallest path of a recorded texture."""


class Texture(Protocol):
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
        self._sizes = [math.exp(-0.5 * (n * n - 1) * turn * turn) / n * (1, -1)[n // 2 % 2] for n in HARMONICS]

    def reading(self, place_mm: float, speed_mm_s: float) -> float:
        """Reading of the gauge at a place."""
        turn = 2 * math.pi * place_mm / self.wavelength_mm
        rate = abs(speed_mm_s) / self.wavelength_mm
        shares = (
            size * math.cos(n * turn) for n, size in zip(HARMONICS, self._sizes, strict=True) if n * rate < PASS_BAND_HZ
        )
        return self.amplitude * sum(shares)

    def wavelength(self, place_mm: float) -> float:
        """The wavelength, the same everywhere."""
        return self.wavelength_mm


class SideBySide:
    """One texture left of `border_mm`, another right of it."""

    def __init__(self, left: Texture, right: Texture, border_mm: float):
        self.left, self.right, self.border_mm = left, right, checks.finite("border_mm", border_mm)

    def _of(self, place_mm: float) -> Texture:
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
        kept = np.isfinite(place) & np.isfinite(value)
        place, value = place[kept], value[kept]
        kept = np.flatnonzero(np.diff(place, prepend=math.nan) != 0)
        place, value = place[kept], value[kept]
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
