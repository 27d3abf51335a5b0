"""Response of a gauge to a load anywhere on the skin, as a picture of the skin from above."""

import numpy as np
import pyvista as pv
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from papilla.core.errors import InputError
from papilla.core.units import to_microstrain
from papilla.fem.fields import ReceptiveFields
from papilla.fem.reduction.gauges import gauge_frame
from papilla.mesh.body import surfaces_of
from papilla.model.finger import Finger
from papilla.view import style
from papilla.view.render import AROUND_IN, MARGIN_MM, PaintedSurface, View, draw, fitted, framed, use_offscreen_window

NEWTON_PER_MN = 1e-3
MAP_ELEVATION_DEG = 62.0
FIGURE_IN = 8.0  # Width of a picture of one gauge
MAPS_A_ROW, SMALL_MAPS = (5, 2.9), (2, 2.3)  # Maps beside each other, and the width of one, inches
SENSITIVITY_STEP = 0.2  # Distance of the lines of equal sensitivity, as a share of the colour bar's end
BAR_LABEL = "gauge strain per force of a small load (µε per mN)"
CHOSEN_COLORS, OTHER_COLORS = (style.GAUGE_COLOR, style.INK_COLOR), ("white", style.MUTED_COLOR)
"""Colours of the grid and the edge of the gauge that a picture is about, and of others."""
LIFT_FACTOR = 1.003  # Factor that moves lines off the skin, which would hide parts of them


def receptive_figure(fields: ReceptiveFields, finger: Finger, gauge_name: str) -> Figure:
    """The skin coloured by strain of one gauge per force of a small load, in µε per mN along the inward normal.

    Raises `InputError` for a gauge that the finger does not have.
    """
    names = [gauge.name for gauge in finger.gauges]
    if gauge_name not in names:
        raise InputError(f"{finger.name} has no gauge {gauge_name!r}; its gauges are {', '.join(names)}")
    skin = _skin(fields, names.index(gauge_name))
    values = skin["sensitivity"]
    limit = style.nice_limit(float(np.abs(values).max()))
    rendered = use_offscreen_window()
    view = fitted(View(MAP_ELEVATION_DEG if rendered else 90.0, 0.0), skin.points)
    with framed(view, FIGURE_IN) as (figure, (axes,)):
        if rendered:
            lines = PaintedSurface(_contours(skin, limit), style.INK_COLOR, opacity=0.35, lit=False)
            draw(axes, [PaintedSurface(skin, scalars="sensitivity", limit=limit), lines], view)
        else:
            x, y = view.project(skin.points).T
            axes.tripcolor(x, y, skin.regular_faces, values, **style.signed_shades(limit))
        _mark_gauges(axes, view, finger, gauge_name)
        style.diverging_bar(axes, limit, BAR_LABEL)
        strongest = np.abs(values).argmax()
        x, y, _ = skin.points[strongest]
        peak = f"{values[strongest]:+.3g} µε/mN at x {x:.3g}, y {y:.3g} mm".replace("-", "−")
        facts = f"strongest {peak}; red: a load stretches the gauge, blue: it shortens it"
        style.titled(figure, f"Receptive field of gauge {style.named(gauge_name)}", facts, style.LARGE_PT)
    return figure


def receptive_fields_figure(fields: ReceptiveFields, finger: Finger, *, small: bool = False) -> Figure:
    """The receptive fields of all gauges on one scale, a map each over x and y of the skin, seen from above.

    small : for a telephone, with two maps beside each other instead of five.
    """
    skins = [_skin(fields, number) for number in range(len(finger.gauges))]
    limit = style.nice_limit(max(float(np.abs(skin["sensitivity"]).max()) for skin in skins))
    sites = _grids(finger)
    width, height = np.ptp(skins[0].points, axis=0)[:2] + 2 * MARGIN_MM
    most, inches = SMALL_MAPS if small else MAPS_A_ROW
    columns = min(len(skins), most)
    rows = -(-len(skins) // columns)
    with style.styled(inches * columns, inches * height / width * rows + AROUND_IN) as figure:
        grid = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
        for axes in grid.flat[len(skins) :]:
            axes.set_visible(False)
        for number, (axes, skin, gauge) in enumerate(zip(grid.flat, skins, finger.gauges, strict=False)):
            x, y = skin.points[:, :2].T
            shades = style.signed_shades(limit)
            axes.tripcolor(x, y, skin.regular_faces, skin["sensitivity"], rasterized=True, **shades)
            for site, ends in enumerate(sites):
                style.mark_gauge(axes, ends[:, :2], *(CHOSEN_COLORS if site == number else OTHER_COLORS))
            strongest = np.abs(skin["sensitivity"]).argmax()
            response = f"{skin['sensitivity'][strongest]:+.3g} µε/mN".replace("-", "−")
            axes.set_title(f"{style.named(gauge.name)}: {response}")
            axes.set(aspect="equal", xlabel="x (mm)")
        for axes in grid[:, 0]:
            axes.set_ylabel("y (mm)")
        style.diverging_bar(grid, limit, BAR_LABEL)
        facts = "the skin from above; red: a load there stretches the gauge, blue: it shortens it; above: the strongest"
        size = style.TITLE_PT if small else style.LARGE_PT
        style.titled(figure, f"Receptive fields of the {len(skins)} gauges", facts, size)
        if small:
            style.narrow(figure)
    return figure


def _skin(fields: ReceptiveFields, number: int) -> pv.PolyData:
    sensitivity = np.zeros(len(fields.mesh.points))
    sensitivity[fields.vertices] = to_microstrain(fields.strain_per_newton[number]) * NEWTON_PER_MN
    skin = pv.PolyData.from_regular_faces(fields.mesh.points, fields.mesh.boundaries["skin"])
    skin.point_data["sensitivity"] = sensitivity
    return skin.remove_unused_points()


def _contours(skin: pv.PolyData, limit: float) -> pv.PolyData:
    """Lines of equal sensitivity, none at zero."""
    levels = np.arange(SENSITIVITY_STEP / 2 - 1, 1, SENSITIVITY_STEP) * limit
    lines = skin.contour(levels.tolist(), scalars="sensitivity")
    lines.points = lines.points * LIFT_FACTOR
    return lines


def _grids(finger: Finger) -> list[np.ndarray]:
    """Ends (2, 3) of each gauge's grid, moved out to the skin."""
    surfaces, grids = surfaces_of(finger), []
    for gauge in finger.gauges:
        frame = gauge_frame(finger, gauge, surfaces["interface"])
        half = gauge.length_mm / 2 * frame.along
        grids.append(surfaces["skin"].project(np.stack([frame.site - half, frame.site + half])))
    return grids


def _mark_gauges(axes: Axes, view: View, finger: Finger, gauge_name: str) -> None:
    """Draw each gauge's grid on the skin; the selected one in colour."""
    for gauge, grid in zip(finger.gauges, _grids(finger), strict=True):
        ends = view.project(grid)
        colors, weight = (CHOSEN_COLORS, "bold") if gauge.name == gauge_name else (OTHER_COLORS, "normal")
        style.mark_gauge(axes, ends, *colors)
        x, y = ends.mean(axis=0)
        axes.text(x, y - 1.0, style.named(gauge.name), ha="center", va="top", weight=weight, color=colors[1])
