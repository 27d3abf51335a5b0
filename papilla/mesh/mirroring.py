"""The whole mesh of a meshed quarter, by exact mirror images."""

import numpy as np

from papilla.mesh.layered import BOUNDARIES, LayeredMesh


def mirrored(cell: LayeredMesh, mirrors: tuple[str, ...]) -> LayeredMesh:
    """`cell`, whose plane vertices have coordinates of exactly zero, repeated in the zero planes of `mirrors`.

    The vertices and cells of `cell` come first and unchanged.
    """
    points, tets, layer = cell.points, cell.tets, cell.layer
    boundaries = {name: cell.boundaries[name] for name in BOUNDARIES}
    for name in mirrors:
        axis = "xyz".index(name)
        off_plane = points[:, axis] != 0
        image = np.arange(len(points))
        image[off_plane] = len(points) + np.arange(off_plane.sum())
        flipped = points[off_plane].copy()
        flipped[:, axis] *= -1
        points = np.vstack([points, flipped])
        tets = np.vstack([tets, image[tets][:, [0, 2, 1, 3]]])
        layer = np.concatenate([layer, layer])
        boundaries = {key: np.vstack([faces, image[faces][:, ::-1]]) for key, faces in boundaries.items()}
    return LayeredMesh(points, tets, layer, boundaries, cell.size_mm, tuple(mirrors))
