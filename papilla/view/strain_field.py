"""The picture of a press, or of two on one scale: the deformed finger cut open in the plane of its gauges, coloured by
strain along the layers or by a component of the stress, with the specimen and the outline of the contact."""

from dataclasses import dataclass

import numpy as np
import pyvista as pv
from matplotlib import patheffects
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.spatial import ConvexHull, cKDTree

from papilla.core.errors import InputError
from papilla.core.units import PER_CENT
from papilla.fem.fields import Field
from papilla.fem.pressing.press import Press
from papilla.fem.reduction.patch import Frame
from papilla.fem.reduction.reduced import ReducedFinger
from papilla.mesh.body import patch_radius_mm, surfaces_of
from papilla.model.finger import Finger
from papilla.model.specimen import Specimen
from papilla.view import style
from papilla.view.render import PaintedSurface, View, draw, fitted, framed, use_offscreen_window
from papilla.view.section import CutGeometry, contact_outline, cut, half_skin, specimen_solid

LABEL_MM = 1.5  # Distance of a gauge's label from its grid
SKIN_COLOR, SPECIMEN_COLOR = "#e9d8c7", "#cdd5e0"
EDGE_COLOR = "#9fb0c4"  # Edge of the specimen
SECTION_ELEVATION_DEG, CORNER_DEG = 20.0, 60
"""Degrees of the view above the horizon, and between two faces of a specimen with an edge."""
PICTURE_WIDTHS_IN = (10.0, 17.0)  # Inches of a picture of one press and of two


@dataclass(frozen=True, eq=False)
class PressScene:
    """A press to show: its recovered field, its result and its specimen."""

    field: Field
    press: Press
    specimen: Specimen


@dataclass(frozen=True, eq=False)
class Drawn:
    """Drawn parts of a scene: the cut, the skin behind it, the specimen's half, the contact's lines, and the touch-down
    point (3,) on the deformed skin (None at the apex)."""

    section: CutGeometry
    skin: pv.PolyData
    solid: pv.PolyData
    outline: list[np.ndarray]
    touched: np.ndarray | None


def drawn(
    scene: PressScene, reduced: ReducedFinger, finger: Finger, quantity: str = style.STRAIN_QUANTITY, scale: float = 1.0
) -> Drawn:
    """The geometry of a scene of `reduced`, with displacements `scale` times as large, cut on the side of the touch.

    Raises `InputError` if `reduced` was made from another finger, and for an unknown quantity `shown`.
    """
    if finger.sha256 != reduced.finger_sha256:
        raise InputError(f"the reduced finger was not made from this design of {finger.name}")
    if quantity not in (style.STRAIN_QUANTITY, *style.STRESS_COMPONENTS):
        raise InputError(
            f"what is shown must be {style.STRAIN_QUANTITY} or, of the stress, "
            f"{', '.join(style.STRESS_COMPONENTS)}; got {quantity!r}"
        )
    field, press, side = scene.field, scene.press, side_of(reduced)
    frame = Frame.at(surfaces_of(finger)["skin"], *reduced.at)
    solid = specimen_solid(scene.specimen, field, frame, press, 0.9 * patch_radius_mm(finger), scale)
    # Without the parts in the half that was cut away
    outline = [
        np.where(side * line[:, 1:2] >= -1e-3, line, np.nan)
        for line in contact_outline(field, reduced, press, frame, scale)
    ]
    nearest = int(cKDTree(field.mesh.points).query(frame.origin)[1])
    touched = frame.origin + scale * field.displacement[nearest] if any(reduced.at) else None
    section = cut(field, finger, quantity=quantity, scale=scale, side=side)
    skin, solid = half_skin(field, scale=scale, side=side), solid.clip_closed_surface((0, side, 0), origin=(0, 0, 0))
    return Drawn(section, skin, solid, outline, touched)


def side_of(reduced: ReducedFinger) -> int:
    """The half of the finger that is shown, the one with the touch: +1 for y > 0, seen from -y."""
    return -1 if reduced.at[1] < 0 else 1


def shown_words(quantity: str) -> str:
    """Meaning of the colours, with the unit."""
    if quantity == style.STRAIN_QUANTITY:
        return "strain along the layers (%): red is tension, blue compression"
    if quantity == "mises":
        return "von Mises stress (kPa)"
    sides = ": red is tension, blue compression" if quantity[0] == quantity[1] else ""
    return f"{'stress' if sides else 'shear stress'} {quantity} (kPa){sides}"


def common_limit(parts: list[Drawn]) -> float:
    """The end of the colours for the values on all cuts."""
    return style.nice_limit(max(float(np.abs(face.values).max()) for drawn in parts for face in drawn.section.faces))


def points_of(parts: list[Drawn]) -> np.ndarray:
    """All points (n, 3) of skins and specimens."""
    return np.concatenate([surface.points for drawn in parts for surface in (drawn.skin, drawn.solid)])


def strain_figure(
    field: Field,
    reduced: ReducedFinger,
    press: Press,
    specimen: Specimen,
    finger: Finger,
    *,
    scale: float = 1.0,
    shown: str = style.STRAIN_QUANTITY,
    beside: PressScene | None = None,
    width: float | None = None,
) -> Figure:
    """The figure of a press of `reduced` and its recovered field.

    scale : how many times as large displacements are drawn. shown : "strain" along the layers, or a component of the
    stress. beside : another press of `reduced`, drawn on the same scale. width : of the figure in inches; in one of a
    telephone's width gauges are labelled with their readings alone. Raises as `drawn`.
    """
    scenes = [PressScene(field, press, specimen), *([] if beside is None else [beside])]
    parts = [drawn(scene, reduced, finger, shown, scale) for scene in scenes]
    limit = common_limit(parts)
    rendered, side, short = use_offscreen_window(), side_of(reduced), width == style.NARROW_IN
    view = View(SECTION_ELEVATION_DEG if rendered else 0.0, 0.0 if side > 0 else 180.0)
    view = fitted(view, points_of(parts))
    with framed(view, width or PICTURE_WIDTHS_IN[len(scenes) - 1], len(scenes)) as (figure, frames):
        for axes, scene, geometry in zip(frames, scenes, parts, strict=True):
            if rendered:
                edges = geometry.solid.extract_feature_edges(feature_angle=CORNER_DEG)
                lines = [PaintedSurface(geometry.skin, SKIN_COLOR), PaintedSurface(edges, EDGE_COLOR, lit=False)]
                # Opaque: through a translucent specimen the finger behind the cut would seem to be inside it
                solid = PaintedSurface(geometry.solid, SPECIMEN_COLOR, lit=False)
                draw(axes, [*_faces(geometry.section, limit), *lines, solid], view)
            else:
                _paint(axes, geometry.section, geometry.solid.points, view, limit)
            x, y = view.project(np.array(geometry.solid.center))
            words = f"{scene.specimen.modulus:.3g} MPa\n{scene.specimen.words}"
            axes.text(x, y, words, ha="center", va="bottom", color=style.MUTED_COLOR)
            strains = shown == style.STRAIN_QUANTITY
            _annotate(axes, geometry, view, finger, scene.press, strains=strains, short=short)
            if beside is not None:
                small = {"loc": "center", "fontsize": "medium", "weight": "normal", "color": style.MUTED_COLOR}
                axes.set_title(_facts(scene.press), **small)
        bar = style.diverging_bar(frames, limit, shown_words(shown))
        bar.ax.set_xticklabels([f"{tick:+.3g}".replace("-", "−") if tick else "0" for tick in bar.get_ticks()])
        _title(figure, scenes, reduced, scale, ["numbers at the gauges: readings in 10³ µε"] if short else [])
        if short:
            style.narrow(figure)
    return figure


def _faces(section: CutGeometry, limit: float) -> list[PaintedSurface]:
    parts = []
    for face in section.faces:
        surface = pv.PolyData.from_regular_faces(face.points, face.triangles)
        surface.point_data["shown"] = face.values
        parts.append(PaintedSurface(surface, scalars="shown", limit=limit, lit=False))
    return parts


def _paint(axes: Axes, section: CutGeometry, solid: np.ndarray, view: View, limit: float) -> None:
    """Draw the cut face with matplotlib alone, seen from the front, if VTK cannot render."""
    for face in section.faces:
        x, y = view.project(face.points).T
        axes.tripcolor(x, y, face.triangles, face.values, **style.signed_shades(limit))
    inside = view.project(solid)
    axes.fill(*inside[ConvexHull(inside).vertices].T, color=SPECIMEN_COLOR, linewidth=0)


def _annotate(
    axes: Axes, geometry: Drawn, view: View, finger: Finger, press: Press, *, strains: bool, short: bool
) -> None:
    for polygon in geometry.section.bone:
        colors = {"facecolor": style.RIGID_COLOR, "edgecolor": style.INK_COLOR}
        axes.fill(*view.project(polygon).T, **colors, linewidth=style.THIN_PT)
        x, y = view.project(polygon.mean(axis=0))
        axes.text(x, y, "bone", ha="center", va="center", color=style.MUTED_COLOR)
    for name, width in (("skin", style.THIN_PT), ("interface", style.THICK_PT)):
        for line in geometry.section.outlines[name]:
            axes.plot(*view.project(line).T, color=style.INK_COLOR, linewidth=width)
    for line in geometry.outline:
        axes.plot(*view.project(line).T, color=style.INK_COLOR, linewidth=style.THICK_PT, linestyle="--")
    if geometry.touched is not None:
        cross = {"color": style.INK_COLOR, "markersize": 11, "markeredgewidth": style.THICK_PT}
        axes.plot(*view.project(geometry.touched), "+", **cross)
    for gauge, bar, strain, reading in zip(
        finger.gauges, geometry.section.gauges, press.strain, press.reading, strict=True
    ):
        flat = view.project(bar)
        style.mark_gauge(axes, flat)
        facts = f"{reading:+,.0f} µε" + f"\n({PER_CENT * strain:+.2f} %)" * strains
        if short:
            facts = f"{reading / style.MICROSTRAIN_A_THOUSAND:+.3g}"
        label = f"{style.named(gauge.name)}\n{facts.replace('-', '−')}"
        x, y = flat.mean(axis=0) + LABEL_MM * _inward(flat)
        axes.text(
            x, y, label, ha="center", va="top", fontsize="small", weight="bold",
            path_effects=[patheffects.withStroke(linewidth=2.5, foreground="white", alpha=0.85)],
        )  # fmt: skip


def _inward(bar: np.ndarray) -> np.ndarray:
    """Unit normal (2,) of a gauge's bar (2, 2) in the picture, pointing down into the finger."""
    along = bar[1] - bar[0]
    normal = np.array([-along[1], along[0]]) / np.linalg.norm(along)
    return -normal if normal[1] > 0 else normal


def _facts(press: Press) -> str:
    coarse = "" if press.resolved else "; mesh too coarse for this press"
    return f"indentation {press.indentation:.3g} mm, contact {press.contact_area:.3g} mm² (dashed){coarse}"


def _title(figure: Figure, scenes: list[PressScene], reduced: ReducedFinger, scale: float, more: list[str]) -> None:
    press, specimen = scenes[0].press, scenes[0].specimen
    if len(scenes) > 1:
        touched = " and on ".join(f"{scene.specimen.modulus:.3g} MPa" for scene in scenes)
    else:
        touched = f"a {specimen.modulus:.3g} MPa {specimen.words}"
    spread = " and ".join(f"{scene.press.sd:,.0f}" for scene in scenes)
    facts = [_facts(press)] if len(scenes) == 1 else []
    facts.append(style.friction_text(press.friction))
    facts += ["true scale" if scale == 1 else f"displacements drawn {scale:g} times as large"]
    if any(reduced.at):
        facts.append(
            f"touched (+) at x {reduced.at[0]:g}, y {reduced.at[1]:g} mm" + ", seen from +y" * (reduced.at[1] < 0)
        )
    style.titled(
        figure,
        rf"{press.force:.3g} N on {touched}: $S_d$ of the readings {spread} µε",
        "; ".join(facts + more),
        *[style.LARGE_PT] * (not more),
        formula=True,
    )
