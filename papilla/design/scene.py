"""The scene of a study: specimens, forces, noise and doubts, as frozen values; and the grid of its presses."""

import math
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import Literal

import numpy as np

from papilla import checks
from papilla.calibrate.press_table import DEFAULT_FORCES
from papilla.calibrate.surface_fit import SurfaceFit, table_resolution
from papilla.errors import InputError
from papilla.estimators.softness.doubts import Doubts

FORCES, MODULI = 10, 14
"""Numbers of forces and of moduli of the grid: the fewest forces for cells of a spline, and steps of 0.2 in ln E."""
MARGINS = 1.25, 1.05
"""Factors by which the grid extends beyond the scene in force (which a sample may miss) and in modulus."""
SWEPT_BEYOND = 1.05
"""How far beyond the largest force of the scene a calibration goes, at least."""


@dataclass(frozen=True)
class Unknowns:
    """Unknown quantities in a study: the estimators' `Doubts`, and the friction between finger and specimen.

    friction : "unknown" (between none and stick), "stick" or 0.
    """

    friction: Literal["unknown", "stick"] | float = "unknown"
    doubts: Doubts = Doubts(thickness_mm=10.0)

    def __post_init__(self) -> None:
        if self.friction not in ("unknown", "stick", 0):
            raise InputError(f'friction must be "unknown", "stick" or 0, got {self.friction!r}')


@dataclass(frozen=True)
class Tolerances:
    """Tolerances of manufacturing: places (mm along the interface) and directions (degrees) of gauges, thickness of the
    skin (mm), and moduli of a batch (relative)."""

    gauge_mm: float = 0.3
    gauge_deg: float = 3.0
    thickness_mm: float = 0.2
    moduli: float = 0.3


@dataclass(frozen=True)
class Scene:
    """Touches of specimens of some moduli (MPa) by some forces (N): each begins in the air and ends at a force that is
    held.

    force_N, modulus_MPa : (low, high); forces, moduli : their numbers, evenly spaced in the logarithm, ends included.
    over : whether a sigma over the scene is the worst, or the root mean square.
    samples : of the held force. gauge_noise_microstrain, force_noise_N, depth_noise_mm : of one sample.
    depth_zero_mm : one sigma of the depth of touch-down. depth_mm : depth of `force_at_depth`.
    place_mm : one sigma of the place of touch in x and y, for the placement of gauges.
    """

    force_N: tuple[float, float] = (0.2, 0.98)
    modulus_MPa: tuple[float, float] = (0.05, 0.72)
    forces: int = 3
    moduli: int = 5
    over: Literal["worst", "rms"] = "worst"
    samples: int = 100
    gauge_noise_microstrain: float = 5.0
    force_noise_N: float = 0.005
    depth_noise_mm: float = 0.005
    depth_zero_mm: float = 0.02
    depth_mm: float = 0.5
    place_mm: float = 1.0
    unknown: Unknowns = field(default_factory=Unknowns)
    tolerances: Tolerances = field(default_factory=Tolerances)

    def __post_init__(self) -> None:
        for name in ("force_N", "modulus_MPa"):
            checks.rising(name, getattr(self, name))
        for name in ("forces", "moduli"):
            if not 2 <= getattr(self, name) <= 40:
                raise InputError(f"{name} must be from 2 to 40, got {getattr(self, name)}")
        for name in ("samples", "gauge_noise_microstrain", "force_noise_N", "depth_noise_mm", "depth_mm", "place_mm"):
            checks.positive(name, getattr(self, name))

    @cached_property
    def points(self) -> tuple[np.ndarray, np.ndarray]:
        """Forces (f,) and moduli (m,) of the scene."""
        return np.geomspace(*self.force_N, self.forces), np.geomspace(*self.modulus_MPa, self.moduli)

    @cached_property
    def grid(self) -> tuple[np.ndarray, np.ndarray]:
        """Forces (n,) and moduli (n,) of the presses to which surfaces are fitted."""
        axes = zip((self.force_N, self.modulus_MPa), MARGINS, (FORCES, MODULI), strict=True)
        forces, moduli = (np.geomspace(low / margin, high * margin, n) for (low, high), margin, n in axes)
        each = np.meshgrid(forces, moduli, indexing="ij")
        return each[0].ravel(), each[1].ravel()

    @property
    def swept_N(self) -> tuple[float, ...]:
        """Forces of a calibration: the usual ones, or as far as the scene needs, as contacts of a small finger soon
        leave its patch."""
        share = min(1.0, SWEPT_BEYOND * self.force_N[1] / DEFAULT_FORCES[-1])
        return tuple(share * force for force in DEFAULT_FORCES)

    @property
    def solver(self) -> SurfaceFit:
        """The fit of surfaces to presses of the grid; the same for all designs."""
        return _solver(self.force_N, self.modulus_MPa)


@lru_cache(maxsize=8)
def _solver(force_N: tuple[float, float], modulus_MPa: tuple[float, float]) -> SurfaceFit:
    force, modulus = Scene(force_N, modulus_MPa).grid
    return SurfaceFit(force, modulus, (table_resolution(force), table_resolution(modulus)))


def rms_or_worst(scene: Scene, sigma: np.ndarray) -> float:
    """One number for the sigmas over a scene: the worst or the rms."""
    return float(sigma.max()) if scene.over == "worst" else math.sqrt(float(np.mean(sigma**2)))
