"""A new mesh from the mesher, for shapes that no shipped mesh can be mapped to: surfaces from files, unusual domes and
slabs, and the shipped meshes themselves.

TetWild cannot be seeded, so each call gives another mesh. A mesh with flat or inverted cells, or in several parts, is
discarded and made again.
"""

from dataclasses import replace

import numpy as np

from papilla.errors import MeshError
from papilla.finger import Finger
from papilla.mesh.body import Body
from papilla.mesh.child import Progress, tetrahedralise
from papilla.mesh.finishing import finished
from papilla.mesh.layered import LayeredMesh
from papilla.mesh.sizing import Sizing, asked, grid_over, positively_oriented
from papilla.mesh.snapping import snap
from papilla.mesh.tagging import TaggedCells, tag

DRAWS = 5  # Largest number of meshes that are made for a finger
ENVELOPE, ENVELOPE_SIZES = 1e-3, 0.05
"""How far the mesher may move a surface: a fraction of the bounding box's diagonal, or of the element size if more."""

REACH = 3.0  # Flat faces are searched within this many envelopes of their plane


def drawn(finger: Finger, size_mm: float, *, variant: int = 0, progress: Progress | None = None) -> LayeredMesh:
    """A new mesh of a finger; arguments as of `papilla.mesh.build`, and raises as it does."""
    body, sizing = asked(finger, size_mm, variant)
    keep_bone = finger.bone is not None
    for draw in range(1, DRAWS + 1):
        try:
            return finished(body, _draw(body, sizing, keep_bone, variant, progress), size_mm, keep_bone, progress)
        except MeshError as error:
            if draw == DRAWS:
                raise MeshError(f"{error} ({DRAWS} meshes were drawn)") from error
            if progress is not None:
                progress(f"mesh {draw} of at most {DRAWS} cannot be used, drawing another: {error}")
    raise AssertionError("unreachable")


def _draw(body: Body, sizing: Sizing, keep_bone: bool, variant: int, progress: Progress | None) -> TaggedCells:
    """One mesh from the mesher, with its cells sorted and its vertices moved onto the surfaces."""
    diagonal = float(np.linalg.norm(body.high - body.low))
    envelope = max(ENVELOPE, ENVELOPE_SIZES * sizing.near_mm / diagonal)
    points, tets = tetrahedralise(_soup(body, sizing, envelope, variant), progress)
    cells = tag(body, points, positively_oriented(points, tets), keep_bone, REACH * envelope * diagonal)
    return replace(cells, points=snap(body, cells))


def _soup(body: Body, sizing: Sizing, envelope: float, variant: int) -> dict[str, np.ndarray]:
    """The mesher's input; each variant has its own triangles and a shifted sizing grid."""
    offsets = np.cumsum([0] + [len(vertices) for vertices, _ in body.triangulations])
    triangles = np.vstack([faces + k for (_, faces), k in zip(body.triangulations, offsets, strict=False)])
    shift = np.random.default_rng(variant).uniform(-0.5, 0.5, 3) if variant else np.zeros(3)
    grid_points, grid_tets = grid_over(body.low, body.high, sizing.grid_mm, shift)
    return {
        "vertices": np.vstack([vertices for vertices, _ in body.triangulations]),
        "triangles": triangles,
        "far_mm": np.array(sizing.far_mm),
        "envelope": np.array(envelope),
        "grid_points": grid_points,
        "grid_tets": grid_tets,
        "grid_sizes": sizing(grid_points),
    }
