"""The geometry of a press that pictures show, in mm: the deformed finger cut open in the plane of its gauges, values on
the cut, the skin behind it, the specimen's solid and the outline of the contact."""

from dataclasses import dataclass

import numpy as np
import pyvista as pv
from contourpy import contour_generator
from scipy.interpolate import LinearNDInterpolator

from papilla.core.units import KPA_PER_MPA, PER_CENT
from papilla.fem.fields import Field
from papilla.fem.pressing.press import Press
from papilla.fem.reduction.gauges import gauge_frame, strain_functional
from papilla.fem.reduction.patch import Frame
from papilla.fem.reduction.reduced import ReducedFinger
from papilla.mesh.body import surfaces_of
from papilla.mesh.layered import LayeredMesh
from papilla.model.finger import Finger
from papilla.model.specimen import Specimen, Sphere
from papilla.view.contact_map import contact_edge
from papilla.view.style import STRAIN_QUANTITY

OFF_PLANE = 1e-6
"""Distance (mm) of the cut from the plane: a mesh with a mirror plane has whole faces in it, which a slice would
skip."""

SLOPE_PENALTY = 0.02  # Penalty on slopes in the fit of nodal values, as a fraction of the fit's own stiffness


@dataclass(frozen=True, eq=False)
class Face:
    """Triangles of the cut through one layer: points (n, 3), triangles (t, 3), values (n,) that are shown."""

    points: np.ndarray
    triangles: np.ndarray
    values: np.ndarray


@dataclass(frozen=True, eq=False)
class CutGeometry:
    """The cut: a face per layer, outlines by surface name (lists of (k, 3)), bone polygons, gauges (g, 2, 3)."""

    faces: tuple[Face, ...]
    outlines: dict[str, list[np.ndarray]]
    bone: list[np.ndarray]
    gauges: np.ndarray


def cut(
    field: Field, finger: Finger, *, quantity: str = STRAIN_QUANTITY, scale: float = 1.0, side: int = 1
) -> CutGeometry:
    """The section of the deformed finger at y = 0, displacements drawn `scale` times as large.

    shown : the values, as of `cell_values`. side : which half is kept (+1: y > 0).
    """
    mesh = field.mesh
    moved = scale * field.displacement
    values = cell_values(field, finger, quantity)
    faces = tuple(_face(mesh, number, values, moved, side) for number in np.unique(mesh.layer))
    outlines = {name: _outline(mesh, name, moved, side) for name in ("skin", "interface")}
    bone = _bone_polygons(finger, mesh) if finger.bone is None else []
    return CutGeometry(faces, outlines, bone, _gauge_bars(field, finger, scale))


def cell_values(field: Field, finger: Finger, quantity: str) -> np.ndarray:
    """The values to show, (cells,): `STRAIN` along the layers in %, or one of the `COMPONENTS` of the stress in kPa."""
    if quantity == STRAIN_QUANTITY:
        return strain_along_layers(field, finger)
    if quantity == "mises":
        deviator = field.stress - np.trace(field.stress, axis1=1, axis2=2)[:, None, None] / 3 * np.eye(3)
        return KPA_PER_MPA * np.sqrt(1.5 * (deviator**2).sum(axis=(1, 2)))
    return KPA_PER_MPA * field.stress[:, "xyz".index(quantity[0]), "xyz".index(quantity[1])]


def strain_along_layers(field: Field, finger: Finger) -> np.ndarray:
    """Strain (cells,) in % along the x-z tangent of the layers; on the interface this is what a gauge at y = 0
    measures."""
    mesh = field.mesh
    normal = surfaces_of(finger)["interface"].normal(mesh.points[mesh.tets].mean(axis=1))
    tangent = np.stack([normal[:, 2], np.zeros(len(normal)), -normal[:, 0]], axis=1)
    tangent /= np.linalg.norm(tangent, axis=1)[:, None]
    return PER_CENT * np.einsum("ci,cij,cj->c", tangent, field.strain, tangent)


def half_skin(field: Field, *, scale: float = 1.0, side: int = 1) -> pv.PolyData:
    """The deformed skin on one side of y = 0, with normals."""
    triangles = field.mesh.boundaries["skin"]
    skin = pv.PolyData.from_regular_faces(field.mesh.points, triangles)
    skin.point_data["moved"] = scale * field.displacement
    skin = skin.clip((0, side, 0), origin=(0, 0, 0), invert=False).triangulate()
    skin.points = skin.points + skin.point_data["moved"]
    return skin.compute_normals(cell_normals=False, consistent_normals=True, split_vertices=False)


def surface_displacement(field: Field, name: str, xy: np.ndarray) -> np.ndarray:
    """Displacement (n, 3) in mm of the boundary `name` above the undeformed places `xy` (n, 2); NaN outside."""
    vertices = np.unique(field.mesh.boundaries[name])
    return LinearNDInterpolator(field.mesh.points[vertices, :2], field.displacement[vertices])(xy)


def _face(mesh: LayeredMesh, number: int, values: np.ndarray, moved: np.ndarray, side: int) -> Face:
    chosen = mesh.layer == number
    grid = pv.UnstructuredGrid({pv.CellType.TETRA: mesh.tets[chosen]}, mesh.points)
    grid.point_data["moved"] = moved
    grid.point_data["value"] = _nodal_values(mesh, chosen, values)
    face = grid.slice("y", origin=(0, side * OFF_PLANE, 0)).triangulate()
    return Face(face.points + face["moved"], face.regular_faces, np.asarray(face["value"]))


def _nodal_values(mesh: LayeredMesh, chosen: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Values (points,) at the vertices of the chosen cells from values (cells,) at centroids; zero at other vertices.

    A linear function is fitted to the centroids around each vertex (Zienkiewicz and Zhu, 1992,
    doi:10.1002/nme.1620330702), because a mean would be too small at the interface. Layers are not mixed, because
    strain may jump.
    """
    tets, centroid_values = mesh.tets[chosen], values[chosen]
    corners = mesh.points[tets]
    away = corners.mean(axis=1)[:, None] - corners
    rows = np.concatenate([np.ones((*tets.shape, 1)), away], axis=2)
    volume = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1]))
    terms = rows.shape[-1]
    normal, load = np.zeros((len(mesh.points), terms, terms)), np.zeros((len(mesh.points), terms))
    np.add.at(normal, tets, volume[:, None, None, None] * rows[..., :, None] * rows[..., None, :])
    np.add.at(load, tets, (volume * centroid_values)[:, None, None] * rows)
    # A small penalty keeps the slope finite if few cells meet at a vertex
    spread = np.trace(normal[:, 1:, 1:], axis1=1, axis2=2) / 3
    slopes = np.arange(1, terms)
    normal[:, slopes, slopes] += SLOPE_PENALTY * spread[:, None]
    used = np.unique(tets)
    nodal = np.zeros(len(mesh.points))
    nodal[used] = np.linalg.solve(normal[used], load[used][..., None])[:, 0, 0]
    return nodal


def _outline(mesh: LayeredMesh, name: str, moved: np.ndarray, side: int) -> list[np.ndarray]:
    surface = pv.PolyData.from_regular_faces(mesh.points, mesh.boundaries[name])
    surface.point_data["moved"] = moved
    lines = surface.slice("y", origin=(0, side * OFF_PLANE, 0)).strip(join=True)
    points = lines.points + lines["moved"]
    return [points[cell.point_ids] for cell in lines.cell]


def _bone_polygons(finger: Finger, mesh: LayeredMesh) -> list[np.ndarray]:
    """Outlines (k, 3) of a rigid bone in the plane y = 0, above the base plane."""
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    x, z = np.meshgrid(np.linspace(low[0], high[0], SPECIMEN_POINTS), np.linspace(low[2], high[2], SPECIMEN_POINTS))
    points = np.stack([x.ravel(), np.zeros(x.size), z.ravel()], axis=1)
    level = surfaces_of(finger)["bone"].level(points).reshape(x.shape)
    filled: tuple = contour_generator(x, z, level, fill_type="OuterCode").filled(float(level.min()) - 1, 0.0)
    return [np.column_stack([ring[:, 0], np.zeros(len(ring)), ring[:, 1]]) for ring in filled[0]]


def _gauge_bars(field: Field, finger: Finger, scale: float) -> np.ndarray:
    """Deformed ends (g, 2, 3) of the middle line of each gauge's grid."""
    interface = surfaces_of(finger)["interface"]
    bars = []
    for gauge in finger.gauges:
        lines = strain_functional(gauge, gauge_frame(finger, gauge, interface), interface).points.reshape(-1, 2, 3)
        ends = lines[len(lines) // 2]
        bars.append(ends + scale * np.nan_to_num(surface_displacement(field, "interface", ends[:, :2])))
    return np.array(bars)


SPECIMEN_POINTS = 120  # Across a specimen, around a ball, and along each axis of the level of a bone
DRAWN_THICKNESS = 10.0  # Height (mm) of a half-space, or of a thicker block, that is drawn


def specimen_solid(
    specimen: Specimen, field: Field, frame: Frame, press: Press, half_width: float, scale: float
) -> pv.PolyData:
    """The specimen's closed surface; if the finger bulges into it, its face follows the skin.

    `scale` multiplies the approach like the finger's displacement.
    """
    approach = scale * press.indentation
    if isinstance(specimen, Sphere):
        centre = (0, 0, specimen.radius - approach)
        fine = {"theta_resolution": SPECIMEN_POINTS, "phi_resolution": SPECIMEN_POINTS}
        solid = pv.Sphere(radius=specimen.radius, center=centre, **fine).clean()
    else:
        thickness = min(getattr(specimen, "thickness", DRAWN_THICKNESS), DRAWN_THICKNESS)
        x, y = np.meshgrid(*[np.linspace(-half_width, half_width, SPECIMEN_POINTS)] * 2, indexing="ij")
        skin = _skin_height(field, frame, scale)(x, y)
        height = specimen.gap(np.column_stack([x.ravel(), y.ravel()])).reshape(skin.shape)
        top = np.full_like(skin, thickness - approach)
        z = np.dstack([np.fmin(np.fmax(height - approach, skin), top), top])
        grid = pv.StructuredGrid(np.dstack([x, x]), np.dstack([y, y]), z)
        solid = grid.extract_surface(algorithm="dataset_surface").triangulate().clean()
    solid.points = solid.points @ frame.axes + frame.origin
    return solid


def contact_outline(field: Field, reduced: ReducedFinger, press: Press, frame: Frame, scale: float) -> list[np.ndarray]:
    """Closed lines (k, 3) around the contact, on the deformed skin."""
    height = _skin_height(field, frame, scale)
    lines = contact_edge(reduced, press)
    return [np.column_stack([line, height(line)]) @ frame.axes + frame.origin for line in lines]


def _skin_height(field: Field, frame: Frame, scale: float) -> LinearNDInterpolator:
    """Local height of the deformed skin that faces the contact plane, over local (x, y); NaN beside it."""
    vertices = np.unique(field.mesh.boundaries["skin"])
    local = frame.local(field.mesh.points[vertices] + scale * field.displacement[vertices])
    # The far side of a closed skin may lie below the same (x, y): keep only the sheet above the frame's horizon.
    upper = local[:, 2] > 0.9 * local[:, 2].min()
    return LinearNDInterpolator(local[upper, :2], local[upper, 2])
