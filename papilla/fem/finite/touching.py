"""The specimen as a deforming finger meets it: gap, loads and specimen compliance at the current lateral positions.

Contact pressure is that of the linear rungs: linear on the patch's triangles and measured per area that the skin's
reference state projects on the contact plane. A rigid frictionless flat then loads the skin exactly along its normal,
and the weak gap is linear in the displacement. The gap of a curved specimen is taken, and its pressure acts along its
normal, where the skin is now. The specimen itself stays linear: its surface slope turns no pressure.
"""

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from papilla.fem.reduction.compliance import PatchSurface, half_space_compliance, quadrature, weak_gap
from papilla.fem.reduction.patch import LoadedPatch, Patch
from papilla.specimen import Specimen


@dataclass(frozen=True, eq=False)
class Touch:
    """Contact with the skin at one displacement; n patch nodes.

    gap : (n,) weak distance in mm3 between skin and undeformed specimen at zero indentation.
    loads : (3 * nodes, n) forces on the skin in mm2 of unit nodal pressures, which are the derivatives of the gap.
    compliance : (n, n) weak compliance of the specimen, mm3 / MPa.
    """

    gap: np.ndarray
    loads: sp.csr_matrix
    compliance: np.ndarray


@dataclass(frozen=True, eq=False)
class Touching:
    """Contact of a specimen with the patch of a cell that is not split into parities; n patch nodes."""

    loaded: LoadedPatch
    specimen: Specimen

    @property
    def patch(self) -> Patch:
        """The patch in the reference state."""
        return self.loaded.patch

    def current_patch(self, displacement: np.ndarray) -> Patch:
        """The patch where the skin is after a displacement (nodes, 3); its gap is that of the reference state.

        Nodes move by the mean displacement under their hat functions, which is what their pressure works on; on a
        mirror plane the mean over all images has no component across it.
        """
        patch = self.patch
        mean = self._coupling.T @ (displacement @ self.loaded.frame.axes[:2].T) / patch.mass[:, None]
        mean[(patch.xy == 0) & (patch.images < 0).any(axis=0)] = 0
        moved = replace(patch, xy=patch.xy + mean)
        _, weights, hats = quadrature(moved)
        return replace(moved, mass=hats.T @ weights)

    def at(self, displacement: np.ndarray) -> Touch:
        """Contact with the skin where it is after a displacement (nodes, 3) in mm."""
        patch, current, frame, coupling = (
            self.patch,
            self.current_patch(displacement),
            self.loaded.frame,
            self._coupling,
        )
        lateral = self.specimen.gap(current.xy) - self.specimen.gap(patch.xy)
        gap = weak_gap(patch, self.specimen) + patch.mass * lateral - coupling.T @ (displacement @ frame.axes[2])
        direction = self.specimen.slope(current.xy) @ frame.axes[:2] - frame.axes[2]
        order = np.arange(3 * coupling.shape[0]).reshape(3, -1).T.ravel()
        loads = sp.vstack([coupling @ sp.diags(component) for component in direction.T]).tocsr()[order]
        return Touch(gap, loads, self._compliance(current))

    @property
    def _coupling(self) -> sp.csr_matrix:
        return self.loaded.couplings[(1, 1)]

    def _compliance(self, current: Patch) -> np.ndarray:
        """The specimen's compliance: nodal pressures are spread over the current area, so both sides are scaled by
        reference over current mass."""
        surface = PatchSurface(current, half_space_compliance(current))
        spread = self.patch.mass / current.mass
        return self.specimen.compliance(surface) * np.outer(spread, spread)
