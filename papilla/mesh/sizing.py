"""The wanted element size at each place, as a background field for the mesher.

With the distance d from the apex, in which depth is stretched because stress decays faster downwards than sideways, and
the patch radius R,

    size(d) = size_mm * min(1 + GROWTH (d - FINE_ZONE R) / R, FAR),

and size_mm inside the fine zone. The size is smaller at the touch-down point, where a light press has its whole
contact, and grows from SITE sizes at each gauge, whose grid is short compared with the elements far from the apex. The
field is proportional to `size_mm`, so half of it gives a mesh that is twice as fine everywhere: at the contact, at the
interface and at the bone.
"""

import math
from dataclasses import dataclass, field, replace

import numpy as np

from papilla.core import checks
from papilla.core.memory import least_bytes, refuse_size
from papilla.mesh.body import MeshGeometry, body_of, gauge_site, patch_radius_mm
from papilla.model.finger import Finger

FINE_ZONE = 0.37
"""Radius of the zone of constant size, in patch radii: 5.5 mm by default, the contact of a press of about 100 gf."""

PATCH_SIZE_GROWTH = 5.4  # Growth of the size over one patch radius, in sizes of the fine zone
TIP_SIZE, TIP_ZONE = 0.6, 0.13
"""Size at the touch-down point relative to the fine zone, and radius (in patch radii) of the zone with this size; over
the same distance again it grows to that of the fine zone."""

SITE_SIZE, SITE_ZONE = 1.6, 0.1  # Size at the gauges, and radius of their zone, as above
FAR_SIZE = 5.0  # Largest size, relative to the fine zone
FAR_LIMIT_SHARE = 0.25  # Largest size at any size_mm, over the height: coarser elements do not follow the surfaces
DEPTH_STRETCH = 1.4
GRID_SHARE = 1 / 15  # Coarsest background grid, over the patch radius: it resolves the zones above

FINEST_SIZE_SHARE, COARSEST_SIZE_SHARE = (
    1 / 200,
    1 / 4,
)  # Smallest and largest size_mm, as fractions of the finger's height
VOLUME_SAMPLES = 32  # Points along each axis of the body's box that sample its volume

CELLS_PER_VOLUME, FEWEST_CELLS = 9.3, 2400
"""Number of tetrahedra per volume of size^3, and number that the surfaces need at any size: the formula predicts the
seven meshes of the default finger from 2 to 0.25 mm (2618 to 146,068 tetrahedra) within 22 %."""


@dataclass(frozen=True, eq=False)
class Sizing:
    """Wanted edge length as a function of the distance from `apex` (3,) and gauges' sites (k, 3); lengths in mm.

    far_limit_mm : largest size, whatever `near_mm` is."""

    apex: np.ndarray
    near_mm: float
    patch_radius: float
    sites: np.ndarray = field(default_factory=lambda: np.empty((0, 3)))
    far_limit_mm: float = math.inf

    @property
    def far_mm(self) -> float:
        """Largest size."""
        return max(self.near_mm, min(self.far_limit_mm, FAR_SIZE * self.near_mm))

    @property
    def grid_mm(self) -> float:
        """Spacing of a background grid that resolves the field."""
        return max(self.near_mm, GRID_SHARE * self.patch_radius)

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """Size (n,) in mm at points (n, 3)."""
        distance = np.linalg.norm((points - self.apex) * [1, 1, DEPTH_STRETCH], axis=1) / self.patch_radius
        tip = TIP_SIZE + (1 - TIP_SIZE) * np.clip(distance / TIP_ZONE - 1, 0, 1)
        ratio = np.maximum(1 + PATCH_SIZE_GROWTH * (distance - FINE_ZONE), tip)
        for site in self.sites:
            apart = np.linalg.norm(points - site, axis=1) / self.patch_radius
            ratio = np.minimum(ratio, SITE_SIZE + PATCH_SIZE_GROWTH * np.maximum(apart - SITE_ZONE, 0))
        return np.minimum(self.near_mm * ratio, self.far_mm)

    def cell_count(self, points: np.ndarray, volume: float) -> float:
        """Expected number of tetrahedra of a body sampled at points (n, 3), each standing for `volume` mm3."""
        return FEWEST_CELLS + CELLS_PER_VOLUME * float((volume / self(points) ** 3).sum())


def asked(finger: Finger, size_mm: float) -> tuple[MeshGeometry, Sizing]:
    """The body to mesh of a finger, and the element sizes that follow from `size_mm` at the contact.

    Raises what `body_of` raises, `InputError` for a size out of range or a gauge off the interface, and
    `MemoryEstimateError` if presses on a mesh of that size would need more memory than is free.
    """
    body = body_of(finger)
    tall = float(body.high[2] - body.low[2])
    checks.within(
        f"size_mm of a finger {tall:g} mm tall", size_mm, FINEST_SIZE_SHARE * tall, COARSEST_SIZE_SHARE * tall
    )
    sites = np.array([gauge_site(finger, gauge, body.surfaces["interface"]) for gauge in finger.gauges]).reshape(-1, 3)
    for axis in ("xyz".index(name) for name in body.mirrors):
        sites[:, axis] = np.abs(sites[:, axis])
    sizing = Sizing(
        body.apex, size_mm, patch_radius_mm(finger), np.unique(np.round(sites, 9), axis=0), FAR_LIMIT_SHARE * tall
    )
    refuse_too_fine(body, sizing, finger.bone is not None)
    return body, sizing


def refuse_too_fine(body: MeshGeometry, sizing: Sizing, keep_bone: bool) -> None:
    """Raise `MemoryEstimateError` if presses on the mesh that `sizing` describes would need more memory than is
    free."""
    lines = [
        low + (high - low) * (np.arange(VOLUME_SAMPLES) + 0.5) / VOLUME_SAMPLES
        for low, high in zip(body.low, body.high, strict=True)
    ]
    points = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 3)
    meshed = body.surfaces["skin"].level(points) <= 0
    if not keep_bone:
        meshed &= body.surfaces["bone"].level(points) > 0
    volume = float(np.prod(body.high - body.low)) / VOLUME_SAMPLES**3

    def cells(ratio: float) -> float:
        return replace(sizing, near_mm=ratio * sizing.near_mm).cell_count(points[meshed], volume)

    job = f"factorising a mesh of about {cells(1):,.0f} tetrahedra (size_mm {sizing.near_mm:g})"
    refuse_size(job, sizing.near_mm, lambda ratio: least_bytes(cells(ratio)))
