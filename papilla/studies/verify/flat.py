"""A flat body in the finger's place: problems with exact solutions, computed by the finger's code."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from papilla.fem import FingerModel, ReducedFinger
from papilla.fem.reduction.patch import quadrature
from papilla.finger import Dome, Finger, Gauge, Layer
from papilla.mesh.layered import LayeredMesh


@dataclass(frozen=True)
class Flat:
    """The plane at height `z` (mm) as a surface of `papilla.mesh.surfaces.Surface`."""

    z: float

    def level(self, points: np.ndarray) -> np.ndarray:
        """(n,) height above the plane."""
        return points[:, 2] - self.z

    def project(self, points: np.ndarray) -> np.ndarray:
        """(n, 3) points straight above or below on the plane."""
        return np.column_stack([points[:, :2], np.full(len(points), self.z)])

    project_in_base = project

    def height(self, xy: np.ndarray) -> np.ndarray:
        """(n,) z of the plane, which has no end."""
        return np.full(len(xy), self.z)

    def normal(self, points: np.ndarray) -> np.ndarray:
        """(n, 3) upwards."""
        return np.tile([0.0, 0.0, 1.0], (len(points), 1))


class FlatModel(FingerModel):
    """`FingerModel` of a mesh below z = 0 with flat skin, interface and bone; only the surfaces are another's.

    `gauge_sites` are the x (mm) of gauges of `gauge_length` mm along x at the depth `interface` (mm).
    """

    def __init__(
        self,
        mesh: LayeredMesh,
        outer: Layer,
        inner: Layer,
        patch_radius: float,
        *,
        interface: float = 1.0,
        gauge_sites: tuple[float, ...] = (0.0,),
        gauge_length: float = 1.0,
    ):
        size = 10 * float(np.abs(mesh.points).max())
        shape = Dome((size,) * 3, (size / 2,) * 3, (size / 4,) * 3)
        # Closed forms are for one line of the grid
        sizes: dict[str, Any] = {"length_mm": gauge_length, "width_mm": 1e-6 * gauge_length}
        sizes["backing_mm"] = 2 * gauge_length, gauge_length
        gauges = tuple(Gauge(f"g{k}", x_mm=x, **sizes) for k, x in enumerate(gauge_sites))
        super().__init__(Finger("flat body", shape, outer, inner, gauges, patch_radius=patch_radius), mesh)
        bottom = float(mesh.points[:, 2].min())
        self.surfaces = {"skin": Flat(0.0), "interface": Flat(-interface), "bone": Flat(bottom)}


def with_gap(reduced: ReducedFinger, radius_x: float, radius_y: float) -> ReducedFinger:
    """The flat body with a skin of the gap x^2 / (2 Rx) + y^2 / (2 Ry), radii in mm, so that a flat presses on it."""
    points, weights, hats = quadrature(reduced.patch)
    gap = points[:, 0] ** 2 / (2 * radius_x) + points[:, 1] ** 2 / (2 * radius_y)
    return replace(reduced, patch=replace(reduced.patch, gap=reduced.patch.gap + hats.T @ (weights * gap)))
