"""Contact of a deforming finger with a specimen: gap, loads and specimen compliance at the current lateral positions.

Contact pressure is defined as at small strain: linear on the patch's triangles, per area of the skin's reference state
projected on the contact plane. A rigid frictionless flat then loads the skin exactly along its normal, and the weak gap
is linear in the displacement. The gap of a curved specimen, and the normal along which its pressure acts, are those at
the skin's current place. The specimen itself stays linear: its own deformation does not turn the pressure.
"""

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from papilla.fem.discrete.assembly import SPACE_AXES
from papilla.fem.reduction.compliance import PatchSurface
from papilla.fem.reduction.loaded_patch import LoadedPatch
from papilla.fem.reduction.patch import Patch, quadrature, weak_gap
from papilla.model.specimen import Specimen

STICK_FRICTION = 1e6
"""Coefficient of friction that stands for full stick."""

RENEWAL_DISTANCE_EDGES = 0.02
"""Distance, in patch edges, that the skin may move along the specimen before the compliance for friction is computed
again. It is expensive, and each of the many small steps of a path would compute it. S_d changes by less than 1e-4."""

RENEWAL_PER_RESIDUAL = 30.0
"""Further displacement of the skin along the specimen, relative to its displacement so far and per relative residual,
after which the specimen's compliance is computed again: the remaining displacement is about the residual's share, and
the compliance is expensive."""


@dataclass(frozen=True, eq=False)
class SkinContact:
    """Contact with the skin at one displacement; n patch nodes.

    gap : (n,) weak distance in mm3 between skin and undeformed specimen at zero indentation.
    loads : (3 * nodes, n) forces on the skin in mm2 of unit nodal pressures, which are the derivatives of the gap.
    compliance : (n, n) weak compliance of the specimen, mm3 / MPa. With friction both are three times as large:
    tractions along the contact plane's axes follow the pressures.
    """

    gap: np.ndarray
    loads: sp.csr_matrix
    compliance: np.ndarray


@dataclass(eq=False)
class Touching:
    """Contact of a specimen with the patch of a cell that is not split into parities; n patch nodes.

    The specimen's compliance is that at the places of the last `follow`. friction : Coulomb's coefficient; at
    `STICK_FRICTION` and above nothing slips."""

    loaded: LoadedPatch
    specimen: Specimen
    friction: float = 0.0

    def __post_init__(self):
        self._place, self._compliance = self.patch.xy, self._compliance_at(self.patch)

    @property
    def fixed(self) -> np.ndarray | None:
        """(2, n) tangential tractions that mirrors keep zero; None without friction."""
        mirrored = np.any(self.patch.images < 0, axis=0)
        return (self.patch.xy == 0).T & mirrored[:, None] if self.friction else None

    @property
    def patch(self) -> Patch:
        """The patch in the reference state."""
        return self.loaded.patch

    def current_patch(self, displacement: np.ndarray) -> Patch:
        """The patch at the skin's place after a displacement (nodes, 3); its gap is that of the reference state.

        Nodes move by the mean displacement under their hat functions, on which their pressure does work; on a mirror
        plane the mean over all images has no component across it.
        """
        patch = self.patch
        mean = self._coupling.T @ (displacement @ self.loaded.frame.axes[:2].T) / patch.mass[:, None]
        mean[(patch.xy == 0) & (patch.images < 0).any(axis=0)] = 0
        moved = replace(patch, xy=patch.xy + mean)
        _, weights, hats = quadrature(moved)
        return replace(moved, mass=hats.T @ weights)

    def follow(self, displacement: np.ndarray, residual: float = 0.0) -> bool:
        """Compute the specimen's compliance again if the skin has moved along it further than a relative residual
        allows."""
        current = self.current_patch(displacement)
        moved, far = (np.abs(current.xy - place).max() for place in (self._place, self.patch.xy))
        steady = RENEWAL_DISTANCE_EDGES * float(self.patch.edge_length.mean()) if self.friction else 0.0
        if moved <= max(RENEWAL_PER_RESIDUAL * residual * far, steady):
            return False
        self._place, self._compliance = current.xy, self._compliance_at(current)
        return True

    def at(self, displacement: np.ndarray) -> SkinContact:
        """Contact with the skin at its place after a displacement (nodes, 3) in mm."""
        patch, frame, coupling = self.patch, self.loaded.frame, self._coupling
        current = self.current_patch(displacement)
        # Where the skin has moved sideways, a curved specimen leaves another gap; for a flat one the difference is 0.
        lateral = self.specimen.gap(current.xy) - self.specimen.gap(patch.xy)
        gap = weak_gap(patch, self.specimen) + patch.mass * lateral - coupling.T @ (displacement @ frame.axes[2])
        # Pressure acts along the specimen's normal at the skin's place, friction along the axes of the contact plane.
        directions = [self.specimen.slope(current.xy) @ frame.axes[:2] - frame.axes[2]]
        if self.friction:
            directions += [np.broadcast_to(axis, directions[0].shape) for axis in frame.axes[:2]]
        order = np.arange(SPACE_AXES * coupling.shape[0]).reshape(SPACE_AXES, -1).T.ravel()
        parts = [sp.vstack([coupling @ sp.diags(component) for component in direction.T]) for direction in directions]
        loads = sp.hstack(parts).tocsr()[order]
        return SkinContact(gap, loads, self._compliance)

    @property
    def _coupling(self) -> sp.csr_matrix:
        return self.loaded.couplings[(1, 1)]

    def _compliance_at(self, current: Patch) -> np.ndarray:
        """The specimen's compliance. Nodal pressures are spread over the current area, so both sides are scaled by the
        ratio of reference to current mass."""
        spread, surface = self.patch.mass / current.mass, PatchSurface(current)
        if self.friction:
            spread = np.tile(spread, SPACE_AXES)
            return self.specimen.traction_compliance(surface) * np.outer(spread, spread)
        return self.specimen.compliance(surface) * np.outer(spread, spread)
