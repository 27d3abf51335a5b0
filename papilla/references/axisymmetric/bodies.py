"""A finger of revolution and a block, both at finite strain, in the half plane (r, z): a check of the 3-D press.

Taylor-Hood on curved quadratic triangles: displacement and geometry P2, pressure P1 and its own in each layer. Law,
contact and readout are independent: nothing is shared with `papilla.fem`.

The law of a nearly incompressible rubber, for the plane and hoop parts of the displacement gradient, is
W = mu / (2 m^2) tr(C^m) - (mu/m + p) ln J - p^2 / (2 lambda) + const, m = 1 neo-Hookean and m = alpha/2 Ogden's with
an even alpha; p is the pressure-like unknown: ln J + p / lambda = 0 holds in the mean. First Piola stress:
P = mu/m F C^(m-1) - (mu/m + p) F^-T. Gradients are held as (r,r), (r,z), (z,r), (z,z), (theta,theta).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp
from skfem import Basis, ElementTriP1, ElementTriP2, MeshTri, MeshTri2

from papilla.core import settings

BODY_PARAMETERS = settings.parameters(__name__)
ENTRY_ROWS, ENTRY_COLUMNS = np.array([0, 0, 1, 1, 2]), np.array([0, 1, 0, 1, 2])
"""Positions of the five entries of a gradient in the axisymmetric 3 x 3 matrix."""
OUTER_PART, INNER_PART, SPECIMEN_PART = 0, 1, 2
REVOLUTION_QUADRATURE_ORDER = 5
CELL_NODES, PRESSURE_CORNERS, GRADIENT_ENTRIES = 6, 3, len(ENTRY_ROWS)
"""Nodes of a cell, those that carry a pressure, and entries of a displacement gradient."""
CELL_DISPLACEMENTS = 2 * CELL_NODES
"""Displacement unknowns of a cell; those of its pressures follow."""
SPECIMEN_SURFACE_PARAMETER = 10.0
"""Parameter of the specimen's surface, separate from the finger's."""


@dataclass(frozen=True)
class Rubber:
    """Young's `modulus` (MPa) and Poisson's ratio of small strain; `linear` restricts it to small strain.

    half_alpha : half of Ogden's exponent, 1 for neo-Hookean. A modulus of infinity is a rigid body.
    """

    modulus: float
    nu: float = 0.4999
    linear: bool = False
    half_alpha: int = 1

    @property
    def shear_modulus(self) -> float:
        """mu in MPa."""
        return self.modulus / (2 * (1 + self.nu))

    @property
    def compressibility(self) -> float:
        """1/lambda in 1/MPa."""
        return (1 + self.nu) * (1 - 2 * self.nu) / (self.modulus * self.nu)

    def response(self, gradient: np.ndarray, pressure: np.ndarray) -> tuple[np.ndarray, ...]:
        """Stress (..., 5), its derivative (..., 5, 5) by the gradient, ln J (...), and its derivative (..., 5).

        gradient : of the displacement (..., 5); pressure (...) in MPa. The stress's derivative by the pressure is less
        the derivative of ln J. Raises `FloatingPointError` where J is not positive.
        """
        mu, small = self.shear_modulus, _matrix(gradient)
        unit, transposed = (
            np.eye(3),
            np.equal.outer(ENTRY_ROWS, ENTRY_COLUMNS) & np.equal.outer(ENTRY_COLUMNS, ENTRY_ROWS),
        )
        if self.linear:
            stress = mu * (small + small.swapaxes(-1, -2)) - pressure[..., None, None] * unit
            tangent = np.broadcast_to(
                mu * (np.eye(GRADIENT_ENTRIES) + transposed), (*pressure.shape, GRADIENT_ENTRIES, GRADIENT_ENTRIES)
            )
            slope = np.broadcast_to(unit[ENTRY_ROWS, ENTRY_COLUMNS], gradient.shape)
            return stress[..., ENTRY_ROWS, ENTRY_COLUMNS], tangent, small.trace(axis1=-2, axis2=-1), slope
        deformation = small + unit
        jacobian, inverse = _inverted(deformation)
        if not (jacobian > 0).all():
            raise FloatingPointError("a cell is turned inside out")
        power, by = self._power(deformation)
        share = mu / self.half_alpha
        stress = share * power - (share + pressure)[..., None, None] * inverse
        turned = inverse[..., ENTRY_ROWS[:, None], ENTRY_COLUMNS] * inverse[..., ENTRY_ROWS, ENTRY_COLUMNS[:, None]]
        tangent = share * by + (share + pressure)[..., None, None] * turned
        return (
            stress[..., ENTRY_ROWS, ENTRY_COLUMNS],
            tangent,
            np.log(jacobian),
            inverse[..., ENTRY_ROWS, ENTRY_COLUMNS],
        )

    def _power(self, deformation: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """F C^(m-1) (..., 3, 3), and its derivative (..., 5, 5) by F."""
        value, by = (
            deformation,
            np.broadcast_to(np.eye(GRADIENT_ENTRIES), (*deformation.shape[:-2], GRADIENT_ENTRIES, GRADIENT_ENTRIES)),
        )
        directions = np.zeros((GRADIENT_ENTRIES, 3, 3))
        directions[np.arange(GRADIENT_ENTRIES), ENTRY_ROWS, ENTRY_COLUMNS] = 1
        slopes = np.broadcast_to(directions, (*deformation.shape[:-2], GRADIENT_ENTRIES, 3, 3))
        right = deformation.swapaxes(-1, -2) @ deformation
        for _ in range(self.half_alpha - 1):
            change = directions.swapaxes(-1, -2) @ deformation[..., None, :, :]
            change = change + change.swapaxes(-1, -2)
            slopes = slopes @ right[..., None, :, :] + value[..., None, :, :] @ change
            value, by = value @ right, slopes[..., ENTRY_ROWS, ENTRY_COLUMNS].swapaxes(-1, -2)
        return value, by


def _inverted(deformation: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Determinant (...) and transposed inverse (..., 3, 3) of a plane part and a hoop stretch."""
    a, b, c, d, hoop = (deformation[..., row, column] for row, column in zip(ENTRY_ROWS, ENTRY_COLUMNS, strict=True))
    plane = a * d - b * c
    with np.errstate(divide="ignore", invalid="ignore"):
        entries = np.stack([d / plane, -c / plane, -b / plane, a / plane, 1 / hoop], axis=-1)
    return plane * hoop, _matrix(entries)


def _matrix(entries: np.ndarray) -> np.ndarray:
    """(..., 3, 3) of five entries."""
    matrix = np.zeros((*entries.shape[:-1], 3, 3))
    matrix[..., ENTRY_ROWS, ENTRY_COLUMNS] = entries
    return matrix


@dataclass(frozen=True)
class Shape:
    """Half ellipses (r, z) of skin, interface and bone, and a bonded cylinder of `thickness` and `width`, all in mm.

    cells : along the skin, through the outer and the inner layer, and through the specimen; smallest at the interface
        and at the specimen's surface.
    near : value of the skin's parameter up to which `near_share` of the cells along the skin lie, because contact is
        there; and the same share of the specimen's cells up to the same radius.
    ball : radius of the cylinder's top, which is then a part of a ball; at least `width`, infinite for a flat top.
    """

    outer: tuple[float, float] = BODY_PARAMETERS.outer_mm
    interface: tuple[float, float] = BODY_PARAMETERS.interface_mm
    bone: tuple[float, float] = BODY_PARAMETERS.bone_mm
    thickness: float = BODY_PARAMETERS.thickness_mm
    width: float = BODY_PARAMETERS.width_mm
    cells: tuple[int, int, int, int] = BODY_PARAMETERS.cells
    near: float = BODY_PARAMETERS.near
    near_share: float = BODY_PARAMETERS.near_share
    ball: float = math.inf

    def mapped(self, parameters: np.ndarray) -> np.ndarray:
        """(r, z) in mm (2, n) of parameters (2, n): along the skin 0-1; from bone 0 over interface 1 to skin 2."""
        x, y = parameters
        deep, height = y - SPECIMEN_SURFACE_PARAMETER, self.height(self.width * x)
        levels = np.array([self.bone, self.interface, self.outer])
        a, c = (np.interp(y, [0, 1, 2], levels[:, k]) for k in (0, 1))
        finger = np.stack([a * np.sin(np.pi / 2 * x), c * np.cos(np.pi / 2 * x)])
        specimen = [self.width * x, self.outer[1] + height + (self.thickness - height) * deep]
        return np.where(deep < 0, finger, specimen)

    def height(self, r: np.ndarray) -> np.ndarray:
        """Of the specimen's top over the plane that touches it, in mm."""
        return r**2 / (self.ball + np.sqrt(self.ball**2 - r**2))

    def along(self, r: np.ndarray) -> np.ndarray:
        """Distance along the specimen's top from the axis, in mm."""
        return r if math.isinf(self.ball) else self.ball * np.arcsin(r / self.ball)

    def grid(self, end: float) -> np.ndarray:
        """Parameters (n,) of the cells' ends along a surface, `near_share` of them up to the parameter `end`."""
        along = self.cells[0]
        if end >= 1:
            return np.linspace(0, 1, along + 1)
        near = round(self.near_share * along)
        return np.append(np.linspace(0, end, near + 1), end + (1 - end) * _growing(along - near)[1:])


class Bodies:
    """Finger and specimen as one mesh of two parts; unknowns are 2 * node + component (r, z), then pressures.

    `rubbers` are those of OUTER, INNER and SPECIMEN; a rigid specimen's nodes all move with the table. With a linear
    finger the contact, too, is that of the undeformed shape.
    """

    def __init__(self, shape: Shape, rubbers: Sequence[Rubber]):
        self.shape, self.rubbers = shape, tuple(rubbers)
        _, outer, inner, deep = shape.cells
        through = np.concatenate([1 - _growing(inner, 1.3)[::-1], np.linspace(1, 2, outer + 1)[1:]])
        near = shape.outer[0] * math.sin(math.pi / 2 * shape.near) / shape.width
        specimen = MeshTri.init_tensor(shape.grid(near), SPECIMEN_SURFACE_PARAMETER + _growing(deep))
        flat = MeshTri.init_tensor(shape.grid(shape.near), through) + specimen
        curved = MeshTri2.from_mesh(flat)
        self.parameters = curved.doflocs
        self.mesh = MeshTri2(shape.mapped(curved.doflocs), curved.t)
        self.basis = Basis(self.mesh, ElementTriP2(), intorder=REVOLUTION_QUADRATURE_ORDER)
        height = self.parameters[1, self.basis.element_dofs].mean(axis=0)
        self.layer = np.where(
            height > SPECIMEN_SURFACE_PARAMETER, SPECIMEN_PART, np.where(height > 1, OUTER_PART, INNER_PART)
        )
        key = self.mesh.t * (SPECIMEN_PART + 1) + self.layer
        self.pressure_dofs = np.unique(key, return_inverse=True)[1].reshape(key.shape)
        self.nodes, self.pressures = self.basis.N, int(self.pressure_dofs.max()) + 1

    @property
    def linear(self) -> bool:
        """Whether the finger is at small strain."""
        return self.rubbers[OUTER_PART].linear

    @property
    def unknowns(self) -> int:
        """Number of all unknowns, before boundary conditions are applied."""
        return 2 * self.nodes + self.pressures

    @cached_property
    def table(self) -> np.ndarray:
        """Displacement unknowns along z on the specimen's table, or of the whole specimen where it is rigid."""
        y = self.parameters[1]
        return (
            2
            * np.flatnonzero(
                y >= SPECIMEN_SURFACE_PARAMETER
                if np.isinf(self.rubbers[SPECIMEN_PART].modulus)
                else y == SPECIMEN_SURFACE_PARAMETER + 1
            )
            + 1
        )

    @cached_property
    def free(self) -> np.ndarray:
        """Mask (unknowns,): base, bone and table are held, and the axis stays straight."""
        x, y = self.parameters
        free = np.ones((self.nodes, 2), dtype=bool)
        free[(y == 0) | ((x == 1) & (y < SPECIMEN_SURFACE_PARAMETER))] = False
        free[self.table // 2] = False
        free[x == 0, 0] = False
        return np.append(free.ravel(), np.ones(self.pressures, dtype=bool))

    @cached_property
    def scale(self) -> np.ndarray:
        """(unknowns,) by which unknowns are divided for a dimensionless norm: the finger's half breadth in mm, and its
        modulus in MPa for pressures."""
        return np.repeat([self.shape.outer[0], self.rubbers[OUTER_PART].modulus], [2 * self.nodes, self.pressures])

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
        """Internal forces (unknowns,) and tangent (symmetric), divided by 2 pi.

        Raises `FloatingPointError` where a cell is turned inside out.
        """
        gradient = (self._strain @ unknowns[self._unknowns[:, None, :CELL_DISPLACEMENTS, None]])[..., 0]
        pressure = unknowns[2 * self.nodes + self.pressure_dofs.T] @ self._hats
        size = CELL_DISPLACEMENTS + PRESSURE_CORNERS
        local, blocks = np.zeros((len(gradient), size)), np.zeros((len(gradient), size, size))
        for number, rubber in enumerate(self.rubbers):
            cells = self.layer == number
            if np.isinf(rubber.modulus):
                blocks[cells, CELL_DISPLACEMENTS:, CELL_DISPLACEMENTS:] = np.eye(PRESSURE_CORNERS)
                continue
            stress, tangent, volume, slope = rubber.response(gradient[cells], pressure[cells])
            weights, strain = self._weights[cells], self._strain[cells]
            hats = self._hats * weights[:, None, :]
            rows = strain.reshape(len(strain), -1, CELL_DISPLACEMENTS)
            stiff = (weights[..., None, None] * tangent @ strain).reshape(rows.shape)
            blocks[cells, :CELL_DISPLACEMENTS, :CELL_DISPLACEMENTS] = rows.swapaxes(-1, -2) @ stiff
            blocks[cells, CELL_DISPLACEMENTS:, :CELL_DISPLACEMENTS] = -hats @ (slope[:, :, None] @ strain)[:, :, 0]
            blocks[cells, CELL_DISPLACEMENTS:, CELL_DISPLACEMENTS:] = -rubber.compressibility * (hats @ self._hats.T)
            local[cells, :CELL_DISPLACEMENTS] = ((weights[..., None] * stress).reshape(len(strain), 1, -1) @ rows)[:, 0]
            volume = weights * (volume + rubber.compressibility * pressure[cells])
            local[cells, CELL_DISPLACEMENTS:] = -volume @ self._hats.T
        blocks[:, :CELL_DISPLACEMENTS, CELL_DISPLACEMENTS:] = blocks[
            :, CELL_DISPLACEMENTS:, :CELL_DISPLACEMENTS
        ].swapaxes(-1, -2)
        places, rows, starts = self._pattern
        matrix = sp.csc_matrix((np.bincount(places, blocks.ravel()), rows, starts), shape=(self.unknowns,) * 2)
        return np.bincount(self._unknowns.ravel(), local.ravel(), self.unknowns), matrix

    @cached_property
    def _pattern(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Places (cells * 15 * 15,) of the entries of the cells' blocks in the tangent's data, its rows, and the starts
        of its columns."""
        numbers, size = self._unknowns, self.unknowns
        keys, places = np.unique(numbers[:, None, :] * size + numbers[:, :, None], return_inverse=True)
        return places.ravel(), keys % size, np.searchsorted(keys, size * np.arange(size + 1))

    @cached_property
    def _strain(self) -> np.ndarray:
        """(cells, q, 5, 12): displacement gradient, in the entries of `law`, by the displacements of a cell."""
        values = [(np.asarray(f[0]), f[0].grad) for f in self.basis.basis]
        radius = np.asarray(self.basis.global_coordinates())[0]
        strain = np.zeros((*radius.shape, 3, 3, CELL_NODES, 2))
        for node, (value, grad) in enumerate(values):
            for component in range(2):
                strain[..., component, :2, node, component] = np.moveaxis(grad, 0, -1)
            strain[..., 2, 2, node, 0] = value / radius
        return strain[..., ENTRY_ROWS, ENTRY_COLUMNS, :, :].reshape(*radius.shape, GRADIENT_ENTRIES, CELL_DISPLACEMENTS)

    @cached_property
    def _weights(self) -> np.ndarray:
        return np.asarray(self.basis.dx) * np.asarray(self.basis.global_coordinates())[0]

    @cached_property
    def _hats(self) -> np.ndarray:
        """(3, q) values of the pressure's basis functions."""
        pressure = Basis(self.mesh, ElementTriP1(), intorder=REVOLUTION_QUADRATURE_ORDER)
        return np.stack([np.asarray(f[0])[0] for f in pressure.basis])

    @cached_property
    def _unknowns(self) -> np.ndarray:
        """(cells, 15) unknowns of each cell."""
        displacements = (2 * self.basis.element_dofs.T[:, :, None] + np.arange(2)).reshape(-1, CELL_DISPLACEMENTS)
        return np.concatenate([displacements, 2 * self.nodes + self.pressure_dofs.T], axis=1)


FINE_SHAPE = Shape(**BODY_PARAMETERS.fine)
"""Cells with rings of 0.02 mm in the contact."""


def quadratic(s: Any) -> tuple[np.ndarray, np.ndarray]:
    """Values and slopes (..., 3) on an edge, s from -1 to 1, of the functions of its (end, end, middle)."""
    s = np.asarray(s)[..., None]
    values = np.concatenate([s * (s - 1) / 2, s * (s + 1) / 2, 1 - s * s], axis=-1)
    return values, np.concatenate([s - 0.5, s + 0.5, -2 * s], axis=-1)


def _growing(cells: int, ratio: float = 1.2) -> np.ndarray:
    """Points (cells + 1,) from 0 to 1 whose distances grow by `ratio`."""
    return (ratio ** np.arange(cells + 1) - 1) / (ratio**cells - 1)
