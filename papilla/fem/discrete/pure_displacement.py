"""P1 and P2 in displacements alone, the volumetric energy integrated exactly: the elements that Taylor-Hood replaces.

Near nu = 0.5 both lock: a cell that may not change its volume leaves them too few ways to deform, and the finger comes
out too stiff (P2 loses 5 % of its compliance between nu 0.49 and 0.49999, P1 most of it). They are here to be priced
against Taylor-Hood (`papilla bench`), not to be trusted with rubber.
"""

from collections.abc import Mapping
from functools import cached_property, reduce
from typing import ClassVar

import numpy as np
import scipy.sparse as sp
from skfem import Element, ElementTetP1, ElementTetP2

from papilla.errors import InputError
from papilla.fem.discrete.assembly import Layout
from papilla.fem.discrete.elasticity import lame, volumetric_blocks
from papilla.fem.discrete.space import Space
from papilla.finger import Layer


class PureDisplacement(Space):
    """Displacements without a pressure, on the cell of a mesh; locks as nu approaches 0.5."""

    @property
    def pressures(self) -> int:
        """There are none."""
        return 0

    def matrix(self, layers: Mapping[int, Layer]) -> sp.csc_matrix:
        """Lower triangle of the stiffness matrix for the given layers, in N/mm.

        Raises `InputError` where nu is 0.5 and lambda infinite.
        """
        constants = {number: lame(layers[number]) for number in self.layer_numbers}
        for number, (_, compressibility) in constants.items():
            if compressibility == 0:
                raise InputError(
                    f"element {self.name} needs nu below 0.5 in every layer, got {layers[number].nu:g}: use Taylor-Hood"
                )
        blocks = (
            mu * self.shear[number] + self.volumetric[number] / compressibility
            for number, (mu, compressibility) in constants.items()
        )
        return self._layout.matrix(np.ravel(reduce(np.add, blocks)))

    def part(self, name: str, layer: int | None = None) -> sp.csc_matrix:
        """One part of the matrix: "shear" or "volumetric" of a layer."""
        return self._layout.matrix(np.ravel(getattr(self, name)[layer]))

    @cached_property
    def volumetric(self) -> dict[int, np.ndarray]:
        """Layer -> blocks (pairs of nodes, 9) of the form div u div v over its cells; goes with lambda."""
        return self._by_layer(volumetric_blocks)

    @cached_property
    def _layout(self) -> Layout:
        return self._layout_with()


class P2(PureDisplacement):
    """Quadratic displacement; locks mildly near nu = 0.5."""

    name: ClassVar[str] = "P2"
    scalar_element: ClassVar[Element] = ElementTetP2()


class P1(PureDisplacement):
    """Linear displacement, constant strain; locks badly near nu = 0.5."""

    name: ClassVar[str] = "P1"
    scalar_element: ClassVar[Element] = ElementTetP1()
