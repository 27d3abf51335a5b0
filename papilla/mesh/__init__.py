"""Surfaces to tetrahedra: a layered, tagged, snapped and cached mesh of a finger.

>>> mesh = papilla.mesh.build(finger)            # a LayeredMesh
"""

from papilla.mesh.builder import DEFAULT_SIZE_MM, build, default_size_mm
from papilla.mesh.cells import quality
from papilla.mesh.layered import BONE_LAYER, BOUNDARY_NAMES, INNER_LAYER, OUTER_LAYER, LayeredMesh

__all__ = [
    "BONE_LAYER",
    "BOUNDARY_NAMES",
    "DEFAULT_SIZE_MM",
    "default_size_mm",
    "INNER_LAYER",
    "OUTER_LAYER",
    "LayeredMesh",
    "build",
    "quality",
]
