"""Places of gauges on the interface: a grid of sites that are reduced together; any gauge is a weighted sum of them.

One solve gives strain and curvature at all sites for a press at the apex. Between sites a cubic spline over the angle
and over y interpolates. In-plane strain and curvature are tensors, so the values v along 0, 45 and 90 degrees determine
every direction a,

  v(a) = v_0 cos^2 a + v_90 sin^2 a + (2 v_45 - v_0 - v_90) sin a cos a.

A dome and a slab have two mirror planes, so a quarter of the interface is enough: v_0 and v_90 are even in both
coordinates, the shear v_45 - (v_0 + v_90) / 2 is odd in both.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from scipy.interpolate import CubicSpline

from papilla.core import checks
from papilla.core.errors import InputError
from papilla.model.finger import Dome, Finger, Gauge, Shape, Slab

ANGLE_STEP_DEG, FARTHEST_DEG = 4.0, 64.0
"""Angles of the sites (degrees): steps of 1.5 mm on the interface of the default finger, whose strain has extremes 4 mm
apart."""
SHARE_STEP, FARTHEST_SHARE = 0.075, 0.6
"""y of the sites over the half length of the interface, with similar steps."""
PLACE_DIRECTIONS_DEG = (0.0, 45.0, 90.0)
FOIL_SIZES = ("length_mm", "width_mm", "backing_mm")


@dataclass(frozen=True)
class Places:
    """Sites at angles (degrees, from 0) and y over the half length (from 0), along x alone or in three directions; the
    foil of all gauges is that of `Gauge`.

    own : (angle, share, direction) of the gauges themselves if a study does not move them; then there is no grid.
    """

    angles: tuple[float, ...]
    shares: tuple[float, ...]
    turned: bool
    foil: tuple
    own: tuple[tuple[float, float, float], ...] = ()

    @classmethod
    def whole(cls, foil: tuple) -> "Places":
        """All places at which a gauge may lie."""
        return cls(_nodes(FARTHEST_DEG, ANGLE_STEP_DEG), _nodes(FARTHEST_SHARE, SHARE_STEP), True, foil)

    @classmethod
    def row(cls, foil: tuple) -> "Places":
        """The places of gauges at y = 0 along x."""
        return cls(_nodes(FARTHEST_DEG, ANGLE_STEP_DEG), (0.0,), False, foil)

    @classmethod
    def of(cls, finger: Finger) -> "Places":
        """The gauges of a finger at their own places."""
        shape = finger.shape
        sites = ((angle_of(g, shape), g.y_mm / half_length(shape), g.direction_deg) for g in finger.gauges)
        return cls((), (), True, foil_of(finger.gauges), tuple(sites))

    @property
    def directions(self) -> tuple[float, ...]:
        """Directions of the gauges at a site, in degrees."""
        return PLACE_DIRECTIONS_DEG if self.turned else PLACE_DIRECTIONS_DEG[:1]

    def gauges(self, shape: Shape) -> tuple[Gauge, ...]:
        """A gauge for each site and direction: angle by angle, then y, then direction."""
        sizes = dict(zip(FOIL_SIZES, self.foil, strict=True))
        sites = self.own or [(a, s, d) for a in self.angles for s in self.shares for d in self.directions]
        return tuple(
            Gauge(f"s{k}", angle_deg=a, y_mm=s * half_length(shape), direction_deg=d, **sizes)
            for k, (a, s, d) in enumerate(sites)
        )

    def weights(self, gauges: Sequence[Gauge], shape: Shape) -> np.ndarray:
        """(sites, g) weights that give the values of these gauges from those of the sites; raises `InputError` for a
        gauge beyond the outermost site."""
        if self.own:
            return np.eye(len(self.own))
        weights = np.zeros((len(self.angles), len(self.shares), len(self.directions), len(gauges)))
        for k, gauge in enumerate(gauges):
            angle, share = angle_of(gauge, shape), gauge.y_mm / half_length(shape)
            if abs(angle) > self.angles[-1] or abs(share) > self.shares[-1] + checks.ROUNDING_SHARE:
                limits = f"{self.angles[-1]:g} degrees and {self.shares[-1] * half_length(shape):.3g} mm of y"
                raise InputError(f"gauge {gauge.name} lies outside the places that a study covers, {limits}")
            turn = math.radians(gauge.direction_deg)
            c, s = math.cos(turn), math.sin(turn)
            if not self.turned and abs(s) > 1e-12:
                raise InputError(f"gauge {gauge.name} is turned, but its study covers gauges along x alone")
            (even, odd), (wide, across) = (
                _cardinal(nodes, at) for nodes, at in ((self.angles, angle), (self.shares, share))
            )
            mean, shear = np.outer(even, wide), 2 * s * c * np.outer(odd, across)
            weights[:, :, 0, k] = c * c * mean - (shear / 2 if self.turned else 0.0)
            if self.turned:
                weights[:, :, 1, k], weights[:, :, 2, k] = shear, s * s * mean - shear / 2
        return weights.reshape(-1, len(gauges))


def half_length(shape: Shape) -> float:
    """Half the length (mm) of the interface along y."""
    assert isinstance(shape, Dome | Slab)
    return shape.depth / 2 if isinstance(shape, Slab) else shape.interface[1]


def angle_of(gauge: Gauge, shape: Shape) -> float:
    """A gauge's ellipse parameter (degrees), also if its x is given."""
    if gauge.angle_deg is not None:
        return gauge.angle_deg
    assert isinstance(shape, Dome | Slab) and gauge.x_mm is not None
    width = shape.interface[0] * (
        math.sqrt(1 - (gauge.y_mm / half_length(shape)) ** 2) if isinstance(shape, Dome) else 1.0
    )
    return math.degrees(math.asin(gauge.x_mm / width))


def foil_of(gauges: Iterable[Gauge]) -> tuple:
    """Grid length, width and backing, which all gauges share; raises `InputError` if they differ or if a gauge was
    moved."""
    foils = {tuple(getattr(gauge, name) for name in FOIL_SIZES) for gauge in gauges}
    if len(foils) != 1:
        raise InputError("the gauges of a study's finger must have one length_mm, width_mm and backing_mm")
    if any(any(gauge.moved_mm) for gauge in gauges):
        raise InputError("the gauges of a study's finger must not be moved (moved_mm)")
    return foils.pop()


def moved(gauge: Gauge, shape: Shape, along_mm: float, turn_deg: float = 0.0) -> Gauge:
    """A gauge moved along the interface (mm) and turned; mm become degrees by the length of a degree of the ellipse at
    the gauge's place."""
    assert isinstance(shape, Dome | Slab)
    angle = math.radians(angle_of(gauge, shape))
    a, c = shape.interface[0], shape.interface[-1]
    degree = math.radians(1.0) * math.hypot(a * math.cos(angle), c * math.sin(angle))
    angle_deg = math.degrees(angle) + along_mm / degree
    return replace(gauge, angle_deg=angle_deg, x_mm=None, direction_deg=gauge.direction_deg + turn_deg)


@lru_cache(maxsize=8)
def _spline(nodes: tuple[float, ...]) -> CubicSpline:
    """The cardinal splines of nodes and their mirror images."""
    both = np.concatenate([-np.array(nodes[:0:-1]), nodes])
    return CubicSpline(both, np.eye(len(both)))


def _nodes(most: float, step: float) -> tuple[float, ...]:
    return tuple((step * np.arange(round(most / step) + 1)).tolist())


def _cardinal(nodes: tuple[float, ...], at: float) -> tuple[np.ndarray, np.ndarray]:
    """Weights (k,) of values at nodes from 0 on, for even and for odd functions."""
    if len(nodes) == 1:
        return np.ones(1), np.ones(1)
    weights = _spline(nodes)(at)
    right, mirrored = weights[len(nodes) - 1 :], np.append(0.0, weights[: len(nodes) - 1][::-1])
    return right + mirrored, right - mirrored
