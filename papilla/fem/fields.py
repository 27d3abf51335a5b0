"""The full field of a press on the whole mesh, computed only when it is asked for: displacement of the vertices, strain
of the cells; and the file that other programs read."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from papilla.core.errors import FileFormatError, InputError
from papilla.core.files import replacing
from papilla.fem.discrete.assembly import lame
from papilla.fem.discrete.elements import Space, TaylorHood, evaluated, fold, parity_signs
from papilla.fem.pressing.press import Press
from papilla.fem.reduction.finger_model import FingerModel
from papilla.fem.reduction.reduced import ReducedFinger
from papilla.mesh.layered import LayeredMesh

VTK_TENSOR_ORDER = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))
"""Order in which VTK and ParaView keep a symmetric tensor: xx, yy, zz, xy, yz, xz."""


@dataclass(frozen=True, eq=False)
class Field:
    """Displacement (points, 3) in mm at the vertices; small strain and stress (MPa), each (cells, 3, 3), at the cell
    centroids."""

    mesh: LayeredMesh
    displacement: np.ndarray
    strain: np.ndarray
    stress: np.ndarray


def recover(model: FingerModel, reduced: ReducedFinger, press: Press) -> Field:
    """The field of a press of `reduced`. Raises `InputError` if `reduced` was not made from `model`."""
    theirs = (reduced.finger_sha256, reduced.mesh_sha256, reduced.element)
    if theirs != (model.finger.sha256, model.mesh.sha256, model.space.name):
        raise InputError("the reduced finger does not come from this model: finger, mesh or element differ")
    space, mesh = model.space, model.mesh
    displacement = np.zeros((len(mesh.points), 3))
    strain = np.zeros((len(mesh.tets), 3, 3))
    pressure = np.zeros(len(mesh.tets))
    pressures = model.cell_pressures(press.traction, reduced.at)
    cell_vertex, vertex_image = _fold(mesh, mesh.points, space.mesh.points)
    centroids = space.mesh.points[space.mesh.tets].mean(axis=1)
    cell_number, cell_image = _fold(mesh, mesh.points[mesh.tets].mean(axis=1), centroids)
    vertices = space.displacement.nodal_dofs[0]
    for parity, solution in model.cell_displacements(press.traction, reduced.at).items():
        cell_strain = _centroid_strain(space, solution)
        cell_pressure = _centroid_pressure(model, pressures[parity], cell_strain)
        for image in np.unique(vertex_image, axis=0):
            signs = parity_signs(parity, tuple(image))
            in_image = (vertex_image == image).all(axis=1)
            displacement[in_image] += solution[vertices][cell_vertex[in_image]] * signs
            mirror = np.array([*image, 1])
            in_image = (cell_image == image).all(axis=1)
            strain[in_image] += cell_strain[cell_number[in_image]] * np.outer(signs, mirror)
            pressure[in_image] += cell_pressure[cell_number[in_image]] * signs[2]
    mu = np.array([lame(model.layers[number])[0] for number in mesh.layer.tolist()])
    stress = 2 * mu[:, None, None] * strain - pressure[:, None, None] * np.eye(3)
    return Field(mesh, displacement, strain, stress)


def save_field(field: Field, path: str | Path) -> None:
    """Write displacement (mm) of the vertices, small strain and stress (MPa; six components each) and the layer number
    of the tetrahedra.

    Raises `FileFormatError` unless the path ends in .vtu, `FileAccessError` if the file cannot be written.
    """
    import meshio

    if Path(path).suffix.lower() != ".vtu":
        raise FileFormatError(f"{path}: fields are written as .vtu files")
    tensors = {"strain": field.strain, "stress_MPa": field.stress}
    cells = {name: [np.stack([of[:, i, j] for i, j in VTK_TENSOR_ORDER], axis=1)] for name, of in tensors.items()}
    cells["layer"] = [field.mesh.layer.astype(np.int32)]
    vtk_mesh = meshio.Mesh(
        field.mesh.points,
        [("tetra", field.mesh.tets)],
        point_data={"displacement_mm": field.displacement},
        cell_data=cells,
    )
    with replacing(path) as temporary:
        meshio.vtu.write(str(temporary), vtk_mesh, binary=True)


@dataclass(frozen=True, eq=False)
class ReceptiveFields:
    """Response of each gauge to a small load anywhere on the skin; k skin vertices, g gauges.

    vertices : (k,) point numbers of the mesh.
    strain_per_newton : (g, k) gauge strain per newton along the inward normal.
    """

    mesh: LayeredMesh
    vertices: np.ndarray
    strain_per_newton: np.ndarray


def receptive_fields(model: FingerModel) -> ReceptiveFields:
    """Receptive fields of all gauges. Each gauge costs one adjoint solve per parity."""
    mesh = model.mesh
    vertices = np.unique(mesh.boundaries["skin"])
    points = mesh.points[vertices]
    adjoint = evaluated(model.space, mesh.mirrors, model.gauge_adjoints(), points)
    inward = -model.surfaces["skin"].normal(points)
    return ReceptiveFields(mesh, vertices, np.einsum("ki,kig->gk", inward, adjoint))


def _fold(mesh: LayeredMesh, points: np.ndarray, cell_points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """For each point, its mirror image among `cell_points` and the signs (k, 2) that lead to it."""
    folded, images = fold(points, mesh.mirrors)
    return cKDTree(cell_points).query(folded)[1], images


def _centroid_pressure(model: FingerModel, unknowns: np.ndarray, strain: np.ndarray) -> np.ndarray:
    """Pressure p (cells,) in MPa of sigma = 2 mu eps - p I at the centroids. An element with pressure unknowns gives
    them directly, because div u of a nearly incompressible layer is too small to give p; any other element gives
    -lambda div u."""
    if isinstance(model.space, TaylorHood):
        return unknowns[model.space.pressure_dofs].mean(axis=1)
    compressibility = np.array([lame(model.layers[number])[1] for number in model.space.mesh.layer.tolist()])
    return -np.trace(strain, axis1=1, axis2=2) / compressibility


def _centroid_strain(space: Space, solution: np.ndarray) -> np.ndarray:
    """Small strain (cells, 3, 3): the mean of the strain over each cell, which for these elements equals its value at
    the centroid."""
    basis = space.displacement
    corners = space.mesh.points[space.mesh.tets]
    inverse = np.linalg.inv((corners[:, 1:] - corners[:, :1]).transpose(0, 2, 1))
    centre = np.full((3, 1), 0.25)
    local = np.stack([basis.elem.lbasis(centre, i)[1][:, 0] for i in range(len(basis.element_dofs))])
    gradients = np.einsum("ni,cij->cnj", local, inverse)
    values = solution[basis.element_dofs.T]
    gradient = np.einsum("cni,cnj->cij", values, gradients)
    return (gradient + gradient.transpose(0, 2, 1)) / 2
