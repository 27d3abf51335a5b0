"""The press that every library makes: a rigid flat on the finger at its apex, to the same depth, without friction.

It is stated once here, in nodes and arrays, so that the libraries differ in nothing but themselves: mesh, P2 nodes,
layer-wise P1 pressure, clamped and mirror nodes, gap of the exact skin over its nodes, gauges.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from papilla.fem.discrete.assembly import lame
from papilla.fem.discrete.elements import SYMMETRIC, TaylorHood, parity_signs
from papilla.fem.discrete.locate import interpolation
from papilla.fem.reduction.finger_model import image_of
from papilla.fem.reduction.gauges import PointFunctional, curvature_functional, gauge_frame, strain_functional
from papilla.fem.reduction.patch import STEEPEST, Frame, gap_of
from papilla.finger import Finger, Layer
from papilla.mesh.layered import BONE, INNER, OUTER, LayeredMesh
from papilla.mesh.surfaces import surfaces_of
from papilla.units import to_microstrain


@dataclass(frozen=True, eq=False)
class PeerScene:
    """A rigid flat pressed `indentation` mm into `finger` at its apex.

    mesh : what is meshed: the whole finger, or the cell that `mirrors` repeat.
    mirrors : axes ("x", "y") in whose zero plane the cell ends and is held by symmetry; () for the whole finger.
    """

    finger: Finger
    mesh: LayeredMesh
    mirrors: tuple[str, ...]
    indentation: float

    @property
    def multiplicity(self) -> int:
        """How many times the mesh is repeated: forces on the finger are so many times those on the mesh."""
        return 2 ** len(self.mirrors)

    @cached_property
    def space(self) -> TaylorHood:
        """Numbering of the P2 nodes and of the layer-wise pressures."""
        return TaylorHood(self.mesh)

    @cached_property
    def nodes(self) -> np.ndarray:
        """Positions (n, 3) of the P2 nodes in mm: vertices first, in the order of the mesh."""
        return self.space.displacement.doflocs.T

    @cached_property
    def elasticity(self) -> dict[int, tuple[float, float]]:
        """Layer number of the mesh -> shear modulus (MPa) and compressibility 1/lambda (1/MPa)."""
        layers: dict[int, Layer | None] = {OUTER: self.finger.outer, INNER: self.finger.inner, BONE: self.finger.bone}
        present = np.unique(self.mesh.layer)
        return {int(k): lame(layer) for k in present if (layer := layers[int(k)]) is not None}

    @cached_property
    def held(self) -> np.ndarray:
        """Mask (n, 3) of the displacements that the clamped base and the mirror planes hold at zero."""
        free = self.space.free(SYMMETRIC, self.mirrors)
        return ~free[: 3 * self.space.nodes].reshape(-1, 3)

    @cached_property
    def frame(self) -> Frame:
        """The contact plane at first touch; the flat comes down along its normal."""
        return Frame.at(surfaces_of(self.finger)["skin"], 0.0, 0.0)

    @cached_property
    def contact_triangles(self) -> np.ndarray:
        """Triangles (k, 3) of the skin that the flat may touch: within the patch radius, facing the flat."""
        triangles = self.mesh.boundaries["skin"]
        local = self.frame.local(self.mesh.points)
        near = np.hypot(local[:, 0], local[:, 1]) < self.finger.patch_radius
        skin = surfaces_of(self.finger)["skin"]
        facing = skin.normal(self.mesh.points[triangles].mean(axis=1)) @ self.frame.axes[2] > STEEPEST
        return triangles[near[triangles].all(axis=1) & facing]

    @cached_property
    def contact_nodes(self) -> np.ndarray:
        """Numbers of the P2 nodes on the contact triangles."""
        return self.space.nodes_on(self.contact_triangles)

    @cached_property
    def contact_gaps(self) -> np.ndarray:
        """Distance (mm) of the exact skin above each contact node from the flat at first touch."""
        return gap_of(surfaces_of(self.finger)["skin"], self.frame, self.nodes[self.contact_nodes])

    @cached_property
    def first_guess(self) -> np.ndarray:
        """Displacement (n, 3) to start from: half of the indentation wherever nothing is held.

        A flat that cuts a round skin to depth d overlaps twice the area that it touches, and half of d gives that area.
        """
        guess = np.broadcast_to(-0.5 * self.indentation * self.frame.axes[2], self.nodes.shape)
        return np.where(self.held, 0.0, guess)

    def sd(self, displacement: np.ndarray) -> float:
        """Population standard deviation of the gauge readings (microstrain) of a displacement (n, 3) in mm."""
        interface = surfaces_of(self.finger)["interface"]
        frames = [gauge_frame(self.finger, gauge, interface) for gauge in self.finger.gauges]
        pairs = list(zip(self.finger.gauges, frames, strict=True))
        strain = [self._value(strain_functional(gauge, frame, interface), displacement) for gauge, frame in pairs]
        bend = [self._value(curvature_functional(gauge, frame, interface), displacement) for gauge, frame in pairs]
        readings = [
            gauge.membrane_gain * s + gauge.lever_mm * b
            for gauge, s, b in zip(self.finger.gauges, strain, bend, strict=True)
        ]
        return float(to_microstrain(np.array(readings)).std())

    def _value(self, functional: PointFunctional, displacement: np.ndarray) -> float:
        images = image_of(functional.points, self.mirrors)
        points = functional.points * np.column_stack([images, np.ones(len(images), dtype=int)])
        signs = np.stack([parity_signs(SYMMETRIC, tuple(image)) for image in images])
        found = interpolation(self.space, points) @ displacement
        return float(np.sum(functional.weights * signs * found))


@dataclass(frozen=True, eq=False)
class PeerSolution:
    """What a library's press gives: the finger's force (N) and the displacement (n, 3) of the P2 nodes in mm.

    systems : how many linear systems were factored.
    seconds : of assembly, factorisations and iterations; `seconds_assembly` of the elastic matrix alone.
    """

    force: float
    displacement: np.ndarray
    systems: int
    seconds: float
    seconds_assembly: float
