"""The press by NGSolve: Taylor-Hood with a pressure for each layer, a penalty integrated over the skin.

Systems are solved by Pardiso: NGSolve's own sparse Cholesky took 1.5 times as long on the quarter, 3 times on the
whole finger (elements of 1.4 mm, one thread).
"""

import netgen.meshing
import ngsolve as ng
import numpy as np
import scipy.sparse as sp

from benchmarks.presses.peers.library import Elastic, Forces, PeerLibrary, PeerScene, SymmetricPardiso, engine

QUADRATURE = {ng.TET: ng.IntegrationRule(ng.TET, 2)}
"""Quadrature order of papilla's assembly, exact for this form; NGSolve's default is higher."""

CONTACT_QUADRATURE = {ng.TRIG: ng.IntegrationRule(ng.TRIG, 2)}
"""Quadrature points per triangle, about as many as displacement unknowns there: more would over-constrain the skin."""


class NgsolvePress(PeerLibrary):
    """NGSolve's mesh and spaces of a scene."""

    def __init__(self, scene: PeerScene, threads: int):
        engine()
        self.scene, self.threads = scene, threads
        mesh = mesh_of(scene)
        self.space, self.numbering = taylor_hood(mesh), Numbering(mesh, scene)
        held, self.start = np.zeros(self.space.ndof, dtype=bool), np.zeros(self.space.ndof)
        held[: scene.held.size] = self.numbering.to_ngsolve(scene.held).T.ravel()
        self.free = ~held
        self.start[: scene.held.size] = self.numbering.coefficients(scene.first_guess).T.ravel()
        gaps = np.zeros(scene.space.nodes)
        gaps[scene.contact_nodes] = scene.contact_gaps
        self.gap = ng.GridFunction(ng.H1(mesh, order=2))
        self.gap.vec.FV().NumPy()[:] = self.numbering.coefficients(gaps)

    def running(self):
        """NGSolve's threads."""
        ng.SetNumThreads(self.threads)
        return ng.TaskManager()

    def assemble(self) -> Elastic:
        """The elastic form's lower triangle, handed to Pardiso as the upper one of its transpose."""
        form = elastic_form(self.space, self.scene.elasticity)
        form.Assemble()
        vector = form.mat.CreateColVector()

        def times(x):
            vector.FV().NumPy()[:] = x
            return np.array((form.mat * vector).Evaluate().FV().NumPy())

        base = sp.csc_matrix(tuple(np.asarray(part) for part in form.mat.CSR()))
        solver = SymmetricPardiso(base, np.flatnonzero(self.free), self.threads)
        return Elastic(times, solver.solve, solver.close)

    def contact(self, penalty: float) -> Forces:
        """Energy stiffness/2 times the square of the depth to which the skin cuts the flat, the stiffness being
        `penalty` times modulus over element size (N/mm3)."""
        scene, solution = self.scene, ng.GridFunction(self.space).vec
        stiffness = penalty * scene.model.finger.outer.modulus / scene.mesh.size_mm
        outward = ng.CoefficientFunction(tuple(map(float, scene.frame.axes[2])))
        depth = scene.indentation - self.gap + self.space.TrialFunction()[0] * outward
        form = ng.BilinearForm(self.space, symmetric=True, symmetric_storage=True)
        form += ng.Variation(
            ng.IfPos(depth, stiffness / 2 * depth**2, 0).Compile() * ng.ds("contact", intrules=CONTACT_QUADRATURE)
        )
        found = solution.CreateVector()

        def tangent():
            form.AssembleLinearization(solution)
            rows, columns, values = (np.asarray(part) for part in form.mat.COO())
            return sp.coo_matrix((values, (columns, rows)), shape=(len(solution),) * 2)

        def forces(x):
            solution.FV().NumPy()[:] = x
            form.Apply(solution, found)
            return found.FV().NumPy().copy(), tangent

        return forces

    def told(self, unknowns, forces):
        """Edge functions vanish at the vertices, so a rigid translation consists of vertex functions alone."""
        displacements, pulls = (column[: self.scene.held.size].reshape(3, -1).T for column in (unknowns, forces))
        total = pulls[: len(self.scene.mesh.points)].sum(axis=0)
        return float(total @ self.scene.frame.axes[2]), self.numbering.values(displacements)


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
        # NGSolve's own numbering would keep unknowns of boundary triangles that the material does not have
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


class Numbering:
    """Between papilla's P2 nodes, vertices then edges, and NGSolve's hierarchical functions: vertices, then its edges.

    NGSolve's edge function is not 1 at the middle of its edge, and adds to the vertex functions there.
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
