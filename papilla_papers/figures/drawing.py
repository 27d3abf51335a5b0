"""Draws a `Picture` in the style of all of papilla's pictures."""

from itertools import count

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.transforms import Bbox

from papilla.view import style
from papilla_papers.figures.picture import Curve, Panel, Picture, PrintedTable, Shade

WIDTH_IN, PANEL_IN, ROW_IN = 8.6, 2.5, 0.27
"""Width of a figure; height of a row of panels and of a row of a table, in inches."""
NARROW_COLUMNS = 3
"""From this number of columns on, panels are narrow, and need no more height than others."""
LEGEND_MARK, TITLE_LINE = 6, 110
"""Width of a curve's mark in a legend, and of the line of a wide panel's title, in letters."""
PHASE_ARROWS = 14
"""Number of phase arrows along each axis of a map."""
BARS_WIDTH = 0.8
"""Width of all bars at one place, over the distance of two places."""
CURVE_LOOKS: dict[str, dict] = {
    "line": {},
    "dashed": {"linestyle": "--"},
    "points": {"linestyle": "", "marker": "o"},
    "printed": {"linestyle": "", "marker": "D", "markerfacecolor": "white", "markeredgewidth": style.THICK_PT},
}


def as_svg(picture: Picture, *, narrow: bool = False) -> bytes:
    """The SVG file of a picture; the narrow one has its panels one below the other."""
    return style.svg(draw(picture, narrow=narrow))


def draw(picture: Picture, *, narrow: bool = False) -> Figure:
    """A figure with the picture's panels, or with its table."""
    if picture.table is not None and not picture.panels:
        return _table(picture.table)
    columns = 1 if narrow else picture.columns
    rows = -(-len(picture.panels) // columns)
    with style.styled(
        style.NARROW_IN if narrow else WIDTH_IN, PANEL_IN * (rows + 0.5 * (columns < NARROW_COLUMNS))
    ) as figure:
        every = figure.subplots(rows, columns, squeeze=False).ravel()
        for axes, panel in zip(every, picture.panels, strict=False):
            _panel(figure, axes, panel, wide=columns == 1 and not narrow)
        for axes in every[len(picture.panels) :]:
            axes.set_axis_off()
        return figure


def _panel(figure: Figure, axes: Axes, panel: Panel, wide: bool) -> None:
    axes.set_title(panel.title, fontsize="small", wrap=True)
    axes.set_xlabel(panel.x_label, fontsize="small")
    axes.set_ylabel(panel.y_label, fontsize="small")
    axes.tick_params(colors=style.MUTED_COLOR, labelsize="small")
    if panel.shade is not None:
        _shade(figure, axes, panel.shade, "y" in panel.log)
    colors, bars = count(), [curve for curve in panel.curves if curve.look == "bars"]
    for curve in panel.curves:
        number = (next(colors) if curve.origin == "papilla" else None) if curve.color is None else curve.color
        accents = style.ACCENT_COLORS
        color = style.INK_COLOR if number is None or number < 0 else accents[number % len(accents)]
        if curve.look == "bars":
            width = BARS_WIDTH / len(bars)
            begin = curve.x + (bars.index(curve) - (len(bars) - 1) / 2) * width
            look = {"color": color, "ecolor": style.MUTED_COLOR, "label": style.named(curve.label)}
            axes.bar(begin, curve.y, width, yerr=curve.spread, **look)
        else:
            _curve(axes, curve, color)
    for name, axis in (("x", axes.xaxis), ("y", axes.yaxis)):
        if name in panel.log:
            axes.set(**{f"{name}scale": "log"})
            style.plain_log(axis)
    if panel.names:
        axes.set_xticks(np.arange(len(panel.names)), panel.names)
    axes.set(xlim=panel.x_range, ylim=panel.y_range, aspect="equal" if panel.even else "auto")
    if labels := [curve.label for curve in panel.curves if curve.label]:
        beside_title = wide and len("".join((panel.title, *labels))) + LEGEND_MARK * len(labels) < TITLE_LINE
        place = {"loc": "lower right", "bbox_to_anchor": (1, 1), "ncols": len(labels)} if beside_title else {}
        axes.legend(fontsize="x-small", **place)


def _curve(axes: Axes, curve: Curve, color: str) -> None:
    label = style.named(curve.label)
    if curve.look == "impulses":
        axes.vlines(curve.x, 0, curve.y, color=color, label=label)
        return
    look = CURVE_LOOKS["printed" if curve.origin == "printed" and curve.look == "points" else curve.look]
    if curve.spread is None:
        axes.plot(curve.x, curve.y, color=color, label=label, **look)
    else:
        axes.errorbar(curve.x, curve.y, yerr=curve.spread, elinewidth=style.THIN_PT, color=color, label=label, **look)


def _shade(figure: Figure, axes: Axes, shade: Shade, log_y: bool) -> None:
    low = min(0.0, float(np.nanmin(shade.value)))
    drawn = axes.pcolormesh(
        shade.x,
        shade.y,
        shade.value,
        cmap=style.SEQUENTIAL_COLORS,
        vmin=low,
        vmax=shade.top,
        shading="auto",
        rasterized=True,
    )
    axes.grid(False)
    bar = figure.colorbar(drawn, ax=axes)
    bar.set_label(shade.label, fontsize="small")
    bar.ax.tick_params(labelsize="x-small")
    bar.outline.set_visible(False)
    if shade.over is not None and shade.over.any() and not shade.over.all():
        axes.contour(
            shade.x, shade.y, shade.over.astype(float), levels=[0.5], colors=style.INK_COLOR, linewidths=style.THICK_PT
        )
    if shade.phase is not None:
        _arrows(axes, shade, log_y)


def _arrows(axes: Axes, shade: Shade, log_y: bool) -> None:
    """Arrows of phase: right in phase, left in antiphase, down where the first channel leads by 90 degrees."""
    assert shade.phase is not None
    spaced = np.geomspace if log_y else np.linspace
    rows = np.searchsorted(shade.y, spaced(shade.y[0], shade.y[-1], PHASE_ARROWS + 2)[1:-1])
    columns = np.linspace(0, len(shade.x) - 1, PHASE_ARROWS + 2).astype(int)[1:-1]
    at = np.ix_(np.clip(rows, 0, len(shade.y) - 1), columns)
    x, y = np.meshgrid(shade.x[at[1]], shade.y[at[0]])
    inside = np.ones(x.shape, bool) if shade.over is None else shade.over[at]
    angle = shade.phase[at][inside]
    axes.quiver(x[inside], y[inside], np.cos(angle), -np.sin(angle), color=style.INK_COLOR, pivot="mid")


def _table(table: PrintedTable) -> Figure:
    """The table as a picture: heads above a line, a row each."""
    cells = [[cell if isinstance(cell, str) else f"{cell:.4g}" for cell in row] for row in table.rows]
    with style.styled(WIDTH_IN, ROW_IN * (len(cells) + 2)) as figure:
        figure.set_layout_engine("none")  # The table fills the figure
        axes = figure.add_axes((0, 0, 1, 1))
        axes.set_axis_off()
        heads = list(table.heads)
        drawn = axes.table(cells, colLabels=heads, cellLoc="left", colLoc="left", edges="horizontal", bbox=Bbox.unit())
        drawn.auto_set_column_width(range(len(heads)))
        return figure
