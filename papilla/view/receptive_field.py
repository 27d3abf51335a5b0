"""What a gauge feels of a load anywhere on the skin, as a picture of the skin from above."""

import numpy as np
import pyvista as pv
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from papilla.errors import InputError
from papilla.fem.fields import ReceptiveFields
from papilla.fem.reduction.gauges import gauge_frame
from papilla.finger import Finger
from papilla.mesh.surfaces import surfaces_of
from papilla.units import to_microstrain
from papilla.view.render import Part, View, fitted, render
from papilla.view.style import DIVERGING, GAUGE_COLOR, INK, MUTED, literal, nice_limit, styled
from papilla.view.window import use_offscreen_window

NEWTON_PER_MN = 1e-3
PIXELS_PER_MM = 18.0
ELEVATION = 62.0

LIFTED = 1.003
"""Factor that moves lines off the skin, which would else hide them in places."""


def receptive_figure(fields: ReceptiveFields, finger: Finger, gauge_name: str) -> Figure:
    """The skin coloured by strain of one gauge per force of a small load, in µε per mN along the inward normal.

    Raises `InputError` for a gauge that the finger does not have.
    """
    names = [gauge.name for gauge in finger.gauges]
    if gauge_name not in names:
        raise InputError(f"{finger.name} has no gauge {gauge_name!r}; its gauges are {', '.join(names)}")
    skin = _skin(fields, names.index(gauge_name))
    values = skin["sensitivity"]
    limit = nice_limit(float(np.abs(values).max()))
    rendered = use_offscreen_window()
    view = fitted(View(ELEVATION if rendered else 90.0, 0.0), skin.points)
    lines = _contours(skin, limit)
    with styled(8, 8 * view.height_mm / view.width_mm + 1.75) as figure:
        height = figure.get_figheight()
        axes = figure.add_axes((0.02, 0.85 / height, 0.96, (height - 1.75) / height))
        if rendered:
            parts = [
                Part(skin, scalars="sensitivity", limit=limit, cmap=DIVERGING),
                Part(lines, INK, opacity=0.35, lit=False),
            ]
            axes.imshow(render(parts, view, PIXELS_PER_MM), extent=view.extent, interpolation="antialiased")
        else:
            x, y = view.project(skin.points).T
            triangles = skin.regular_faces
            axes.tripcolor(x, y, triangles, values, shading="gouraud", cmap=DIVERGING, vmin=-limit, vmax=limit)
        _mark_gauges(axes, view, finger, gauge_name)
        axes.set(xlim=view.extent[:2], ylim=view.extent[2:], aspect="equal")
        axes.axis("off")
        _bar(figure, limit)
        _titles(figure, skin, gauge_name)
    return figure


def _skin(fields: ReceptiveFields, number: int) -> pv.PolyData:
    sensitivity = np.zeros(len(fields.mesh.points))
    sensitivity[fields.vertices] = to_microstrain(fields.strain_per_newton[number]) * NEWTON_PER_MN
    skin = pv.PolyData.from_regular_faces(fields.mesh.points, fields.mesh.boundaries["skin"])
    skin.point_data["sensitivity"] = sensitivity
    return skin.remove_unused_points()


def _contours(skin: pv.PolyData, limit: float) -> pv.PolyData:
    """Lines of equal sensitivity, a fifth of the colour bar's end apart."""
    lines = skin.contour((np.arange(-0.9, 1.0, 0.2) * limit).tolist(), scalars="sensitivity")
    lines.points = lines.points * LIFTED
    return lines


def _mark_gauges(axes: Axes, view: View, finger: Finger, gauge_name: str) -> None:
    """Each gauge's grid, moved out to the skin; the one in question in colour."""
    surfaces = surfaces_of(finger)
    for gauge in finger.gauges:
        frame = gauge_frame(finger, gauge, surfaces["interface"])
        half = gauge.length_mm / 2 * frame.along
        ends = view.project(surfaces["skin"].project(np.stack([frame.site - half, frame.site + half])))
        chosen = gauge.name == gauge_name
        axes.plot(*ends.T, color=INK if chosen else MUTED, linewidth=7, solid_capstyle="butt")
        axes.plot(*ends.T, color=GAUGE_COLOR if chosen else "white", linewidth=4.5, solid_capstyle="butt")
        x, y = ends.mean(axis=0)
        weight = "bold" if chosen else "normal"
        axes.text(x, y - 1.0, literal(gauge.name), ha="center", va="top", weight=weight, color=INK if chosen else MUTED)


def _bar(figure: Figure, limit: float) -> None:
    height = figure.get_figheight()
    axes = figure.add_axes((0.25, 0.55 / height, 0.5, 0.13 / height))
    shades = ScalarMappable(Normalize(-limit, limit), colormaps[DIVERGING])
    bar = figure.colorbar(shades, cax=axes, orientation="horizontal", ticks=np.linspace(-limit, limit, 5))
    bar.set_label("gauge strain per force of a small load (µε per mN)")
    bar.outline.set_linewidth(0.5)


def _titles(figure: Figure, skin: pv.PolyData, gauge_name: str) -> None:
    height = figure.get_figheight()
    values = skin["sensitivity"]
    best = skin.points[np.abs(values).argmax()]
    figure.text(0.04, 1 - 0.4 / height, f"Receptive field of gauge {literal(gauge_name)}", fontsize=14, weight="bold")
    peak = f"{values[np.abs(values).argmax()]:+.3g} µε/mN at x {best[0]:.3g}, y {best[1]:.3g} mm".replace("-", "−")
    facts = f"strongest {peak}; red: a load stretches the gauge, blue: it shortens it"
    figure.text(0.04, 1 - 0.68 / height, facts, fontsize=9.5, color=MUTED)
