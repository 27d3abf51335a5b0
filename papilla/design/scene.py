"""The scene of a study, and the expected sigma of ln E after a touch in it.

A scene has specimens, forces, noise and doubts, as frozen values. A touch begins in the air, where zeros are measured,
and ends at a force that is held for some samples. The estimators' own filter (`papilla.estimators.softness.fitter`)
starts at the true contact and learns the mean of these samples like a measured one; its sigma does not depend on the
noise that occurred. Its own prior of E is replaced by one that is the same for every design, with a standard deviation
of 1 in ln E. Predictions for a design and calibrations go the same way.
"""

import math
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import Any, Literal

import numpy as np

from papilla.calibration.fitting.surface_fit import SurfaceFit, table_resolution
from papilla.calibration.fitting.sweep import CalibrationRanges
from papilla.core import checks
from papilla.core.errors import InputError
from papilla.core.units import UM_PER_MM
from papilla.estimators.softness.channels import Doubts, GaugeSurfaces, SdReading
from papilla.estimators.softness.fitter import PRIOR_REACH, Fitter
from papilla.estimators.softness.touch import TOUCH_RULES
from papilla.model.finger import Finger

GRID_FORCES, GRID_MODULI = 10, 14
"""Numbers of forces and of moduli of the grid: the fewest forces for cells of a spline, and steps of 0.2 in ln E."""
GRID_MARGINS = 1.25, 1.05
"""Factors by which the grid extends beyond the scene in force (which a sample may miss) and in modulus."""
SWEPT_BEYOND = 1.05
"""How far beyond the largest force and the ends of the moduli of the scene a calibration goes, at least."""
MOST_HELD_SAMPLES = 10**6
"""Most samples of a held force."""
PRIOR_SIGMA_LN_MODULUS = 1.0
"""One sigma of ln E before a touch, which remains if a touch gives no information."""


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
class DesignScene:
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
        if self.samples > MOST_HELD_SAMPLES:
            raise InputError(f"samples must be at most {MOST_HELD_SAMPLES}, got {self.samples}")
        for name in ("samples", "gauge_noise_microstrain", "force_noise_N", "depth_noise_mm", "depth_mm", "place_mm"):
            checks.positive(name, getattr(self, name))

    @cached_property
    def points(self) -> tuple[np.ndarray, np.ndarray]:
        """Forces (f,) and moduli (m,) of the scene."""
        return np.geomspace(*self.force_N, self.forces), np.geomspace(*self.modulus_MPa, self.moduli)

    @cached_property
    def grid(self) -> tuple[np.ndarray, np.ndarray]:
        """Forces (n,) and moduli (n,) of the presses to which surfaces are fitted."""
        axes = zip((self.force_N, self.modulus_MPa), GRID_MARGINS, (GRID_FORCES, GRID_MODULI), strict=True)
        forces, moduli = (np.geomspace(low / margin, high * margin, n) for (low, high), margin, n in axes)
        points = np.meshgrid(forces, moduli, indexing="ij")
        return points[0].ravel(), points[1].ravel()

    def swept(self, finger: Finger) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Forces (N) and moduli (MPa) of a finger's calibration: the usual ones; forces only as far as the scene needs,
        as contacts of a small finger soon leave its patch, and moduli shifted where the scene has others."""
        ranges, (least, most) = CalibrationRanges.of(finger), self.modulus_MPa
        share = min(1.0, SWEPT_BEYOND * self.force_N[1] / ranges.forces[-1])
        low, high = least / SWEPT_BEYOND / ranges.moduli[0], SWEPT_BEYOND * most / ranges.moduli[-1]
        shift = max(min(1.0, low), high)
        return tuple(share * force for force in ranges.forces), tuple(shift * modulus for modulus in ranges.moduli)

    @property
    def solver(self) -> SurfaceFit:
        """The fit of surfaces to presses of the grid; the same for all designs."""
        return _solver(self.force_N, self.modulus_MPa)


@lru_cache(maxsize=8)
def _solver(force_N: tuple[float, float], modulus_MPa: tuple[float, float]) -> SurfaceFit:
    force, modulus = DesignScene(force_N, modulus_MPa).grid
    return SurfaceFit(force, modulus, (table_resolution(force), table_resolution(modulus)))


def rms_or_worst(scene: DesignScene, sigma: np.ndarray) -> float:
    """One number for the sigmas over a scene: the worst or the rms."""
    return float(sigma.max()) if scene.over == "worst" else math.sqrt(float(np.mean(sigma**2)))


def sigma_from_sd(calibration: Any, scene: DesignScene) -> np.ndarray:
    """Sigma (f, m) of ln E from S_d and force, over the points of a scene.

    calibration : a `Calibration`, or `DesignInScene.surfaces` of a design.
    """
    # S_d averages over the gauges, so their independent noise and zeros shrink by the root of their number.
    root = math.sqrt(len(calibration.gauges))
    doubts = scene.unknown.doubts
    doubts = replace(doubts, zero_microstrain=doubts.zero_microstrain / root)
    try:
        surface = SdReading(calibration)
    except InputError:
        return np.full([len(axis) for axis in scene.points], PRIOR_SIGMA_LN_MODULUS)
    return _over(scene, surface, scene.gauge_noise_microstrain / root, doubts)


def sigma_from_gauges(calibration: Any, scene: DesignScene) -> np.ndarray:
    """The same from all gauges and force."""
    return _over(scene, GaugeSurfaces(calibration, False), scene.gauge_noise_microstrain, scene.unknown.doubts)


def sigma_from_depth(depth: Any, scene: DesignScene) -> np.ndarray:
    """The same from force and indentation, as measured on a bench; `depth` has one "gauge" that reads micrometres."""
    zero = UM_PER_MM * scene.depth_zero_mm / TOUCH_RULES.air_share
    doubts = replace(scene.unknown.doubts, gauge_gain=0.0, zero_microstrain=zero, beside_mm=0.0)
    return _over(scene, GaugeSurfaces(depth, False), UM_PER_MM * scene.depth_noise_mm, doubts)


def _over(scene: DesignScene, surfaces: Any, noise: float, doubts: Doubts) -> np.ndarray:
    fitter = Fitter(surfaces, noise, scene.force_noise_N, doubts, None)
    forces, moduli = scene.points
    return np.array([[_at(fitter, math.log(f), math.log(e), scene.samples) for e in moduli] for f in forces])


def _at(fitter: Fitter, ln_force: float, ln_modulus: float, samples: int) -> float:
    nodes = fitter.surfaces.ln_nodes
    usable = getattr(fitter.surfaces, "usable", None)
    low, high = usable(ln_force) if usable else (nodes[0], nodes[-1])
    if not max(low, nodes[0]) <= ln_modulus <= min(high, nodes[-1]):
        return PRIOR_SIGMA_LN_MODULUS
    # The filter's unknown is h, a scale of ln E on which readings change along straight lines (`softness.fitter`). The
    # touch starts at its true h, so that the slopes are those of the true contact.
    curve = fitter.curve
    place = (ln_modulus - curve.start) * curve.per_step
    cell = min(int(place), len(curve.cubics) - 1)
    u, (p, q, r, s) = place - cell, curve.cubics[cell]
    h = p + u * (q + u * (r + u * s))
    belief = fitter.prior(TOUCH_RULES.air_share)
    mean = belief.mean.copy()
    mean[0] = h
    belief = belief._replace(mean=mean, ln_force=ln_force, anchor=h)
    rows = np.arange(fitter.channels + 1)
    y = fitter.linear(ln_force, 0.0, h).expected / fitter.whiten
    _, learnt = fitter.learn(y, rows, belief, fitter.noise_fit(y, rows, belief, samples))
    prior, after = (PRIOR_REACH * fitter.top) ** 2, float(learnt.covariance[0, 0])
    # What the touch added to the filter's own prior of h, in units of ln E, with this module's prior instead.
    information = max(1 / after - 1 / prior, 0.0) * fitter.ln_modulus(h)[1] ** 2
    return 1 / math.sqrt(information + PRIOR_SIGMA_LN_MODULUS**-2)
