"""Surfaces to tetrahedra: a layered, tagged, snapped and cached mesh of a finger.

>>> mesh = papilla.mesh.build(finger)            # a LayeredMesh
"""

from papilla.mesh.builder import DEFAULT_SIZE_MM, build
from papilla.mesh.cells import quality
from papilla.mesh.layered import BONE, BOUNDARIES, INNER, OUTER, LayeredMesh

__all__ = ["BONE", "BOUNDARIES", "DEFAULT_SIZE_MM", "INNER", "OUTER", "LayeredMesh", "build", "quality"]
