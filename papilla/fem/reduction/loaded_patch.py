"""Loads of the mesh by tractions on the skin: the patch of a touch-down point, and its coupling to the displacement.

Integrals are taken over the skin's own triangles, projected on the contact plane. With the hat functions N_j of the
patch, the shape functions M_i of the displacement and the cosine c between skin and contact plane,

    coupling_ij = int M_i N_j c dA,    mass_j = int N_j c dA,    gap_j = int N_j g c dA,

g being the distance of the exact skin from the contact plane. If the mesh is a quarter of the finger and the patch
reaches over a mirror plane, each image of the quarter contributes a piece: the same facets, seen from mirrored
positions. The pieces share their nodes on the mirror planes.
"""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from skfem import BilinearForm, ElementTetP1, FacetBasis, LinearForm

from papilla.errors import InputError
from papilla.fem.discrete.elements import Space, parity_signs
from papilla.fem.reduction.patch import Frame, Patch, gap_of
from papilla.mesh.layered import LayeredMesh
from papilla.mesh.surfaces import Surface

LOAD_QUADRATURE_ORDER = 4
"""Quadrature order for products of quadratic displacement, linear pressure and the gap on the skin's triangles."""

STEEPEST = 0.2
"""Smallest cosine between skin and contact plane for skin that is part of a patch."""


@dataclass(frozen=True, eq=False)
class LoadedPatch:
    """A patch with its coupling to the displacement: for each image of the cell, (nodes of the cell, n) integrals of
    displacement shape function times hat function over the contact plane."""

    patch: Patch
    frame: Frame
    couplings: dict[tuple[int, int], sp.csr_matrix]

    def loads(self, parity: tuple[int, int], component: int = 0) -> sp.csc_matrix:
        """Displacement load (3 * nodes, n) of a unit traction at each patch node, for fields of one parity.

        Component 0 is pressure; 1 and 2 are tangential tractions on the finger along the contact plane's axes.
        """
        direction = self.frame.axes[component - 1] if component else -self.frame.axes[2]
        parts = [
            sp.kron(coupling, (parity_signs(parity, image) * direction)[:, None])
            for image, coupling in self.couplings.items()
        ]
        return sum(parts[1:], start=parts[0]).tocsc()


def build_patch(
    space: Space, whole: LayeredMesh, skin: Surface, frame: Frame, radius: float, symmetric: bool
) -> LoadedPatch:
    """The patch of `radius` mm around a contact frame.

    `space` lives on the cell of the mesh `whole`; with `symmetric` the patch contains only the cell's part and its
    mirror images are implied; else it contains all images.
    """
    mirrors = ["xyz".index(axis) for axis in whole.mirrors]
    flips = [axis for axis in mirrors if not symmetric]
    images = _sign_pairs(flips)
    skin_triangles = space.mesh.boundaries["skin"]
    facets = space.facets(skin_triangles)
    pieces = [piece for image in images if (piece := _piece(space, skin, frame, radius, facets, image)) is not None]
    if not pieces:
        raise InputError(f"no skin within {radius:g} mm of the touch-down point faces the specimen")
    positions, numbers = _merge_nodes(space.mesh.points, pieces)
    couplings, triangles = {}, []
    mass, gap = np.zeros(len(positions)), np.zeros(len(positions))
    rim = np.zeros(len(positions), dtype=bool)
    for piece, number in zip(pieces, numbers, strict=True):
        np.add.at(mass, number, piece.mass)
        np.add.at(gap, number, piece.gap)
        rim[number[piece.rim]] = True
        renumber = np.full(len(space.mesh.points), -1)
        renumber[piece.vertices] = number
        triangles.append(renumber[piece.triangles])
        spread = sp.csr_matrix(
            (np.ones(len(number)), (np.arange(len(number)), number)), shape=(len(number), len(positions))
        )
        couplings[piece.image] = (piece.coupling @ spread).tocsr()
    local = frame.local(positions)
    repeat = _sign_pairs(mirrors) if symmetric else [(1, 1)]
    patch = Patch(local[:, :2], np.concatenate(triangles), mass, gap, rim, np.array(repeat))
    return LoadedPatch(patch, frame, couplings)


@dataclass(frozen=True, eq=False)
class _Piece:
    image: tuple[int, int]
    vertices: np.ndarray
    triangles: np.ndarray
    mass: np.ndarray
    gap: np.ndarray
    rim: np.ndarray
    coupling: sp.csr_matrix


def _piece(space, skin, frame, radius, facets, image) -> _Piece | None:
    """The part of a patch in one mirror image of the cell; integrals over the cell's own facets."""
    mirror = np.array([*image, 1])
    corners = space.mesh.points * mirror
    triangles = space.mesh.boundaries["skin"]
    local = frame.local(corners)
    # A triangle belongs to the patch if it is near, and not so steep that a pressure along the plane's normal would act
    # along the skin. Both its own normal and that of the exact skin count: the latter tells the far side of the finger.
    near = np.hypot(local[:, 0], local[:, 1]) < radius
    ends = local[triangles]
    area = np.cross(ends[:, 1] - ends[:, 0], ends[:, 2] - ends[:, 0])
    facing = np.abs(area[:, 2]) > STEEPEST * np.linalg.norm(area, axis=1)
    outward = skin.normal(corners[triangles].mean(axis=1)) @ frame.axes[2] > STEEPEST
    chosen = near[triangles].all(axis=1) & facing & outward
    if not chosen.any():
        return None
    moved, loaded = (
        FacetBasis(space.skmesh, element, facets=facets[chosen], intorder=LOAD_QUADRATURE_ORDER)
        for element in (space.scalar_element, ElementTetP1())
    )
    normal = frame.axes[2] * mirror

    def projected(w):
        return np.abs(sum(w.n[i] * normal[i] for i in range(3)))

    def distance(w):
        points = np.stack([w.x[i] for i in range(3)], axis=-1) * mirror
        return gap_of(skin, frame, points.reshape(-1, 3)).reshape(points.shape[:-1])

    # The facets are those of the cell; positions are mirrored instead, so that one basis serves all images.
    vertices = np.unique(triangles[chosen])
    mass = LinearForm(lambda v, w: v * projected(w)).assemble(loaded)[vertices]
    gap = LinearForm(lambda v, w: v * projected(w) * distance(w)).assemble(loaded)[vertices]
    coupling = BilinearForm(lambda u, v, w: u * v * projected(w)).assemble(loaded, moved)[:, vertices]
    # Skin continues beyond these nodes, but the patch does not
    outside = np.isin(vertices, np.unique(triangles[~chosen]))
    return _Piece(image, vertices, triangles[chosen], mass, gap, outside, coupling.tocsr())


def _sign_pairs(axes: list[int]) -> list[tuple[int, int]]:
    return [(sx, sy) for sx in ((1, -1) if 0 in axes else (1,)) for sy in ((1, -1) if 1 in axes else (1,))]


def _merge_nodes(points: np.ndarray, pieces: list[_Piece]) -> tuple[np.ndarray, list[np.ndarray]]:
    """Positions of the distinct patch nodes and, for each piece, their numbers; nodes on mirror planes are shared."""
    # Adding zero turns -0.0 into 0.0, so that a mirrored node is the same node
    places = [points[piece.vertices] * np.array([*piece.image, 1]) + 0.0 for piece in pieces]
    positions, numbers = np.unique(np.concatenate(places), axis=0, return_inverse=True)
    ends = np.cumsum([len(place) for place in places])[:-1]
    return positions, np.split(numbers.ravel(), ends)
