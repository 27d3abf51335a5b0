"""Contact of a deforming finger with a deforming specimen: the gap, the loads on the skin, the specimen's answer.

Contact pressure is defined as at small strain: linear on the patch's triangles, per area of the skin's reference state
projected on the contact plane. A rigid frictionless flat then loads the skin exactly along its normal.

Let X be the place of a node of the skin on the contact plane at rest, x its present place, h(X) the undeformed surface
of the specimen, and u_z, u_t the displacement of this surface, up and along the plane. The node touches the material
point X + d of the specimen, where the surface is y high:

    X + d + u_t(X + d) = x,    y = (h + u_z)(X + d),    u(X + d) = u + d . grad u =: A u.

A pressure p acts along the common normal, as minus the derivative of the gap: on the skin as p (s, -1), s = dy/dx being
the slope of the deformed surface; on the specimen as A' (-p s, p). Both are derivatives of one potential, int p y dA
less the specimen's energy, so its answer to a pressure is symmetric. Tractions q along the plane act as q on the skin
and as -A' q on the specimen, and a point that sticks keeps its d.

The specimen's compliance is that on the patch at rest, computed once: A takes it to where the skin has gone. A specimen
without compliance against tractions along its surface keeps a vertical pressure, u_t = 0 and s = dh/dx.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy.sparse as sp

from papilla.core.errors import SolverError
from papilla.fem.discrete.assembly import SPACE_AXES
from papilla.fem.reduction.compliance import PatchSurface
from papilla.fem.reduction.loaded_patch import LoadedPatch
from papilla.fem.reduction.patch import Patch, quadrature, weak_gap
from papilla.model.specimen import Specimen

STICK_FRICTION = 1e6
"""Coefficient of friction that stands for full stick."""

MOST_ROUNDS, ROUND_TOLERANCE = 30, 1e-10
"""Rounds in which the specimen's displacement and the pressure that it turns are made to agree, and the relative change
at which they do. On a slope of 0.25, that of a very soft specimen, a round leaves a third of the difference."""


@dataclass(frozen=True, eq=False)
class SkinContact:
    """Contact with the skin at one displacement; n patch nodes.

    gap : (n,) weak distance in mm3 between skin and specimen at zero indentation, less `compliance` times the contact
        pressure: a contact problem adds this product for the pressure that it looks for.
    shift : what the specimen's answer is beyond `compliance` times the tractions, in mm3: of the gap (n,), which
        contains it; with friction followed by that of the movement along the plane (3n,).
    place : (2n,) of the nodes on the specimen along the plane, weighted by the mass, mm3; empty without friction.
    coupling : (nodes, n) areas in mm2 by which a patch node's traction loads the nodes of the cell.
    directions : (k, n, 3) in which a unit pressure acts on the skin; with friction followed by the plane's axes.
    """

    gap: np.ndarray
    shift: np.ndarray
    place: np.ndarray
    coupling: sp.csr_matrix
    directions: np.ndarray

    def forces(self, contact: np.ndarray) -> np.ndarray:
        """Forces (nodes, 3) in N on the skin under contact pressures and tractions (k n,) in MPa."""
        tractions = contact.reshape(len(self.directions), -1)
        return self.coupling @ np.einsum("kn,kni->ni", tractions, self.directions)

    @property
    def loads(self) -> sp.csr_matrix:
        """(3 * nodes, k n) forces on the skin in mm2 of unit pressures and tractions at each node."""
        coupling = self.coupling
        order = np.arange(SPACE_AXES * coupling.shape[0]).reshape(SPACE_AXES, -1).T.ravel()
        parts = [
            sp.vstack([coupling @ sp.diags(component) for component in direction.T]) for direction in self.directions
        ]
        return sp.hstack(parts).tocsr()[order]


@dataclass(eq=False)
class Touching:
    """Contact of a specimen with the patch of a cell that is not split into parities; n patch nodes.

    friction : Coulomb's coefficient; at `STICK_FRICTION` and above nothing slips."""

    loaded: LoadedPatch
    specimen: Specimen
    friction: float = 0.0

    @property
    def patch(self) -> Patch:
        """The patch in the reference state."""
        return self.loaded.patch

    @cached_property
    def compliance(self) -> np.ndarray:
        """Weak compliance of the specimen on the patch at rest, mm3 / MPa: (n, n), with friction (3n, 3n)."""
        size = len(self.patch.xy) * (SPACE_AXES if self.friction else 1)
        return self._answers[:size, :size]

    @property
    def turns(self) -> bool:
        """Whether the specimen's own deformation turns the pressure."""
        return bool(self.friction) or self.specimen.has_traction_compliance

    @cached_property
    def _answers(self) -> np.ndarray:
        """The compliance against all tractions (3n, 3n); (n, n) for a specimen that has one against pressure alone."""
        unit, surface = self.specimen.unit, PatchSurface(self.patch)
        compliance = unit.traction_compliance(surface) if self.turns else unit.compliance(surface)
        return compliance * (unit.modulus / self.specimen.modulus)

    @property
    def fixed(self) -> np.ndarray | None:
        """(2, n) tangential tractions that mirrors keep zero; None without friction."""
        return self._on_mirrors if self.friction else None

    @cached_property
    def _on_mirrors(self) -> np.ndarray:
        """(2, n) nodes on a mirror plane, by the axis across it."""
        return ((self.patch.xy == 0) & np.any(self.patch.images < 0, axis=0)).T

    def current_patch(self, displacement: np.ndarray) -> Patch:
        """The patch at the skin's place after a displacement (nodes, 3); its gap is that of the reference state.

        Nodes move by the mean displacement under their hat functions, on which their pressure does work; on a mirror
        plane the mean over all images has no component across it.
        """
        moved = replace(self.patch, xy=self.patch.xy + self._along(displacement))
        _, weights, hats = quadrature(moved)
        return replace(moved, mass=hats.T @ weights)

    def _along(self, displacement: np.ndarray) -> np.ndarray:
        """(n, 2) movement of the patch's nodes along the contact plane, in mm."""
        mean = self._coupling.T @ (displacement @ self.loaded.frame.axes[:2].T) / self.patch.mass[:, None]
        mean[self._on_mirrors.T] = 0
        return mean

    def at(self, displacement: np.ndarray, contact: np.ndarray) -> SkinContact:
        """Contact with the skin after a displacement (nodes, 3) in mm, under a contact pressure (n,), with friction
        followed by the tangential tractions (3n,), in MPa."""
        patch, frame, coupling = self.patch, self.loaded.frame, self._coupling
        moved, n = self._along(displacement), len(patch.mass)
        answer, slope = self._answer(moved, contact)
        shift = answer - self.compliance @ contact
        place = (patch.mass * moved.T).ravel()[: len(answer) - n] + answer[n:]
        gap = weak_gap(patch, self.specimen) + shift[:n] - coupling.T @ (displacement @ frame.axes[2])
        directions = [slope @ frame.axes[:2] - frame.axes[2]]
        if self.friction:
            directions += [np.broadcast_to(axis, directions[0].shape) for axis in frame.axes[:2]]
        return SkinContact(gap, shift, place, coupling, np.array(directions))

    def _answer(self, moved: np.ndarray, contact: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The specimen's surface under a contact, where the skin has moved along the plane by `moved` (n, 2), in mm.

        Returns its weak height over that at rest, with friction followed by minus its weak movement along the plane, in
        mm3, as `compliance` times the tractions; and its slope (n, 2).
        """
        patch, specimen, n = self.patch, self.specimen, len(moved)
        mass, rest = patch.mass, patch.xy
        tractions = np.zeros((len(self._answers) // n, n))
        tractions.ravel()[: len(contact)] = contact
        free = np.concatenate([np.ones((1, n)), ~self._on_mirrors])[: len(tractions)]
        away, slope, answer = moved, specimen.slope(rest + moved), np.zeros_like(tractions)
        uphill, downhill = self._gradient
        for _ in range(MOST_ROUNDS):
            turned = tractions.copy()
            turned[1:] += (tractions[0] * slope.T)[: len(tractions) - 1]
            carried_loads = (mass * away.T)[:, None] * turned
            back = (downhill @ carried_loads.swapaxes(1, 2).reshape(2 * n, -1)).T
            before, answer = answer, self._answers @ (free * (turned + back / mass)).ravel()
            answer = free * answer.reshape(-1, n) / mass
            steepness = (uphill @ answer.T).reshape(2, n, -1).swapaxes(1, 2)
            if len(answer) > 1:
                # Tractions are those on the skin, so along the plane the specimen moves the other way
                stretch = np.eye(2) - steepness[:, 1:].T
                away = np.linalg.solve(stretch, (moved + answer[1:].T)[..., None])[..., 0]
                rise = specimen.slope(rest + away) + steepness[:, 0].T
                slope = np.linalg.solve(stretch.swapaxes(1, 2), rise[..., None])[..., 0]
            if np.abs(answer - before).max() <= ROUND_TOLERANCE * np.abs(answer).max():
                break
        else:
            raise SolverError("the specimen's surface and the pressure that it turns find no common state")
        carried = answer + sum(away_k * steep for away_k, steep in zip(away.T, steepness, strict=True))
        carried[0] += specimen.gap(rest + away) - specimen.gap(rest)
        return (mass * carried).ravel()[: len(contact)], slope

    @cached_property
    def _gradient(self) -> tuple[sp.csr_matrix, sp.csr_matrix]:
        """(2n, n) gradient of nodal values on the patch, x before y, and its transpose."""
        both = sp.vstack(self.patch.gradient).tocsr()
        return both, both.T.tocsr()

    @property
    def _coupling(self) -> sp.csr_matrix:
        return self.loaded.couplings[(1, 1)]
