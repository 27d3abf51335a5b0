"""The element size wanted at each place, as the background field that the mesher takes.

With d the distance from the apex, depth stretched because stress decays faster downwards than the patch is wide,

    size(d) = size_mm * min(1 + GROWTH (d - FINE_ZONE R) / R, FAR), R the patch radius,

and size_mm inside the fine zone. The field is proportional to `size_mm`, so that half of it gives a mesh that is twice
as fine everywhere: at the contact, at the interface, under the outer gauges and at the bone. The constants are the
cheapest that do so with the default finger at 0.7 and 0.35 mm (about 7,700 and 41,000 tetrahedra a quarter).
"""

from dataclasses import dataclass

import numpy as np

FINE_ZONE = 0.37
"""Radius of the zone of constant size, in patch radii: 5.5 mm by default, the contact of a press of about 100 gf."""

GROWTH = 5.4
"""Growth of the size over one patch radius, in sizes at the apex."""

FAR = 5.0
"""Largest size, in sizes at the apex."""

FAR_LIMIT_MM = 5.0
"""Largest size whatever was asked for: coarser elements do not follow the default finger's surfaces."""

DEPTH_STRETCH = 1.4

CELLS_PER_VOLUME, FEWEST_CELLS = 9.5, 2500
"""Tetrahedra in a volume of size^3, and those that the surfaces take whatever the size: with them the six meshes of the
default finger from 2 to 0.35 mm (2632 to 40,157 tetrahedra) are predicted within 20 %."""


@dataclass(frozen=True, eq=False)
class Sizing:
    """Wanted edge length as a function of the distance from `apex` (3,); lengths in mm."""

    apex: np.ndarray
    near_mm: float
    patch_radius: float

    @property
    def far_mm(self) -> float:
        """Largest size."""
        return max(self.near_mm, min(FAR_LIMIT_MM, FAR * self.near_mm))

    @property
    def grid_mm(self) -> float:
        """Spacing of a background grid that resolves the field."""
        return max(self.near_mm, 1.0)

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """Size (n,) in mm at points (n, 3)."""
        distance = np.linalg.norm((points - self.apex) * [1, 1, DEPTH_STRETCH], axis=1) / self.patch_radius
        return np.clip(self.near_mm * (1 + GROWTH * (distance - FINE_ZONE)), self.near_mm, self.far_mm)

    def cell_count(self, points: np.ndarray, volume: float) -> float:
        """Expected number of tetrahedra of a body sampled at points (n, 3), each standing for `volume` mm3."""
        return FEWEST_CELLS + CELLS_PER_VOLUME * float((volume / self(points) ** 3).sum())


def grid_over(low: np.ndarray, high: np.ndarray, spacing: float, shift: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points and tetrahedra (six a cube) of a regular grid that covers the box, displaced by `shift` (3,) spacings.

    `shift` lies in [-0.5, 0.5]: one spacing is kept free around the box.
    """
    lines = []
    for axis in range(3):
        count = int(np.ceil((high[axis] - low[axis]) / spacing)) + 3
        lines.append(low[axis] + spacing * (np.arange(count) - 1 + shift[axis]))
    points = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 3)
    number = np.arange(len(points)).reshape([len(line) for line in lines])
    corner = [
        number[i : number.shape[0] - 1 + i, j : number.shape[1] - 1 + j, k : number.shape[2] - 1 + k].ravel()
        for i in (0, 1)
        for j in (0, 1)
        for k in (0, 1)
    ]
    # Kuhn's six tetrahedra of a cube share its main diagonal, so that neighbouring cubes fit.
    middle = ((4, 6), (6, 2), (2, 3), (3, 1), (1, 5), (5, 4))
    tets = np.vstack([np.stack([corner[0], corner[a], corner[b], corner[7]], axis=1) for a, b in middle])
    return points, positively_oriented(points, tets)


def positively_oriented(points: np.ndarray, tets: np.ndarray) -> np.ndarray:
    """The tetrahedra with two vertices swapped wherever the volume is negative."""
    edges = points[tets[:, 1:]] - points[tets[:, :1]]
    negative = np.linalg.det(edges) < 0
    tets = tets.copy()
    tets[negative] = tets[negative][:, [0, 2, 1, 3]]
    return tets
