"""The patch of a finger on its mesh: its nodes, its weak integrals, and its coupling to the displacement.

The tractions of a contact patch load the mesh. Integrals are taken over the skin's own triangles, projected on the
contact plane. With the hat functions N_j of the patch, the shape functions M_i of the displacement and the cosine c
between skin and contact plane,

    coupling_ij = int M_i N_j c dA,    mass_j = int N_j c dA,    gap_j = int N_j g c dA,

g being the distance of the exact skin from the contact plane. If the mesh is a quarter of the finger and the patch
reaches over a mirror plane, each image of the quarter contributes a piece: the same facets, seen from mirrored
positions. The pieces share their nodes on the mirror planes.
"""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from skfem import BilinearForm, ElementTetP1, FacetBasis, LinearForm

from papilla.core.errors import InputError
from papilla.fem.discrete.elements import Space, parity_signs
from papilla.fem.reduction.patch import Frame, Patch, gap_of
from papilla.mesh.layered import LayeredMesh
from papilla.mesh.surfaces import Surface

LOAD_QUADRATURE_ORDER = 4
"""Quadrature order for products of quadratic displacement, linear pressure and the gap on the skin's triangles."""

SMALLEST_SKIN_COSINE = 0.2
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
    space: Space, mesh: LayeredMesh, skin: Surface, frame: Frame, radius: float, symmetric: bool
) -> LoadedPatch:
    """The patch of `radius` mm around a contact frame.

    `space` lives on the cell of `mesh`; with `symmetric` the patch contains only the cell's part and its mirror images
    are implied; else it contains all images.
    """
    triangles, every = space.mesh.boundaries["skin"], image_signs(mesh.mirrors)
    images = {}
    for image in [(1, 1)] if symmetric else every:
        chosen = _near_skin(space, skin, frame, radius, image)
        if chosen.any():
            images[image] = chosen
    if not images:
        raise InputError(f"no skin within {radius:g} mm of the touch-down point faces the specimen")
    vertices = [np.unique(triangles[chosen]) for chosen in images.values()]
    # Adding zero turns -0.0 into 0.0, so that a mirrored node is the same node
    places = [space.mesh.points[of] * [*image, 1] + 0.0 for image, of in zip(images, vertices, strict=True)]
    positions, places_number = np.unique(np.concatenate(places), axis=0, return_inverse=True)
    numbers = np.split(places_number.ravel(), np.cumsum([len(of) for of in vertices])[:-1])
    couplings, patch_triangles, (mass, gap, rim) = {}, [], np.zeros((3, len(positions)))
    for (image, chosen), of, number in zip(images.items(), vertices, numbers, strict=True):
        weights, coupling = _integrals(space, skin, frame, image, chosen)
        mass[number] += weights[0, of]
        gap[number] += weights[1, of]
        # Skin continues beyond these nodes, but the patch does not
        rim[number] += np.isin(of, triangles[~chosen])
        spread = sp.csr_matrix((np.ones(len(of)), (of, number)), shape=(len(space.mesh.points), len(positions)))
        couplings[image] = (coupling @ spread).tocsr()
        patch_triangles.append(number[np.searchsorted(of, triangles[chosen])])
    implied = np.array(every if symmetric else [(1, 1)])
    xy = frame.local(positions)[:, :2]
    return LoadedPatch(Patch(xy, np.concatenate(patch_triangles), mass, gap, rim > 0, implied), frame, couplings)


def image_signs(mirrors: tuple[str, ...]) -> list[tuple[int, int]]:
    """Signs (x, y) of all mirror images of a cell; the cell itself first."""
    return [(sx, sy) for sx in ((1, -1) if "x" in mirrors else (1,)) for sy in ((1, -1) if "y" in mirrors else (1,))]


def _near_skin(space: Space, skin: Surface, frame: Frame, radius: float, image: tuple[int, int]) -> np.ndarray:
    """Mask of the skin's triangles that belong to the patch in one mirror image of the cell."""
    triangles, corners = space.mesh.boundaries["skin"], space.mesh.points * [*image, 1]
    local = frame.local(corners)
    # A triangle belongs to the patch if it is near, and not so steep that a pressure along the plane's normal would act
    # along the skin. Both its own normal and that of the exact skin count: the latter tells the far side of the finger.
    near = np.hypot(local[:, 0], local[:, 1]) < radius
    ends = local[triangles]
    area = np.cross(ends[:, 1] - ends[:, 0], ends[:, 2] - ends[:, 0])
    facing = np.abs(area[:, 2]) > SMALLEST_SKIN_COSINE * np.linalg.norm(area, axis=1)
    outward = skin.normal(corners[triangles].mean(axis=1)) @ frame.axes[2] > SMALLEST_SKIN_COSINE
    return near[triangles].all(axis=1) & facing & outward


def _integrals(
    space: Space, skin: Surface, frame: Frame, image: tuple[int, int], chosen: np.ndarray
) -> tuple[np.ndarray, sp.csr_matrix]:
    """Mass and gap (2, vertices), and the coupling (nodes of the cell, vertices), of chosen triangles in one image."""
    facets = space.facets(space.mesh.boundaries["skin"])[chosen]
    moved, loaded = (
        FacetBasis(space.skmesh, element, facets=facets, intorder=LOAD_QUADRATURE_ORDER)
        for element in (space.scalar_element, ElementTetP1())
    )
    # The facets are those of the cell; positions are mirrored instead, so that one basis serves all images.
    mirror = np.array([*image, 1])
    normal = frame.axes[2] * mirror

    def projected(w):
        return np.abs(sum(w.n[i] * normal[i] for i in range(3)))

    def distance(w):
        points = np.stack([w.x[i] for i in range(3)], axis=-1) * mirror
        return gap_of(skin, frame, points.reshape(-1, 3)).reshape(points.shape[:-1])

    mass = LinearForm(lambda v, w: v * projected(w)).assemble(loaded)
    gap = LinearForm(lambda v, w: v * projected(w) * distance(w)).assemble(loaded)
    coupling = BilinearForm(lambda u, v, w: u * v * projected(w)).assemble(loaded, moved)
    return np.array([mass, gap]), coupling.tocsr()
