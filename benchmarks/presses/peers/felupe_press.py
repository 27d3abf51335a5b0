"""The press by FElupe and PyPardiso: mixed P2/P1 fields, node-to-surface contact by penalty.

Contact is FElupe's own penalty item; a subclass adds the height of the exact skin above the nodes of its facets to its
kinematics, as the documentation of FElupe describes.
"""

import felupe
import numpy as np

from benchmarks.presses.peers.library import Elastic, Forces, PeerLibrary, PeerScene, SymmetricPardiso, engine


class _FlatOverSkin(felupe.ContactRigidPlane):
    """A rigid flat whose gap is that of the exact skin, `lift` (k,) mm above each contact node."""

    def __init__(self, lift: np.ndarray, *arguments, **options):
        self.lift = lift
        super().__init__(*arguments, **options)

    def _kinematics(self, dx):
        gap, normal, curvature = super()._kinematics(dx)
        return gap - self.lift, normal, curvature


class FelupePress(PeerLibrary):
    """FElupe's mesh and fields of a scene; unknowns are displacements of the nodes, of the flat, and pressures."""

    def __init__(self, scene: PeerScene, threads: int):
        engine()
        self.scene, self.threads, space = scene, threads, scene.space
        flat = scene.frame.origin - scene.indentation * scene.frame.axes[2]
        cells = space.displacement.element_dofs.T
        region = felupe.RegionQuadraticTetra(felupe.Mesh(np.vstack([scene.nodes, flat]), cells, "tetra10"))
        positions = np.zeros((space.pressures, 3))
        positions[space.pressure_dofs] = scene.mesh.points[scene.mesh.tets]
        pressure = felupe.FieldDual(region, mesh=felupe.Mesh(positions, space.pressure_dofs, "tetra"))
        self.field = felupe.FieldContainer([felupe.Field(region, dim=3), pressure])
        self.size, freed = 3 * (space.nodes + 1), np.ones(space.pressures, dtype=bool)
        self.free = np.concatenate([~scene.held.ravel(), [False] * 3, freed])
        self.start = np.concatenate([scene.first_guess.ravel(), np.zeros(3 + space.pressures)])
        self.lift = -scene.frame.local(scene.nodes[scene.contact_nodes])[:, 2] - scene.contact_gaps

    def assemble(self) -> Elastic:
        """2 mu eps(u) : eps(v) - p div v - q div u - p q / lambda, both triangles."""
        mu, compressibility = (np.zeros((1, len(self.scene.mesh.tets))) for _ in range(2))
        for number, values in self.scene.elasticity.items():
            mu[0, self.scene.mesh.layer == number], compressibility[0, self.scene.mesh.layer == number] = values
        identity, field = np.eye(3)[:, :, None, None], self.field
        blocks = [2 * mu * felupe.math.cdya(identity, identity), -identity, -compressibility[None]]
        form = felupe.IntegralForm(blocks, v=field, dV=field.region.dV, u=field)
        matrix = form.assemble(parallel=self.threads > 1).tocsr()
        solver = SymmetricPardiso(matrix, np.flatnonzero(self.free), self.threads)
        return Elastic(matrix.__matmul__, solver.solve, solver.close)

    def contact(self, penalty: float) -> Forces:
        """`penalty` times modulus times element size (N/mm) at each node."""
        scene, field = self.scene, self.field
        stiffness = penalty * scene.model.finger.outer.modulus * scene.mesh.size_mm
        normal = -scene.frame.axes[2]
        item = _FlatOverSkin(self.lift, field, scene.contact_nodes, -1, normal, multiplier=stiffness)

        def forces(x):
            field[0].values[:] = x[: self.size].reshape(-1, 3)
            found = np.zeros(len(x))
            found[: self.size] = item.assemble.vector(field).toarray()[:, 0]
            return found, lambda: item.assemble.matrix(field).tocoo()

        return forces

    def told(self, unknowns, forces):
        """The force is that on the flat."""
        flat = forces[self.size - 3 : self.size]
        return float(abs(flat @ self.scene.frame.axes[2])), unknowns[: self.size - 3].reshape(-1, 3)
