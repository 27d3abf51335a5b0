"""Draws a `Picture` in the style of all of papilla's pictures."""

from itertools import count

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from papilla.studies.figures.picture import Curve, Panel, Picture, Shade, Table
from papilla.view.style import (
    ACCENTS,
    DIVERGING,
    FAINT,
    INK,
    MUTED,
    NARROW_IN,
    SEQUENTIAL,
    THICK,
    THIN,
    literal,
    plain_log,
    styled,
    svg,
)

WIDTH_IN, PANEL_IN, ROW_IN = 8.6, 2.5, 0.27
"""Width of a figure; height of a row of panels and of a row of a table, in inches."""
LEGEND_MARK, TITLE_LINE = 6, 110
"""Width of a curve's mark in a legend, and of the line of a wide panel's title, in letters."""
ARROWS = 14
"""Number of phase arrows along each axis of a map."""


def as_svg(picture: Picture, *, narrow: bool = False) -> bytes:
    """The SVG file of a picture; the narrow one has its panels one below the other."""
    return svg(draw(picture, narrow=narrow))


def draw(picture: Picture, *, narrow: bool = False) -> Figure:
    """A figure with the picture's panels, or with its table."""
    if picture.table is not None and not picture.panels:
        return _table(picture.table)
    columns = 1 if narrow else picture.columns
    rows = -(-len(picture.panels) // columns)
    height = 3.9 if rows == 1 and columns < 3 else PANEL_IN * rows + 0.3
    with styled(NARROW_IN if narrow else WIDTH_IN, height) as figure:
        figure.set_layout_engine("constrained")
        every = figure.subplots(rows, columns, squeeze=False).ravel()
        for axes, panel in zip(every, picture.panels, strict=False):
            _panel(figure, axes, panel, wide=columns == 1 and not narrow)
        for axes in every[len(picture.panels) :]:
            axes.set_axis_off()
        return figure


def _panel(figure: Figure, axes: Axes, panel: Panel, wide: bool) -> None:
    axes.set_title(literal(panel.title), fontsize="small")
    axes.set_xlabel(literal(panel.x_label), fontsize="small")
    axes.set_ylabel(literal(panel.y_label), fontsize="small")
    axes.tick_params(colors=MUTED, labelsize="small")
    if panel.shade is not None:
        _shade(figure, axes, panel.shade, "y" in panel.log)
    colors, bars = count(), [one for one in panel.curves if one.look == "bars"]
    for one in panel.curves:
        own = (next(colors) if one.origin == "papilla" else None) if one.color is None else one.color
        color = INK if own is None or own < 0 else ACCENTS[own % len(ACCENTS)]
        if one.look == "bars":
            width = 0.8 / len(bars)
            axes.bar(one.x + (bars.index(one) - (len(bars) - 1) / 2) * width, one.y, width, color=color,
                     yerr=one.spread, ecolor=MUTED, label=literal(one.label))  # fmt: skip
        else:
            _curve(axes, one, color)
    for name, axis in (("x", axes.xaxis), ("y", axes.yaxis)):
        if name in panel.log:
            axes.set(**{f"{name}scale": "log"})
            plain_log(axis)
    if panel.names:
        axes.set_xticks(np.arange(len(panel.names)), [literal(name) for name in panel.names])
    axes.set_xlim(panel.x_range) if panel.x_range else None
    axes.set_ylim(panel.y_range) if panel.y_range else None
    if panel.even:
        axes.set_aspect("equal")
    labels = [one.label for one in panel.curves if one.label]
    if labels:
        look = {"fontsize": "x-small"}
        beside_title = wide and len("".join((panel.title, *labels))) + LEGEND_MARK * len(labels) < TITLE_LINE
        if beside_title:
            axes.legend(loc="lower right", bbox_to_anchor=(1, 1), ncols=len(labels), borderaxespad=0.2, **look)
        else:
            axes.legend(loc="best", **look)


def _curve(axes: Axes, one: Curve, color: str) -> None:
    label = literal(one.label)
    if one.look == "impulses":
        axes.vlines(one.x, 0, one.y, color=color, label=label)
        return
    looks: dict[str, dict] = {
        "line": {},
        "dashed": {"linestyle": "--"},
        "points": {"linestyle": "", "marker": "o"},
    }
    look = looks[one.look] | {"color": color, "label": label}
    if one.origin == "printed" and one.look == "points":
        look |= {"marker": "D", "markersize": 6, "markerfacecolor": "white", "markeredgewidth": THICK, "zorder": 4}
    if one.spread is None:
        axes.plot(one.x, one.y, **look)
    else:
        axes.errorbar(one.x, one.y, yerr=one.spread, elinewidth=THIN, **look)


def _shade(figure: Figure, axes: Axes, shade: Shade, log_y: bool) -> None:
    greatest = float(np.nanmax(np.abs(shade.value))) if shade.top is None else shade.top
    low = -greatest if shade.signed else min(0.0, float(np.nanmin(shade.value)))
    drawn = axes.pcolormesh(
        shade.x, shade.y, shade.value, cmap=colormaps[DIVERGING if shade.signed else SEQUENTIAL],
        vmin=low, vmax=greatest, shading="auto", rasterized=True,
    )  # fmt: skip
    axes.grid(False)
    bar = figure.colorbar(drawn, ax=axes, pad=0.01)
    bar.set_label(literal(shade.label), fontsize="small")
    bar.ax.tick_params(labelsize="x-small")
    bar.outline.set_visible(False)
    if shade.over is not None and shade.over.any() and not shade.over.all():
        axes.contour(shade.x, shade.y, shade.over.astype(float), levels=[0.5], colors=INK, linewidths=THICK)
    if shade.phase is not None:
        _arrows(axes, shade, log_y)


def _arrows(axes: Axes, shade: Shade, log_y: bool) -> None:
    """Arrows of phase: right in phase, left in antiphase, down where the first channel leads by 90 degrees."""
    assert shade.phase is not None
    spaced = np.geomspace if log_y else np.linspace
    rows = np.searchsorted(shade.y, spaced(shade.y[0], shade.y[-1], ARROWS + 2)[1:-1])
    columns = np.linspace(0, len(shade.x) - 1, ARROWS + 2).astype(int)[1:-1]
    at = np.ix_(np.clip(rows, 0, len(shade.y) - 1), columns)
    x, y = np.meshgrid(shade.x[at[1]], shade.y[at[0]])
    shown = np.ones(x.shape, bool) if shade.over is None else shade.over[at]
    angle = shade.phase[at][shown]
    axes.quiver(x[shown], y[shown], np.cos(angle), -np.sin(angle), color=INK, pivot="mid", scale=26, width=0.0035)


def _table(table: Table) -> Figure:
    """The table as a picture: heads above a line, a row each."""
    with styled(WIDTH_IN, ROW_IN * (len(table.rows) + 2.2)) as figure:
        axes = figure.add_axes((0.02, 0.02, 0.96, 0.96))
        axes.set_axis_off()
        cells = [[cell if isinstance(cell, str) else f"{cell:.4g}" for cell in row] for row in table.rows]
        longest = [max(len(row[k]) for row in (table.heads, *cells)) + 2 for k in range(len(table.heads))]
        left = np.concatenate([[0.0], np.cumsum(longest)]) / sum(longest)
        size = min(9.0, 9.0 * 100 / sum(longest))
        for number, row in enumerate((table.heads, *cells)):
            y = 1 - (number + 0.7) / (len(cells) + 1.4)
            for x, cell in zip(left, row, strict=False):
                axes.text(x, y, literal(cell), fontsize=size, va="center", weight="bold" if number == 0 else "normal")
            axes.axhline(y - 0.5 / (len(cells) + 1.4), color=INK if number == 0 else FAINT, linewidth=THIN)
        axes.set(xlim=(0, 1), ylim=(0, 1))
        return figure
