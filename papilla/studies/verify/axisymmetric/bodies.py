"""A finger of revolution and a block, both at finite strain, in the half plane (r, z): a check of the 3-D press.

Taylor-Hood on curved quadratic triangles: displacement and geometry P2, pressure P1 and its own in each layer. Of the
product it shares the stress of a point alone, whose derivatives and closed forms have tests of their own.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp
from skfem import Basis, ElementTriP1, ElementTriP2, MeshTri, MeshTri2

from papilla.fem.finite.body import Card
from papilla.fem.finite.constitutive import Kinematics, response
from papilla.fem.reduction.gauges import elongation, gauge_frame, linear_value, strain_functional
from papilla.finger import Dome, Finger
from papilla.mesh.surfaces import Ellipsoid

OUTER, INNER, SPECIMEN = 0, 1, 2
QUADRATURE_ORDER = 5
APART = 10.0
"""Parameter of the specimen's surface, away from the finger's."""


@dataclass(frozen=True)
class Shape:
    """Half ellipses (r, z) of skin, interface and bone, and a bonded cylinder of `thickness` and `width`, all in mm.

    cells : along the skin, through the outer and the inner layer, and through the specimen.
    near : of the skin's parameter, up to where `near_share` of the cells along it lie: contact is there.
    """

    outer: tuple[float, float] = (24.0, 20.0)
    interface: tuple[float, float] = (21.0, 17.0)
    bone: tuple[float, float] = (10.0, 6.0)
    thickness: float = 10.0
    width: float = 45.0
    cells: tuple[int, int, int, int] = (40, 5, 6, 9)
    near: float = 0.22
    near_share: float = 0.6

    @property
    def finger(self) -> Finger:
        """The default finger in this shape."""
        return replace(Finger.default(), shape=Dome(*((a, a, c) for a, c in (self.outer, self.interface, self.bone))))

    def mapped(self, parameters: np.ndarray) -> np.ndarray:
        """(r, z) in mm (2, n) of parameters (2, n): along the skin 0-1; from bone 0 over interface 1 to skin 2."""
        x, y = parameters
        levels = np.array([self.bone, self.interface, self.outer])
        a, c = (np.interp(y, [0, 1, 2], levels[:, k]) for k in (0, 1))
        finger = np.stack([a * np.sin(np.pi / 2 * x), c * np.cos(np.pi / 2 * x)])
        return np.where(y < APART, finger, [self.width * x, self.outer[1] + self.thickness * (y - APART)])


class Bodies:
    """Finger and specimen as one mesh of two parts; unknowns are 2 * node + component (r, z), then pressures.

    `cards` are those of OUTER, INNER and SPECIMEN. With `linear` all is small strain on the undeformed shape.
    """

    def __init__(self, shape: Shape, cards: Sequence[Card], linear: bool = False):
        self.shape, self.cards, self.linear = shape, tuple(cards), linear
        along, outer, inner, deep = shape.cells
        near = round(shape.near_share * along)
        x = np.append(np.linspace(0, shape.near, near + 1), shape.near + (1 - shape.near) * _growing(along - near)[1:])
        through = np.concatenate([np.linspace(0, 1, inner + 1), 2 - _growing(outer, 1.3)[-2::-1]])
        flat = MeshTri.init_tensor(x, through) + MeshTri.init_tensor(x, APART + _growing(deep))
        curved = MeshTri2.from_mesh(flat)
        self.parameters = curved.doflocs
        self.mesh = MeshTri2(shape.mapped(curved.doflocs), curved.t)
        self.basis = Basis(self.mesh, ElementTriP2(), intorder=QUADRATURE_ORDER)
        height = self.parameters[1, self.basis.element_dofs].mean(axis=0)
        self.layer = np.where(height > APART, SPECIMEN, np.where(height > 1, OUTER, INNER))
        key = self.mesh.t * 3 + self.layer
        self.pressure_dofs = np.unique(key, return_inverse=True)[1].reshape(key.shape)
        self.nodes, self.pressures = self.basis.N, int(self.pressure_dofs.max()) + 1
        self._rest: sp.csc_matrix | None = None
        if linear:
            self._rest = self.forces(np.zeros(self.unknowns))[1]

    @property
    def unknowns(self) -> int:
        """All unknowns, boundary conditions not yet removed."""
        return 2 * self.nodes + self.pressures

    @cached_property
    def table(self) -> np.ndarray:
        """Displacement unknowns along z on the specimen's table."""
        return 2 * np.flatnonzero(self.parameters[1] == APART + 1) + 1

    @cached_property
    def free(self) -> np.ndarray:
        """Mask (unknowns,): base, bone and table are held, and the axis stays straight."""
        x, y = self.parameters
        held = (y == 0) | ((x == 1) & (y < APART)) | (y == APART + 1)
        free = np.ones((self.nodes, 2), dtype=bool)
        free[held] = False
        free[x == 0, 0] = False
        return np.append(free.ravel(), np.ones(self.pressures, dtype=bool))

    def edges(self, height: float) -> np.ndarray:
        """(e, 3) nodes (end, end, middle) of the edges at a height of the parameters, ordered outwards."""
        x, y = self.parameters
        nodes = np.flatnonzero(np.isclose(y, height, rtol=0, atol=1e-12))
        nodes = nodes[np.argsort(x[nodes])]
        return np.column_stack([nodes[:-2:2], nodes[2::2], nodes[1::2]])

    def displacement(self, unknowns: np.ndarray) -> np.ndarray:
        """(nodes, 2) in mm."""
        return unknowns[: 2 * self.nodes].reshape(-1, 2)

    def forces(self, unknowns: np.ndarray) -> tuple[np.ndarray, sp.csc_matrix]:
        """Internal forces (unknowns,) and tangent (lower triangle), divided by 2 pi."""
        if self._rest is not None:
            whole = self._rest + sp.tril(self._rest, -1).T
            return whole @ unknowns, self._rest
        gradient = (self._strain @ unknowns[self._unknowns[:, None, :12, None]])[..., 0]
        kinematics = Kinematics.of(gradient.reshape(*gradient.shape[:2], 3, 3))
        if not (kinematics.jacobian > 0).all():
            raise FloatingPointError("a cell is turned inside out")
        pressure = unknowns[2 * self.nodes + self.pressure_dofs.T] @ self._hats
        stress, tangent = np.empty_like(kinematics.gradient), np.empty((*pressure.shape, 9, 9))
        for number, card in enumerate(self.cards):
            cells = self.layer == number
            stress[cells], tangent[cells] = response(card.material, kinematics[cells], pressure[cells])
        weights, strain, compressibility = self._weights, self._strain, self._compressibility
        blocks = np.zeros((len(weights), 15, 15))
        blocks[:, :12, :12] = (strain.swapaxes(-1, -2) @ (weights[..., None, None] * tangent) @ strain).sum(axis=1)
        divergence = (kinematics.cofactor.reshape(*pressure.shape, 1, 9) @ strain)[:, :, 0]
        blocks[:, 12:, :12] = -(self._hats * weights[:, None, :]) @ divergence
        blocks[:, 12:, 12:] = -compressibility[:, None, None] * ((self._hats * weights[:, None, :]) @ self._hats.T)
        local = np.zeros((len(weights), 15))
        flat = (weights[..., None, None] * stress).reshape(*pressure.shape, 1, 9)
        local[:, :12] = (flat @ strain)[:, :, 0].sum(axis=1)
        volume = weights * (kinematics.volume_change + compressibility[:, None] * pressure)
        local[:, 12:] = -volume @ self._hats.T
        rows, columns = np.broadcast_arrays(self._unknowns[:, :, None], self._unknowns[:, None, :])
        matrix = sp.coo_matrix((blocks.ravel(), (rows.ravel(), columns.ravel())), shape=(self.unknowns,) * 2)
        return np.bincount(self._unknowns.ravel(), local.ravel(), self.unknowns), sp.tril(matrix).tocsc()

    def strain(self, unknowns: np.ndarray) -> np.ndarray:
        """(g,) of the default gauges at ellipse parameters of 0 and more."""
        found = []
        for gauge in self.shape.finger.gauges[2:]:
            surface = Ellipsoid((self.shape.interface[0],) * 2 + (self.shape.interface[1],))
            functional = strain_functional(gauge, gauge_frame(self.shape.finger, gauge, surface), surface)
            moved = self.at(unknowns, functional.points)
            found.append((linear_value if self.linear else elongation)(functional, moved))
        return np.array(found)

    def at(self, unknowns: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Displacement (k, 3) at points (k, 3) of the interface in the finger turned about its axis."""
        radius = np.hypot(points[:, 0], points[:, 1])
        angles = np.arctan2(radius / self.shape.interface[0], points[:, 2] / self.shape.interface[1])
        moved = np.array([self._on_interface(unknowns, float(angle)) for angle in angles])
        outwards = points[:, :2] / np.maximum(radius, 1e-300)[:, None]
        return np.column_stack([moved[:, :1] * outwards, moved[:, 1]])

    def _on_interface(self, unknowns: np.ndarray, angle: float) -> np.ndarray:
        edges, x = self.edges(1.0), angle / (np.pi / 2)
        ends = self.parameters[0][edges[:, :2]]
        which = int(np.clip(np.searchsorted(ends[:, 1], x), 0, len(edges) - 1))
        s = 2 * (x - ends[which, 0]) / (ends[which, 1] - ends[which, 0]) - 1
        return quadratic(s)[0] @ self.displacement(unknowns)[edges[which]]

    @cached_property
    def _strain(self) -> np.ndarray:
        """(cells, q, 9, 12): displacement gradient in (r, z, theta) by the displacements of a cell."""
        values = [(np.asarray(f[0]), f[0].grad) for f in self.basis.basis]
        radius = np.asarray(self.basis.global_coordinates())[0]
        strain = np.zeros((*radius.shape, 3, 3, 6, 2))
        for node, (value, grad) in enumerate(values):
            for component in range(2):
                strain[..., component, :2, node, component] = np.moveaxis(grad, 0, -1)
            strain[..., 2, 2, node, 0] = value / radius
        return strain.reshape(*radius.shape, 9, 12)

    @cached_property
    def _weights(self) -> np.ndarray:
        return np.asarray(self.basis.dx) * np.asarray(self.basis.global_coordinates())[0]

    @cached_property
    def _hats(self) -> np.ndarray:
        """(3, q) values of the pressure's basis functions."""
        pressure = Basis(self.mesh, ElementTriP1(), intorder=QUADRATURE_ORDER)
        return np.stack([np.asarray(f[0])[0] for f in pressure.basis])

    @cached_property
    def _compressibility(self) -> np.ndarray:
        return np.array([card.compressibility for card in self.cards])[self.layer]

    @cached_property
    def _unknowns(self) -> np.ndarray:
        """(cells, 15) unknowns of each cell."""
        displacements = (2 * self.basis.element_dofs.T[:, :, None] + np.arange(2)).reshape(-1, 12)
        return np.concatenate([displacements, 2 * self.nodes + self.pressure_dofs.T], axis=1)


FINE = Shape(cells=(220, 12, 10, 16), near=0.2, near_share=0.86)
"""Rings of 0.02 mm where a finger is touched."""


def quadratic(s: Any) -> tuple[np.ndarray, np.ndarray]:
    """Values and slopes (..., 3) on an edge, s from -1 to 1, of the functions of its (end, end, middle)."""
    s = np.asarray(s)[..., None]
    values = np.concatenate([s * (s - 1) / 2, s * (s + 1) / 2, 1 - s * s], axis=-1)
    return values, np.concatenate([s - 0.5, s + 0.5, -2 * s], axis=-1)


def _growing(cells: int, ratio: float = 1.2) -> np.ndarray:
    """Points (cells + 1,) from 0 to 1 whose distances grow by `ratio`."""
    return (ratio ** np.arange(cells + 1) - 1) / (ratio**cells - 1)
