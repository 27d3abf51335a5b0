"""From a finger to its layered mesh: a shipped mesh that is mapped, or a new one from the mesher, which is cached."""

from papilla import cache as store
from papilla import checks
from papilla.errors import InputError
from papilla.finger import Finger
from papilla.mesh.child import MESHER_VERSION, Progress
from papilla.mesh.drawing import drawn
from papilla.mesh.layered import LayeredMesh, pack, unpack
from papilla.mesh.references import from_reference

DEFAULT_SIZE_MM = 0.7  # Element size at the contact to which the figures of the README refer


def build(
    finger: Finger,
    size_mm: float = DEFAULT_SIZE_MM,
    *,
    variant: int = 0,
    progress: Progress | None = None,
) -> LayeredMesh:
    """The layered mesh of a finger.

    Parameters
    ----------
    finger : its shape decides the geometry; `Dome` and `Slab` give a mesh that is its own mirror image in x and y.
    size_mm : edge length at the contact; it grows away from the apex (`papilla.mesh.sizing`).
    variant : number >= 0 of an independent mesh of the same design: differences between variants are mesh scatter.
    progress : called with a line of text about twice a second while the mesher runs.

    Raises `InputError` for a size or variant out of range or a gauge off the interface, `MemoryEstimateError` for a
    mesh whose presses would need more memory than is free, `FileAccessError` and `FileFormatError` for surface files,
    `MeshError` if the mesher fails or its mesh is unusable.
    """
    if isinstance(variant, bool) or not isinstance(variant, int) or variant < 0:
        raise InputError(f"variant must be a whole number >= 0, got {variant!r}")
    size_mm = checks.positive("size_mm", size_mm)
    moved = from_reference(finger, size_mm, variant, progress)
    if moved is not None:
        return moved

    def make():
        return pack(drawn(finger, size_mm, variant=variant, progress=progress))

    return unpack(
        store.fetch("mesh", store.versioned_key("mesh", MESHER_VERSION, finger.geometry_sha256, size_mm, variant), make)
    )
