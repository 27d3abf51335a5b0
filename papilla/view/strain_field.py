"""The picture of a press: the finger cut open in the plane of its gauges, coloured by strain along the layers."""

import numpy as np
import pyvista as pv
from matplotlib import patheffects
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from papilla.errors import InputError
from papilla.fem.fields import Field
from papilla.fem.pressing.press import Press
from papilla.fem.reduction.reduced import ReducedFinger
from papilla.finger import Finger
from papilla.specimen import Specimen
from papilla.view.render import Part, View, draw, fitted, framed, use_offscreen_window
from papilla.view.section import Section, contact_frame, contact_outline, cut, half_skin, specimen_solid
from papilla.view.style import DIVERGING, INK, MUTED, diverging_bar, literal, mark_gauge, nice_limit, titled

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
