"""The press by NGSolve: Taylor-Hood with a pressure for each layer, a penalty on the skin, Newton's method.

The elastic form is constant and assembled once; only the boundary integral of the contact is linearised anew. Systems
are solved by NGSolve's own sparse Cholesky (an LDL^T that the layers' compressibility makes possible), or handed to
Pardiso.
"""

from time import perf_counter

import netgen.meshing
import ngsolve as ng
import numpy as np
import scipy.sparse as sp

from papilla.errors import SolverError
from papilla.studies.bench.peers.pardiso import SymmetricPardiso, stored_at
from papilla.studies.bench.peers.scene import PeerScene, PeerSolution

NEWTON_STEPS = 40

RESIDUAL = 1e-9
"""Norm of the unbalanced forces, as a share of that of the contact forces, at which Newton's method has settled."""

QUADRATURE = {ng.TET: ng.IntegrationRule(ng.TET, 2)}
"""The rule that papilla's assembly uses, exact for this form; NGSolve's default is for a higher order."""

CONTACT_QUADRATURE = {ng.TRIG: ng.IntegrationRule(ng.TRIG, 2)}
"""Three points a triangle, about as many as the displacement has unknowns there: more over-constrain the skin."""


class NgsolvePress:
    """NGSolve's mesh and spaces of a scene; each `press` assembles, factors and iterates anew."""

    def __init__(self, scene: PeerScene, threads: int, solver: str):
        """`solver` is "sparsecholesky" (NGSolve's own) or "pardiso"."""
        self.scene = scene
        self.threads = threads
        self.solver = solver
        self.mesh = mesh_of(scene)
        self.space = taylor_hood(self.mesh)
        self.numbering = _Numbering(self.mesh, scene)
        held = np.zeros(self.space.ndof, dtype=bool)
        held[: scene.held.size] = self.numbering.to_ngsolve(scene.held).T.ravel()
        self.free = ng.BitArray(list(map(bool, ~held)))
        gaps = np.zeros(scene.space.nodes)
        gaps[scene.contact_nodes] = scene.contact_gaps
        self.gap = ng.GridFunction(ng.H1(self.mesh, order=2))
        self.gap.vec.FV().NumPy()[:] = self.numbering.coefficients(gaps)

    @property
    def unknowns(self) -> int:
        """Number of free unknowns."""
        return self.free.NumSet()

    def press(self, penalty: float) -> PeerSolution:
        """One press with a contact stiffness of `penalty` times the outer layer's modulus over the element size
        (N/mm3).

        Raises `SolverError` where Newton's method does not settle.
        """
        ng.SetNumThreads(self.threads)
        with ng.TaskManager():
            began = perf_counter()
            elastic = elastic_form(self.space, self.scene.elasticity)
            elastic.Assemble()
            seconds_assembly = perf_counter() - began
            contact = self._contact_form(penalty * self.scene.model.finger.outer.modulus / self.scene.mesh.size_mm)
            solution = ng.GridFunction(self.space)
            solution.vec.FV().NumPy()[:] = self._start()
            systems, forces = self._iterate(elastic, contact, solution)
            seconds = perf_counter() - began
        # Edge functions vanish at the vertices: a rigid translation is one of the vertex functions alone
        on_vertices = self._components(forces)[: len(self.scene.mesh.points)]
        return PeerSolution(
            force=float(self.scene.multiplicity * on_vertices.sum(axis=0) @ self.scene.frame.axes[2]),
            displacement=self.numbering.values(self._components(solution.vec.FV().NumPy())),
            systems=systems,
            seconds=seconds,
            seconds_assembly=seconds_assembly,
        )

    def _iterate(self, elastic, contact, solution) -> tuple[int, np.ndarray]:
        """Newton's method in place; how many systems it took, and the contact forces (unknowns,)."""
        residual, forces = (solution.vec.CreateVector() for _ in range(2))
        projector = ng.Projector(self.free, True)
        solve = (_Pardiso if self.solver == "pardiso" else _OwnSolver)(elastic, self.free, self.threads)
        try:
            for systems in range(NEWTON_STEPS + 1):
                contact.Apply(solution.vec, forces)
                residual.data = elastic.mat * solution.vec + forces
                residual.data = projector * residual
                if residual.Norm() <= RESIDUAL * forces.Norm():
                    return systems, forces.FV().NumPy().copy()
                contact.AssembleLinearization(solution.vec)
                solution.vec.data -= solve(contact, residual)
        finally:
            solve.close()
        raise SolverError(f"NGSolve: contact did not settle in {NEWTON_STEPS} Newton steps")

    def _contact_form(self, stiffness: float) -> ng.BilinearForm:
        """Energy stiffness/2 times the square of the depth to which the skin cuts the flat."""
        normal = self.scene.frame.axes[2]
        displacement = self.space.TrialFunction()[0]
        outward = ng.CoefficientFunction(tuple(map(float, normal)))
        depth = self.scene.indentation - self.gap + displacement * outward
        form = ng.BilinearForm(self.space, symmetric=True, symmetric_storage=True)
        form += ng.Variation(
            ng.IfPos(depth, stiffness / 2 * depth**2, 0).Compile() * ng.ds("contact", intrules=CONTACT_QUADRATURE)
        )
        return form

    def _start(self) -> np.ndarray:
        start = np.zeros(self.space.ndof)
        guess = self.numbering.coefficients(self.scene.first_guess)
        start[: guess.size] = guess.T.ravel()
        return start

    def _components(self, unknowns: np.ndarray) -> np.ndarray:
        """Displacement coefficients (n, 3) of all unknowns."""
        return unknowns[: 3 * self.scene.space.nodes].reshape(3, -1).T


def mesh_of(scene: PeerScene) -> ng.Mesh:
    """The scene's mesh in NGSolve: the layers as materials, the skin that may touch as boundary "contact"."""
    mesh = netgen.meshing.Mesh(dim=3)
    mesh.AddPoints(np.ascontiguousarray(scene.mesh.points))
    mesh.Add(netgen.meshing.FaceDescriptor(surfnr=1, domin=1, domout=0, bc=1))
    mesh.AddElements(dim=2, index=1, data=scene.contact_triangles.astype(np.int32), base=0)
    mesh.SetBCName(0, "contact")
    for index, number in enumerate(scene.elasticity, start=1):
        cells = scene.mesh.tets[scene.mesh.layer == number]
        mesh.AddElements(dim=3, index=index, data=cells.astype(np.int32), base=0)
        mesh.SetMaterial(index, _material(number))
    return ng.Mesh(mesh)


def taylor_hood(mesh: ng.Mesh) -> ng.FESpace:
    """P2 displacement and a continuous P1 pressure in each material of the mesh."""
    pressures = []
    for material in mesh.GetMaterials():
        space = ng.H1(mesh, order=1, definedon=material)
        # Its own choice of unknowns keeps those of boundary triangles that the material does not have
        pressures.append(ng.Compress(space, active_dofs=space.GetDofs(mesh.Materials(material))))
    return ng.FESpace([ng.VectorH1(mesh, order=2), *pressures])


def elastic_form(space: ng.FESpace, elasticity: dict[int, tuple[float, float]]) -> ng.BilinearForm:
    """2 mu eps(u) : eps(v) - p div v - q div u - p q / lambda for layers numbered as in `PeerScene.elasticity`."""
    (u, *trial), (v, *test) = space.TnT()
    form = ng.BilinearForm(space, symmetric=True, symmetric_storage=True)
    for (number, (mu, compressibility)), p, q in zip(elasticity.items(), trial, test, strict=True):
        shear = 2 * mu * ng.InnerProduct(ng.Sym(ng.Grad(u)), ng.Sym(ng.Grad(v)))
        integrand = shear - p * ng.div(v) - q * ng.div(u) - compressibility * p * q
        form += integrand.Compile() * ng.dx(_material(number), intrules=QUADRATURE)
    return form


def _material(number: int) -> str:
    return f"layer{number}"


class _Numbering:
    """Between papilla's P2 nodes, vertices then edges, and NGSolve's hierarchical functions: vertices, then its edges.

    NGSolve's edge function is not one at the middle of its edge, and adds to what the vertices make there.
    """

    def __init__(self, mesh: ng.Mesh, scene: PeerScene):
        self._vertices = len(scene.mesh.points)
        ours = np.sort(scene.space.skmesh.edges.T, axis=1) @ [self._vertices, 1]
        self._ends = np.sort([[vertex.nr for vertex in edge.vertices] for edge in mesh.edges], axis=1)
        order = np.argsort(ours)
        theirs = self._ends @ [self._vertices, 1]
        edges = order[np.searchsorted(ours[order], theirs)]
        self._nodes = np.append(np.arange(self._vertices), self._vertices + edges)
        self._height = _edge_height(mesh, scene.mesh.points[self._ends[0]].mean(axis=0))

    def to_ngsolve(self, values: np.ndarray) -> np.ndarray:
        """Nodal values (n, ...) in NGSolve's order."""
        return values[self._nodes]

    def coefficients(self, values: np.ndarray) -> np.ndarray:
        """Coefficients (n, ...) in NGSolve's basis of a field with nodal values (n, ...)."""
        found = self.to_ngsolve(values).copy()
        found[self._vertices :] = (found[self._vertices :] - self._between(found)) / self._height
        return found

    def values(self, coefficients: np.ndarray) -> np.ndarray:
        """Nodal values (n, ...) of a field with coefficients (n, ...) in NGSolve's basis."""
        values = coefficients.copy()
        values[self._vertices :] = self._height * values[self._vertices :] + self._between(values)
        ordered = np.empty_like(values)
        ordered[self._nodes] = values
        return ordered

    def _between(self, values: np.ndarray) -> np.ndarray:
        """What the vertices make of a field in the middle of each edge."""
        return values[self._ends].mean(axis=1)


def _edge_height(mesh: ng.Mesh, middle: np.ndarray) -> float:
    """Value of the first edge's function at its `middle`."""
    probe = ng.GridFunction(ng.H1(mesh, order=2))
    probe.vec[mesh.nv] = 1.0
    return float(probe(mesh(*middle)))


class _OwnSolver:
    """NGSolve's sparse Cholesky of elastic matrix plus contact; the order of elimination is found once."""

    def __init__(self, elastic: ng.BilinearForm, free: ng.BitArray, threads: int):
        self._elastic = elastic.mat
        self._matrix = elastic.mat.CreateMatrix()
        self._free = free
        self._inverse = None

    def __call__(self, contact: ng.BilinearForm, residual):
        self._matrix.AsVector().data = self._elastic.AsVector()
        values, columns, starts = (np.asarray(part) for part in self._matrix.CSR())
        rows, others, added = (np.asarray(part) for part in contact.mat.COO())
        np.add.at(values, stored_at(starts.astype(np.int64), columns, rows, others), added)
        if self._inverse is None:
            self._inverse = self._matrix.Inverse(self._free, inverse="sparsecholesky")
        else:
            self._inverse.Update()
        return (self._inverse * residual).Evaluate()

    def close(self) -> None:
        """Nothing is held outside of Python."""


class _Pardiso:
    """The same systems through `SymmetricPardiso`, which wants upper triangles: NGSolve's lower ones, transposed."""

    def __init__(self, elastic: ng.BilinearForm, free: ng.BitArray, threads: int):
        base = sp.csc_matrix(tuple(np.asarray(part) for part in elastic.mat.CSR()))
        self._solver = SymmetricPardiso(base, np.flatnonzero(np.array(free)), threads)

    def __call__(self, contact: ng.BilinearForm, residual):
        rows, columns, values = (np.asarray(part) for part in contact.mat.COO())
        size = len(residual)
        added = sp.coo_matrix((values, (columns, rows)), shape=(size, size))
        step = residual.CreateVector()
        step.FV().NumPy()[:] = self._solver.solve(added, residual.FV().NumPy())
        return step

    def close(self) -> None:
        """Release Pardiso's memory."""
        self._solver.close()
