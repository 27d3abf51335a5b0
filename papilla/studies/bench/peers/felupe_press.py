"""The press by FElupe and PyPardiso: mixed P2/P1 fields, node-to-surface contact by penalty, Newton's method.

The elastic matrix is constant and assembled once; contact is FElupe's own penalty item, whose kinematics a subclass
extends, as its documentation says, by the height of the exact skin over the nodes of its facets.
"""

from time import perf_counter

import felupe
import numpy as np
import scipy.sparse as sp

from papilla.errors import SolverError
from papilla.studies.bench.peers.pardiso import SymmetricPardiso
from papilla.studies.bench.peers.scene import PeerScene, PeerSolution

NEWTON_STEPS = 40


class _FlatOverSkin(felupe.ContactRigidPlane):
    """A rigid flat whose gap is that of the exact skin, `lift` (k,) mm above each contact node."""

    def __init__(self, lift: np.ndarray, *arguments, **options):
        self.lift = lift
        super().__init__(*arguments, **options)

    def _kinematics(self, dx):
        gap, normal, curvature = super()._kinematics(dx)
        return gap - self.lift, normal, curvature


class FelupePress:
    """FElupe's mesh and fields of a scene; each `press` assembles, factors and iterates anew."""

    def __init__(self, scene: PeerScene, threads: int):
        self.scene = scene
        self.threads = threads
        space = scene.space
        flat = scene.frame.origin - scene.indentation * scene.frame.axes[2]
        cells = space.displacement.element_dofs.T
        self.region = felupe.RegionQuadraticTetra(felupe.Mesh(np.vstack([scene.nodes, flat]), cells, "tetra10"))
        positions = np.zeros((space.pressures, 3))
        positions[space.pressure_dofs] = scene.mesh.points[scene.mesh.tets]
        self.layered = felupe.Mesh(positions, space.pressure_dofs, "tetra")
        held = np.append(scene.held.ravel(), [True, True, True])
        self.fixed = np.flatnonzero(held)
        self.free = np.append(np.flatnonzero(~held), len(held) + np.arange(space.pressures))
        facets = -scene.frame.local(scene.nodes[scene.contact_nodes])[:, 2]
        self.lift = facets - scene.contact_gaps

    @property
    def unknowns(self) -> int:
        """Number of free unknowns."""
        return len(self.free)

    def press(self, penalty: float) -> PeerSolution:
        """One press with a contact stiffness of `penalty` times the outer layer's modulus times the element size (N/mm)
        at each node.

        Raises `SolverError` where Newton's method does not settle.
        """
        scene = self.scene
        began = perf_counter()
        pressure = felupe.FieldDual(self.region, mesh=self.layered)
        field = felupe.FieldContainer([felupe.Field(self.region, dim=3), pressure])
        elastic = self._elastic(field)
        seconds_assembly = perf_counter() - began
        contact = _FlatOverSkin(
            self.lift,
            field,
            scene.contact_nodes,
            -1,
            -scene.frame.axes[2],
            multiplier=penalty * scene.model.finger.outer.modulus * scene.mesh.size_mm,
        )
        size = 3 * (scene.space.nodes + 1)
        solver = SymmetricPardiso(elastic, self.free, self.threads)

        def residual(x):
            field[0].values[:] = x[:size].reshape(-1, 3)
            forces = elastic @ x
            forces[:size] += contact.assemble.vector(field).toarray()[:, 0]
            return forces

        def linear_solve(stiffness, rhs):
            return solver.solve(stiffness, rhs)

        try:
            found = felupe.newtonraphson(
                x0=np.concatenate([scene.first_guess.ravel(), np.zeros(3 + scene.space.pressures)]),
                fun=residual,
                jac=lambda x: contact.assemble.matrix(field).tocoo(),
                solve=linear_solve,
                dof0=self.fixed,
                dof1=self.free,
                maxiter=NEWTON_STEPS,
                verbose=0,
            )
        except felupe.tools.NewtonConvergenceError as error:
            raise SolverError(f"FElupe: contact did not settle in {NEWTON_STEPS} Newton steps") from error
        finally:
            solver.close()
        seconds = perf_counter() - began
        flat = found.fun[size - 3 : size]
        displacement = found.x[: size - 3].reshape(-1, 3)
        return PeerSolution(
            force=float(scene.multiplicity * abs(flat @ scene.frame.axes[2])),
            displacement=displacement,
            systems=len(found.fnorms),
            seconds=seconds,
            seconds_assembly=seconds_assembly,
        )

    def _elastic(self, field: felupe.FieldContainer) -> sp.csr_matrix:
        """The saddle-point matrix of 2 mu eps(u) : eps(v) - p div v - q div u - p q / lambda, both triangles."""
        mu, compressibility = (np.zeros((1, len(self.scene.mesh.tets))) for _ in range(2))
        for number, values in self.scene.elasticity.items():
            mu[0, self.scene.mesh.layer == number], compressibility[0, self.scene.mesh.layer == number] = values
        identity = np.eye(3)[:, :, None, None]
        blocks = [2 * mu * felupe.math.cdya(identity, identity), -identity, -compressibility[None]]
        form = felupe.IntegralForm(blocks, v=field, dV=self.region.dV, u=field)
        return form.assemble(parallel=self.threads > 1).tocsr()
