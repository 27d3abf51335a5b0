"""The press that every library makes: a rigid flat on the finger at its apex, to the same depth, without friction.

It is defined once, in nodes and arrays, so that only the libraries differ: mesh, P2 nodes, layer-wise P1 pressure,
clamped and mirror nodes, gap of the exact skin over its nodes, gauges.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from papilla.fem import FingerModel
from papilla.fem.discrete.assembly import lame
from papilla.fem.discrete.elements import SYMMETRIC, TaylorHood
from papilla.fem.reduction.finger_model import STEEPEST
from papilla.fem.reduction.gauges import gauge_functionals, gauge_weights
from papilla.fem.reduction.patch import Frame, gap_of
from papilla.mesh.layered import LayeredMesh
from papilla.units import to_microstrain


@dataclass(frozen=True, eq=False)
class PeerScene:
    """A rigid flat pressed `indentation` mm into the finger of `model` at its apex.

    The libraries use the cell of the model's mesh: a part with mirrors, or the whole finger without mirrors.
    """

    model: FingerModel
    indentation: float

    @property
    def space(self) -> TaylorHood:
        """Numbering of the P2 nodes and of the layer-wise pressures."""
        assert isinstance(self.model.space, TaylorHood)
        return self.model.space

    @property
    def mesh(self) -> LayeredMesh:
        """The cell."""
        return self.space.mesh

    @property
    def multiplicity(self) -> int:
        """Number of repetitions of the cell: forces on the finger are this many times those on the cell."""
        return 2 ** len(self.model.mesh.mirrors)

    @property
    def nodes(self) -> np.ndarray:
        """Positions (n, 3) of the P2 nodes in mm: vertices first, in the order of the mesh."""
        return self.space.displacement.doflocs.T

    @cached_property
    def elasticity(self) -> dict[int, tuple[float, float]]:
        """Layer number of the mesh -> shear modulus (MPa) and compressibility 1/lambda (1/MPa)."""
        return {number: lame(self.model.layers[number]) for number in self.space.layer_numbers}

    @cached_property
    def held(self) -> np.ndarray:
        """Mask (n, 3) of the displacements that the clamped base and the mirror planes hold at zero."""
        free = self.space.free(SYMMETRIC, self.model.mesh.mirrors)
        return ~free[: 3 * self.space.nodes].reshape(-1, 3)

    @cached_property
    def frame(self) -> Frame:
        """The contact plane at first touch; the flat comes down along its normal."""
        return Frame.at(self.model.surfaces["skin"], 0.0, 0.0)

    @cached_property
    def contact_triangles(self) -> np.ndarray:
        """Triangles (k, 3) of the skin that may touch the flat: within the patch radius, facing the flat."""
        triangles = self.mesh.boundaries["skin"]
        local = self.frame.local(self.mesh.points)
        near = np.hypot(local[:, 0], local[:, 1]) < self.model.finger.patch_radius
        skin = self.model.surfaces["skin"]
        facing = skin.normal(self.mesh.points[triangles].mean(axis=1)) @ self.frame.axes[2] > STEEPEST
        return triangles[near[triangles].all(axis=1) & facing]

    @cached_property
    def contact_nodes(self) -> np.ndarray:
        """Numbers of the P2 nodes on the contact triangles."""
        return self.space.nodes_on(self.contact_triangles)

    @cached_property
    def contact_gaps(self) -> np.ndarray:
        """Distance (mm) of the exact skin above each contact node from the flat at first touch."""
        return gap_of(self.model.surfaces["skin"], self.frame, self.nodes[self.contact_nodes])

    @cached_property
    def first_guess(self) -> np.ndarray:
        """First guess of the displacement (n, 3): half of the indentation for all free components.

        A flat that cuts a round skin to depth d overlaps twice the area that it touches, and half of d gives that area.
        """
        guess = np.broadcast_to(-0.5 * self.indentation * self.frame.axes[2], self.nodes.shape)
        return np.where(self.held, 0.0, guess)

    def sd(self, displacement: np.ndarray) -> float:
        """Population standard deviation of the gauge readings (microstrain) of a displacement (n, 3) in mm."""
        functionals = gauge_functionals(self.model.finger, self.model.surfaces["interface"])
        weights = gauge_weights(self.model.finger)
        quantities = (self.model.rows(functionals, SYMMETRIC) @ displacement.ravel()).reshape(weights.shape)
        return float(to_microstrain((weights * quantities).sum(axis=0)).std())


@dataclass(frozen=True, eq=False)
class PeerSolution:
    """Result of a library's press: the finger's force (N) and the displacement (n, 3) of the P2 nodes in mm.

    systems : how many linear systems were factored.
    seconds : of assembly, factorisations and iterations; `seconds_assembly` of the elastic matrix alone.
    """

    force: float
    displacement: np.ndarray
    systems: int
    seconds: float
    seconds_assembly: float
