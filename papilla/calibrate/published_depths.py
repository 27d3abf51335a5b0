"""Published depths of presses with their forces (2006, 2011), and those of a finger under the same forces."""

from dataclasses import dataclass

from papilla.calibrate.press_table import cached_press
from papilla.fem import ReducedFinger, press
from papilla.finger import Finger
from papilla.specimen import HalfSpace
from papilla.units import gf_to_newton

PUBLISHED_POINTS = ((0.20, gf_to_newton(0.70)), (0.80, gf_to_newton(38.37)), (1.0, 0.6))
"""Depth (mm) and force (N) of presses on gratings (2006; 1 mm of 2011), from where the touch was detected."""

RIGID = HalfSpace(1e4)
"""Specimen that stands for the gratings, because the papers state neither their material nor the contact."""


@dataclass(frozen=True)
class Depth:
    """A published depth (mm) at a force (N), and that of a finger: its indentation plus the touch-down offset of its
    bench."""

    published_mm: float
    force_N: float
    depth_mm: float

    @property
    def error(self) -> float:
        """Relative error of the finger's depth."""
        return self.depth_mm / self.published_mm - 1


def published_depths(finger: Finger, reduced: ReducedFinger) -> list[Depth]:
    """The published depths and those of a finger on a rigid flat, which stands for the gratings of the papers."""
    depths = []
    for depth, force in PUBLISHED_POINTS:
        found = cached_press(press, reduced, RIGID, force_N=force)
        depths.append(Depth(depth, force, found.indentation + finger.bench.touch_down))
    return depths
