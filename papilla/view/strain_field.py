"""The picture of a press: the deformed finger cut open in the plane of its gauges, coloured by strain along the layers
in %, with the specimen's solid and the outline of the contact on the skin; lengths in mm."""

from dataclasses import dataclass

import numpy as np
import pyvista as pv
from contourpy import contour_generator
from matplotlib import patheffects
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.interpolate import LinearNDInterpolator

from papilla.errors import InputError
from papilla.fem.fields import Field
from papilla.fem.pressing.press import Press
from papilla.fem.reduction.gauges import gauge_frame, strain_functional
from papilla.fem.reduction.patch import Frame
from papilla.fem.reduction.reduced import ReducedFinger
from papilla.finger import Finger
from papilla.mesh.finger_surfaces import surfaces_of
from papilla.mesh.layered import LayeredMesh
from papilla.specimen import Specimen, Sphere
from papilla.view.contact_map import contact_edge
from papilla.view.render import Part, View, draw, fitted, framed, use_offscreen_window
from papilla.view.style import DIVERGING, INK, MUTED, diverging_bar, literal, mark_gauge, nice_limit, titled

PERCENT = 100.0
OFF_PLANE = 1e-6
"""mm by which the cut misses the plane: a mesh with a mirror plane has whole faces in it, which a slice would skip."""

DAMPING = 0.02  # Stiffness against slopes in the fit of nodal strains, as a fraction of the fit's own


@dataclass(frozen=True, eq=False)
class Face:
    """Triangles of the cut through one layer: points (n, 3), triangles (t, 3), strain (n,) in %."""

    points: np.ndarray
    triangles: np.ndarray
    strain: np.ndarray


@dataclass(frozen=True, eq=False)
class Section:
    """The cut: a face per layer, outlines by surface name (lists of (k, 3)), bone polygons, gauges (g, 2, 3)."""

    faces: tuple[Face, ...]
    outlines: dict[str, list[np.ndarray]]
    bone: list[np.ndarray]
    gauges: np.ndarray


def cut(field: Field, finger: Finger, *, scale: float = 1.0, side: int = 1) -> Section:
    """The section of the deformed finger at y = 0, displacements drawn `scale` times as large.

    `side` tells which half is kept (+1: y > 0).
    """
    mesh = field.mesh
    moved = scale * field.displacement
    along = strain_along_layers(field, finger)
    faces = tuple(_face(mesh, number, along, moved, side) for number in np.unique(mesh.layer))
    outlines = {name: _outline(mesh, name, moved, side) for name in ("skin", "interface")}
    bone = _bone_polygons(finger, mesh) if finger.bone is None else []
    return Section(faces, outlines, bone, _gauge_bars(field, finger, scale))


def strain_along_layers(field: Field, finger: Finger) -> np.ndarray:
    """Strain (cells,) in % along the x-z tangent of the layers: on the interface, what a gauge at y = 0 measures."""
    mesh = field.mesh
    normal = surfaces_of(finger)["interface"].normal(mesh.points[mesh.tets].mean(axis=1))
    tangent = np.stack([normal[:, 2], np.zeros(len(normal)), -normal[:, 0]], axis=1)
    tangent /= np.linalg.norm(tangent, axis=1)[:, None]
    return PERCENT * np.einsum("ci,cij,cj->c", tangent, field.strain, tangent)


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
    doi:10.1002/nme.1620330702): a mean would fall short at the interface. Layers are not mixed, as strain may jump.
    """
    tets, here = mesh.tets[chosen], values[chosen]
    corners = mesh.points[tets]
    away = corners.mean(axis=1)[:, None] - corners
    rows = np.concatenate([np.ones((*tets.shape, 1)), away], axis=2)
    volume = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1]))
    normal, load = np.zeros((len(mesh.points), 4, 4)), np.zeros((len(mesh.points), 4))
    np.add.at(normal, tets, volume[:, None, None, None] * rows[..., :, None] * rows[..., None, :])
    np.add.at(load, tets, (volume * here)[:, None, None] * rows)
    # A little stiffness keeps the slope finite where few cells meet
    spread = np.trace(normal[:, 1:, 1:], axis1=1, axis2=2) / 3
    normal[:, [1, 2, 3], [1, 2, 3]] += DAMPING * spread[:, None]
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
    x, z = np.meshgrid(np.linspace(low[0], high[0], 401), np.linspace(low[2], high[2], 201))
    points = np.stack([x.ravel(), np.zeros(x.size), z.ravel()], axis=1)
    level = surfaces_of(finger)["bone"].level(points).reshape(x.shape)
    filled: tuple = contour_generator(x, z, level, fill_type="OuterCode").filled(float(level.min()) - 1, 0.0)
    return [np.column_stack([ring[:, 0], np.zeros(len(ring)), ring[:, 1]]) for ring in filled[0]]


def _gauge_bars(field: Field, finger: Finger, scale: float) -> np.ndarray:
    """Deformed ends (g, 2, 3) of the gauges' grids."""
    interface = surfaces_of(finger)["interface"]
    bars = []
    for gauge in finger.gauges:
        ends = strain_functional(gauge, gauge_frame(finger, gauge, interface), interface).points
        bars.append(ends + scale * np.nan_to_num(surface_displacement(field, "interface", ends[:, :2])))
    return np.array(bars)


DRAWN_THICKNESS = 10.0  # mm of a half-space, or of a thicker block, that are drawn


def contact_frame(finger: Finger, at: tuple[float, float]) -> Frame:
    """The contact plane at touch-down point `at` (x, y)."""
    return Frame.at(surfaces_of(finger)["skin"], *at)


def specimen_solid(
    specimen: Specimen, field: Field, frame: Frame, press: Press, half_width: float, scale: float
) -> pv.PolyData:
    """The specimen's closed surface; where the finger bulges into it, its face follows the skin.

    `scale` multiplies the approach, as it does the finger's displacement.
    """
    approach = scale * press.indentation
    if isinstance(specimen, Sphere):
        solid = pv.Sphere(
            radius=specimen.radius, center=(0, 0, specimen.radius - approach), theta_resolution=120, phi_resolution=120
        ).clean()
    else:
        thickness = min(getattr(specimen, "thickness", DRAWN_THICKNESS), DRAWN_THICKNESS)
        x, y, level = np.meshgrid(*[np.linspace(-half_width, half_width, 81)] * 2, [0.0, 1.0], indexing="ij")
        skin = _skin_height(field, frame, scale)(x[:, :, 0], y[:, :, 0])
        height = specimen.gap(np.column_stack([x[:, :, 0].ravel(), y[:, :, 0].ravel()])).reshape(skin.shape)
        face = np.fmin(np.fmax(height - approach, skin), thickness - approach)
        z = np.where(level > 0, thickness - approach, face[:, :, None])
        solid = pv.StructuredGrid(x, y, z).extract_surface(algorithm="dataset_surface").triangulate().clean()
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
    # The far side of a closed skin may lie below the same (x, y): keep the sheet above the frame's horizon.
    upper = local[:, 2] > 0.9 * local[:, 2].min()
    return LinearNDInterpolator(local[upper, :2], local[upper, 2])


LABEL_MM = 1.5  # Distance of a gauge's label from its grid
SKIN_COLOR, SPECIMEN_COLOR, BONE_COLOR = "#e9d8c7", "#7d93ad", "#c9ced6"


def strain_figure(
    field: Field, reduced: ReducedFinger, press: Press, specimen: Specimen, finger: Finger, *, scale: float = 1.0
) -> Figure:
    """The figure of a press of `reduced` and its recovered field; displacements are drawn `scale` times as large.

    Raises `InputError` where the finger is not the one that was reduced.
    """
    if finger.sha256 != reduced.finger_sha256:
        raise InputError(f"the reduced finger was not made from this design of {finger.name}")
    side = -1 if reduced.at[1] < 0 else 1
    section = cut(field, finger, scale=scale, side=side)
    limit = nice_limit(max(float(np.abs(face.strain).max()) for face in section.faces))
    frame = contact_frame(finger, reduced.at)
    solid = specimen_solid(specimen, field, frame, press, 0.9 * finger.patch_radius, scale)
    solid = solid.clip_closed_surface((0, side, 0), origin=(0, 0, 0))
    skin = half_skin(field, scale=scale, side=side)
    rendered = use_offscreen_window()
    view = View(20.0 if rendered else 0.0, 0.0 if side > 0 else 180.0)
    view = fitted(view, np.concatenate([skin.points, solid.points]))
    with framed(view, 10) as (figure, axes):
        if rendered:
            edges = solid.extract_feature_edges(feature_angle=60)
            parts = [*_faces(section, limit), Part(skin, SKIN_COLOR), Part(edges, SPECIMEN_COLOR, lit=False)]
            draw(axes, [*parts, Part(solid, SPECIMEN_COLOR, opacity=0.22, lit=False)], view)
        else:
            _paint(axes, section, solid.points, view, limit)
        # Without what lies in the half that was cut away
        outline = [
            np.where(side * line[:, 1:2] >= -1e-3, line, np.nan)
            for line in contact_outline(field, reduced, press, frame, scale)
        ]
        top = view.project(solid.points)[:, 1].max()
        middle = float(view.project(np.array(solid.center))[0])
        axes.text(middle, top - 1.2, f"specimen, {specimen.modulus:.3g} MPa", ha="center", va="top", color=MUTED)
        _annotate(axes, section, outline, view, finger, press)
        bar = diverging_bar(figure, limit, "strain along the layers (%): red is tension, blue compression")
        bar.ax.set_xticklabels([f"{tick:+.3g}".replace("-", "−") if tick else "0" for tick in bar.get_ticks()])
        _title(figure, press, specimen, scale, side)
    return figure


def _faces(section: Section, limit: float) -> list[Part]:
    parts = []
    for face in section.faces:
        surface = pv.PolyData.from_regular_faces(face.points, face.triangles)
        surface.point_data["strain"] = face.strain
        parts.append(Part(surface, scalars="strain", limit=limit, lit=False))
    return parts


def _paint(axes: Axes, section: Section, solid: np.ndarray, view: View, limit: float) -> None:
    """The cut face by matplotlib alone, seen head-on: for machines where VTK cannot render."""
    for face in section.faces:
        x, y = view.project(face.points).T
        axes.tripcolor(x, y, face.triangles, face.strain, shading="gouraud", cmap=DIVERGING, vmin=-limit, vmax=limit)
    inside = view.project(solid)
    low, high = inside.min(axis=0), inside.max(axis=0)
    axes.fill_between([low[0], high[0]], low[1], high[1], color=SPECIMEN_COLOR, alpha=0.28, linewidth=0)


def _annotate(axes: Axes, section: Section, contact: list, view: View, finger: Finger, press: Press) -> None:
    for polygon in section.bone:
        axes.fill(*view.project(polygon).T, facecolor=BONE_COLOR, edgecolor=INK, linewidth=0.8)
        x, y = view.project(polygon.mean(axis=0))
        axes.text(x, y, "bone", ha="center", va="center", color=MUTED)
    for name, width in (("skin", 1.0), ("interface", 1.3)):
        for line in section.outlines[name]:
            axes.plot(*view.project(line).T, color=INK, linewidth=width)
    for line in contact:
        axes.plot(*view.project(line).T, color=INK, linewidth=1.6, linestyle=(0, (4, 1.5)))
    for gauge, bar, strain in zip(finger.gauges, section.gauges, press.strain, strict=True):
        flat = view.project(bar)
        mark_gauge(axes, flat)
        inward = _inward(flat)
        label = f"{literal(gauge.name)}\n{100 * strain:+.2f} %".replace("-", "−")
        x, y = flat.mean(axis=0) + LABEL_MM * inward
        axes.text(
            x, y, label, ha="center", va="top", fontsize=9, weight="bold", linespacing=1.25,
            path_effects=[patheffects.withStroke(linewidth=2.5, foreground="white", alpha=0.85)],
        )  # fmt: skip


def _inward(bar: np.ndarray) -> np.ndarray:
    """Unit normal (2,) of a gauge's bar (2, 2) on the picture that points down, into the finger."""
    along = bar[1] - bar[0]
    normal = np.array([-along[1], along[0]]) / np.linalg.norm(along)
    return -normal if normal[1] > 0 else normal


def _title(figure: Figure, press: Press, specimen: Specimen, scale: float, side: int) -> None:
    what = f"{press.force:.3g} N on a {specimen.modulus:.3g} MPa {specimen.words}: S_d = {press.sd:,.0f} µε"
    drawn = "deformed shape to true scale" if scale == 1 else f"displacements drawn {scale:g} times as large"
    facts = f"indentation {press.indentation:.3g} mm, contact {press.contact_area:.3g} mm² (dashed); {drawn}"
    facts += "; seen from +y" if side < 0 else ""
    facts += "" if press.resolved else "; mesh too coarse for this press"
    titled(figure, what.replace("S_d", r"$S_d$"), facts, 14)
