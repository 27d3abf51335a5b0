"""The elements of the linear rungs, by name."""

from papilla.errors import InputError
from papilla.fem.discrete.pure_displacement import P1, P2
from papilla.fem.discrete.space import Space
from papilla.fem.discrete.taylor_hood import TaylorHood
from papilla.mesh.layered import LayeredMesh

ELEMENTS: dict[str, type[Space]] = {space.name: space for space in (TaylorHood, P2, P1)}

DEFAULT_ELEMENT = TaylorHood.name


def space_of(element: str, cell: LayeredMesh) -> Space:
    """The space of an element on the cell of a mesh; raises `InputError` for an unknown name."""
    if element not in ELEMENTS:
        raise InputError(f"element must be one of {', '.join(ELEMENTS)}, got {element!r}")
    return ELEMENTS[element](cell)
