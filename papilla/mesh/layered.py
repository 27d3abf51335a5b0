"""`LayeredMesh`: the tetrahedra of a finger with their layers and named boundaries, as immutable arrays.

A finger with mirror planes is meshed as a quarter: `mirrored` makes the whole mesh, `pack` keeps the quarter alone.
"""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import MappingProxyType

import numpy as np

OUTER_LAYER, INNER_LAYER, BONE_LAYER = 0, 1, 2  # Layer numbers of cells; `BONE_LAYER` occurs only if the bone is meshed
LAYER_NUMBERS = {"outer": OUTER_LAYER, "inner": INNER_LAYER, "bone": BONE_LAYER}
BOUNDARY_NAMES = ("skin", "interface", "base")
"""skin: free outer surface; interface: between outer and inner layer; base: clamped (base plane and rigid bone)."""


@dataclass(frozen=True, eq=False)
class LayeredMesh:
    """A tetrahedral finger mesh.

    Parameters
    ----------
    points : (n, 3) float, mm.
    tets : (m, 4) int, positively oriented.
    layer : (m,) int, `OUTER_LAYER`, `INNER_LAYER` or `BONE_LAYER`.
    boundaries : name -> (k, 3) int triangles, for each name of `BOUNDARY_NAMES`.
    size_mm : requested element size at the contact.
    mirrors : axes ("x", "y") in whose zero plane the mesh is its own exact mirror image.
    edges, middles : (k, 2) int and (k, 3) mm, the bent edges and the positions of their middles: quadratic elements
        have nodes there, and so follow the exact surface (`papilla.mesh.finishing`). Other edges are straight.
    """

    points: np.ndarray
    tets: np.ndarray
    layer: np.ndarray
    boundaries: Mapping[str, np.ndarray]
    size_mm: float
    mirrors: tuple[str, ...] = ()
    edges: np.ndarray = field(default_factory=lambda: np.empty((0, 2)))
    middles: np.ndarray = field(default_factory=lambda: np.empty((0, 3)))

    def __post_init__(self) -> None:
        kinds = {"points": float, "tets": np.int64, "layer": np.int8, "edges": np.int64, "middles": float}
        for name, dtype in kinds.items():
            object.__setattr__(self, name, _frozen(getattr(self, name), dtype))
        boundaries = {name: _frozen(self.boundaries[name], np.int64) for name in BOUNDARY_NAMES}
        object.__setattr__(self, "boundaries", MappingProxyType(boundaries))

    def __repr__(self) -> str:
        half = f", mirrors {' and '.join(self.mirrors)}" if self.mirrors else ""
        return f"LayeredMesh({len(self.points)} points, {len(self.tets)} tets, size_mm {self.size_mm:g}{half})"

    @cached_property
    def sha256(self) -> str:
        """Content hash of points, cells, layers, boundaries and bent edges."""
        digest = hashlib.sha256(repr((self.size_mm, self.mirrors)).encode())
        arrays = (self.points, self.tets, self.layer, *(self.boundaries[name] for name in BOUNDARY_NAMES))
        for array in (*arrays, self.edges, self.middles):
            digest.update(array.tobytes())
        return digest.hexdigest()

    def cell(self) -> "LayeredMesh":
        """The part at positive coordinates that the mirrors repeat; the mesh itself without mirrors."""
        if not self.mirrors:
            return self
        axes = ["xyz".index(axis) for axis in self.mirrors]

        def kept(simplices: np.ndarray) -> np.ndarray:
            return np.all(self.points[simplices].mean(axis=1)[:, axes] > 0, axis=1)

        inside = kept(self.tets)
        used, tets = np.unique(self.tets[inside], return_inverse=True)
        boundaries = {name: np.searchsorted(used, faces[kept(faces)]) for name, faces in self.boundaries.items()}
        bent = np.all(self.middles[:, axes] >= 0, axis=1)
        return LayeredMesh(
            self.points[used],
            tets.reshape(-1, 4),
            self.layer[inside],
            boundaries,
            self.size_mm,
            edges=np.searchsorted(used, self.edges[bent]),
            middles=self.middles[bent],
        )

    def scaled(self, factor: float) -> "LayeredMesh":
        """The same mesh with all lengths times `factor`."""
        lengths = {name: getattr(self, name) * factor for name in ("points", "middles", "size_mm")}
        return replace(self, **lengths)

    def straight(self) -> "LayeredMesh":
        """The same mesh with all edges straight, for elements of lower order."""
        return replace(self, edges=self.edges[:0], middles=self.middles[:0])


def _frozen(values: np.ndarray, dtype: type) -> np.ndarray:
    array: np.ndarray = np.array(values, dtype=dtype, order="C")
    array.flags.writeable = False
    return array


def mirrored(cell: LayeredMesh, mirrors: tuple[str, ...]) -> LayeredMesh:
    """`cell`, whose plane vertices have coordinates of exactly zero, repeated in the zero planes of `mirrors`.

    The vertices and cells of `cell` come first and unchanged.
    """
    points, tets, layer, edges, middles = cell.points, cell.tets, cell.layer, cell.edges, cell.middles
    boundaries = {name: cell.boundaries[name] for name in BOUNDARY_NAMES}
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
        leaving = off_plane[edges].any(axis=1)
        edges = np.vstack([edges, image[edges[leaving]]])
        middles = np.vstack([middles, middles[leaving] * np.where(np.arange(3) == axis, -1, 1)])
    return LayeredMesh(points, tets, layer, boundaries, cell.size_mm, tuple(mirrors), edges, middles)


def pack(mesh: LayeredMesh) -> dict[str, np.ndarray]:
    """The mesh as named arrays for the cache and the shipped files; a mirrored mesh as its cell alone."""
    cell = mesh.cell()
    return {
        "points": cell.points,
        "tets": cell.tets.astype(np.int32),
        "layer": cell.layer,
        **{name: cell.boundaries[name].astype(np.int32) for name in BOUNDARY_NAMES},
        "size_mm": np.array(mesh.size_mm),
        "mirrors": np.array("".join(mesh.mirrors)),
        "edges": cell.edges.astype(np.int32),
        "middles": cell.middles,
    }


def unpack(arrays: Mapping[str, np.ndarray]) -> LayeredMesh:
    """The mesh that was packed; bit for bit if `mirrored` made it."""
    boundaries = {name: arrays[name] for name in BOUNDARY_NAMES}
    points, tets, layer, edges, middles = (arrays[name] for name in ("points", "tets", "layer", "edges", "middles"))
    cell = LayeredMesh(points, tets, layer, boundaries, float(arrays["size_mm"]), (), edges, middles)
    mirrors = tuple(str(arrays["mirrors"]))
    return mirrored(cell, mirrors) if mirrors else cell
