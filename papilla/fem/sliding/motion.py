"""Motion of a finger over a texture: positions at equal time steps."""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from papilla.core import checks
from papilla.core.errors import FileFormatError, InputError
from papilla.core.units import SAMPLE_RATE_HZ

MOTION_RATE_HZ = SAMPLE_RATE_HZ
MOST_SCENE_SAMPLES = 2_000_000
"""Longest scene; longer recordings are not single scenes."""
MOTION_GAP = 5.0
"""Time step of a motion file, in median steps, above which it is a gap."""


@dataclass(frozen=True, eq=False)
class Motion:
    """Positions (n,) in mm of the finger along x at times (n,) in s, `rate_Hz` a second."""

    t_s: np.ndarray
    position_mm: np.ndarray
    rate_Hz: float

    @classmethod
    def steady(cls, speed_mm_s: float, seconds: float, rate_Hz: float = MOTION_RATE_HZ) -> "Motion":
        """Constant speed from x = 0; negative to the left, zero for a finger that rests."""
        speed = checks.within("speed (mm/s)", speed_mm_s, -1e4, 1e4)
        t = sample_times(seconds, rate_Hz)
        return cls(t, speed * t, rate_Hz)

    @classmethod
    def sampled(
        cls, t_s: ArrayLike, position_mm: ArrayLike, rate_Hz: float = MOTION_RATE_HZ, seconds: float | None = None
    ) -> "Motion":
        """The motion through the points (t, x), linear between them; raises `InputError` for unusable or missing
        points."""
        t, x = np.asarray(t_s, float), np.asarray(position_mm, float)
        if t.ndim != 1 or t.shape != x.shape or len(t) < 2:
            raise InputError(f"a motion needs two points at least, got {t.size} times and {x.size} places")
        good = np.isfinite(t) & np.isfinite(x)
        if not good.all():
            raise InputError(f"point {int(np.argmin(good)) + 1} of the motion is not finite")
        steps = np.diff(t)
        if (steps <= 0).any():
            raise InputError(f"times of a motion must rise: point {int(np.argmax(steps <= 0)) + 2} does not")
        if steps.max() > MOTION_GAP * np.median(steps):
            at = int(np.argmax(steps))
            raise InputError(f"the motion has a gap from t_s {t[at]:g} to {t[at + 1]:g}: nothing is known there")
        if np.abs(np.diff(x) / steps).max() > 1e4:
            raise InputError("the motion is faster than 10 m/s: are these s and mm?")
        lasts = float(t[-1] - t[0]) if seconds is None else checks.positive("seconds", seconds)
        if lasts > float(t[-1] - t[0]) * (1 + checks.ROUNDING_SHARE):
            raise InputError(f"seconds {lasts:g} is longer than the motion, {t[-1] - t[0]:g} s")
        times = sample_times(lasts, rate_Hz)
        return cls(times, np.interp(times, t - t[0], x), rate_Hz)

    @classmethod
    def read(cls, path: str | Path, rate_Hz: float = MOTION_RATE_HZ, seconds: float | None = None) -> "Motion":
        """From a table `t_s,position_mm`; raises `FileAccessError` or `FileFormatError`."""
        from papilla.core.tables import TableReader

        with TableReader(path, lambda name: name in ("t_s", "position_mm")) as reader:
            for name in ("t_s", "position_mm"):
                if name not in reader.names:
                    present = ", ".join((*reader.names, *reader.ignored)[:10])
                    raise FileFormatError(f"{path}, line 1: column {name} is missing (found {present})")
            table = reader.whole()
        try:
            return cls.sampled(table.columns["t_s"], table.columns["position_mm"], rate_Hz, seconds)
        except InputError as error:
            raise FileFormatError(f"{path}: {error}") from error

    @property
    def velocity_mm_s(self) -> np.ndarray:
        """(n,) by central differences."""
        return np.gradient(self.position_mm, self.t_s)

    @property
    def fastest_mm_s(self) -> float:
        """Largest speed between two samples."""
        return float(np.abs(np.diff(self.position_mm)).max() * self.rate_Hz)


def sample_times(seconds: float, rate_Hz: float) -> np.ndarray:
    """Times from 0 in steps of 1 / `rate_Hz`; raises `InputError`."""
    rate = checks.within("rate (Hz)", rate_Hz, 1e-3, 1e7)
    count = checks.positive("seconds", seconds) * rate
    if count > MOST_SCENE_SAMPLES or not math.isfinite(count):
        raise InputError(f"{seconds:g} s at {rate:g} Hz are more than {MOST_SCENE_SAMPLES:,} samples: take less")
    if round(count) < 2:
        raise InputError(f"{seconds:g} s at {rate:g} Hz are fewer than two samples")
    return np.arange(round(count)) / rate
