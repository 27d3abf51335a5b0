"""Textures that a finger slides over: the protocol that sliding needs, a flat plate, and measured profiles (mm)."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from papilla.core.errors import FileFormatError, InputError

if TYPE_CHECKING:
    import numpy as np

PROFILE_COLUMNS = ("x_mm", "height_mm")
PROFILE_GAP_STEPS = 5.0
"""A step of x longer than this many median steps is a gap: the surface is unknown there."""
COARSEST_PROFILE_MM, HIGHEST_MM, SHORTEST_MM = 2.0, 20.0, 1.0
"""Largest median step of x, largest range of heights, and shortest length of a profile. Beyond these the file is
probably not in mm, or not a texture."""


class Texture(Protocol):
    """A rigid surface whose height depends on x alone."""

    @property
    def span(self) -> tuple[float, float]:
        """First and last x (mm) at which the surface is known."""

    @property
    def wavelength(self) -> float | None:
        """Spatial period in mm, None if it has none."""

    def recess(self, x: "np.ndarray") -> "np.ndarray":
        """Depth (k,) in mm of the surface below its highest point, at x (k,) in mm inside the span."""


@dataclass(frozen=True)
class Flat:
    """A smooth plate without ends."""

    span = (-float("inf"), float("inf"))
    wavelength = None

    def recess(self, x: "np.ndarray") -> "np.ndarray":
        """Zeros."""
        return 0.0 * x


@dataclass(frozen=True, eq=False)
class MeasuredProfile:
    """A profile through points (x, height), linear between them; height grows towards the finger.

    x_mm, height_mm : (k,) in mm. Raises `InputError` if x does not rise, a number is not finite, there are fewer than
    three points, a gap of x is longer than `PROFILE_GAP_STEPS` median steps, or the numbers are probably not in mm.
    """

    x_mm: "np.ndarray"
    height_mm: "np.ndarray"

    def __post_init__(self) -> None:
        import numpy as np

        x, height = np.asarray(self.x_mm, float), np.asarray(self.height_mm, float)
        if x.ndim != 1 or x.shape != height.shape or len(x) < 3:
            raise InputError(f"a profile needs three points at least, got {x.size}")
        if not (np.isfinite(x).all() and np.isfinite(height).all()):
            at = int(np.argmin(np.isfinite(x) & np.isfinite(height)))
            raise InputError(f"point {at + 1} of the profile is not finite: ({x[at]:g}, {height[at]:g})")
        steps = np.diff(x)
        if (steps <= 0).any():
            at = int(np.argmax(steps <= 0))
            raise InputError(f"x_mm of a profile must rise, but {x[at + 1]:g} follows {x[at]:g} (point {at + 2})")
        if steps.max() > PROFILE_GAP_STEPS * np.median(steps):
            at = int(np.argmax(steps))
            raise InputError(f"the profile has a gap from x_mm {x[at]:g} to {x[at + 1]:g}: it must have no gaps")
        if np.median(steps) > COARSEST_PROFILE_MM or np.ptp(height) > HIGHEST_MM:
            raise InputError(
                f"a profile with steps of {np.median(steps):g} mm and a height of {np.ptp(height):g} mm is no texture: "
                "are x_mm and height_mm in mm?"
            )
        if np.ptp(x) < SHORTEST_MM:
            raise InputError(
                f"a profile of {np.ptp(x):.3g} mm is shorter than a contact: are x_mm and height_mm in mm?"
            )
        object.__setattr__(self, "x_mm", x)
        object.__setattr__(self, "height_mm", height)

    @classmethod
    def read(cls, path: str | Path) -> "MeasuredProfile":
        """A profile from a CSV file `x_mm,height_mm`; raises `FileAccessError` or `FileFormatError`."""
        from papilla.core.tables import TableReader

        with TableReader(path, lambda name: name in PROFILE_COLUMNS) as reader:
            for name in PROFILE_COLUMNS:
                if name not in reader.names:
                    present = ", ".join((*reader.names, *reader.ignored)[:10])
                    raise FileFormatError(f"{path}, line 1: column {name} is missing (found {present})")
            table = reader.whole()
        try:
            return cls(table.columns["x_mm"], table.columns["height_mm"])
        except InputError as error:
            raise FileFormatError(f"{path}: {error}") from error

    @property
    def span(self) -> tuple[float, float]:
        """First and last x (mm)."""
        return float(self.x_mm[0]), float(self.x_mm[-1])

    @property
    def wavelength(self) -> None:
        """None: a measured profile has no known period."""
        return

    @cached_property
    def _highest(self) -> float:
        return float(self.height_mm.max())

    def recess(self, x: "np.ndarray") -> "np.ndarray":
        """Depth (k,) in mm of the surface below its highest point, at x (k,) in mm inside the span."""
        import numpy as np

        return self._highest - np.interp(x, self.x_mm, self.height_mm)
