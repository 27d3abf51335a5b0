"""The figure of `papilla bench`: speed against error."""

from collections.abc import Mapping, Sequence
from itertools import cycle

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from papilla.core.units import PER_CENT
from papilla.view.style import (
    ACCENT_COLORS,
    INK_COLOR,
    MUTED_COLOR,
    THICK_PT,
    THIN_PT,
    plain_log,
    styled,
    titled,
    with_formula,
)

PRICE_IN = 8.2, 5.2
"""Inches of the figure of speed against error."""
FIDELITY_MARKERS = {"hertz": "^", "contact": "o", "finite": "s"}
MARK_SIZE_PT, RING_SIZE_PT, AXIS_ROOM = 7, 11, 0.09
"""Sizes in points of the mark of a mesh, and of the ring around a best one; room around all of
them, as a share of the axes."""
LABEL_PLACES = ((-10, -8, "right"), (9, 6, "left"), (0, 10, "center"))
"""Position of the size labels of the first, second and third element: offset in points, and alignment."""
PRICED_PRESSES = 1000
"""Presses whose cost is drawn; from as many seconds on, an axis has the powers of ten alone."""


def price_figure(rows: Sequence[Mapping], reference_mm: float) -> Figure:
    """Error of S_d in % against seconds, both logarithmic, a curve over the meshes for each fidelity and element.

    rows : fidelity, element, size_mm, seconds_thousand (set-up and 1000 scenes), error_sd (a fraction), pareto. Rows
    without an error, such as the reference, are left out.
    """
    drawn = [row for row in rows if row["error_sd"] > 0]
    colors = dict(zip(dict.fromkeys(row["element"] for row in drawn), ACCENT_COLORS, strict=False))
    with styled(*PRICE_IN) as figure:
        axes = figure.subplots()
        for fidelity, marker in FIDELITY_MARKERS.items():
            for place, (element, color) in zip(cycle(LABEL_PLACES), colors.items(), strict=False):
                belong = [row for row in drawn if (row["fidelity"], row["element"]) == (fidelity, element)]
                _curve(axes, belong, marker, color, place)
        front = sorted((row for row in drawn if row["pareto"]), key=lambda row: row["seconds_thousand"])
        ring: dict = {"marker": "o", "markersize": RING_SIZE_PT, "markerfacecolor": "none", "markeredgewidth": THIN_PT}
        (best,) = axes.step(*_points(front), where="post", color=INK_COLOR, linestyle=":", zorder=1, **ring)
        best.set_label("Pareto front of hertz and contact")
        axes.set(
            xscale="log",
            yscale="log",
            xlabel="set-up and 1000 scenes (s)",
            ylabel=r"worst error of $S_d$, 10-100 gf (%)",
        )
        with_formula(axes.yaxis.label)
        axes.margins(AXIS_ROOM)
        plain_log(axes.xaxis, *[(1.0,)] * (max(row["seconds_thousand"] for row in drawn) > PRICED_PRESSES))
        plain_log(axes.yaxis)
        fidelities = {row["fidelity"] for row in drawn}
        marks = [
            Line2D([], [], color=MUTED_COLOR, marker=marker, linestyle="none", markersize=MARK_SIZE_PT,
                   label=f"fidelity {fidelity}",
                   markerfacecolor=MUTED_COLOR if fidelity == "contact" else "white", markeredgewidth=THICK_PT)
            for fidelity, marker in FIDELITY_MARKERS.items() if fidelity in fidelities
        ]  # fmt: skip
        lines = [Line2D([], [], color=color, linewidth=THICK_PT, label=element) for element, color in colors.items()]
        axes.legend(handles=[*marks, *lines, best])
        note = f"Numbers: element size (mm). Errors: to fidelity contact, Taylor-Hood, {reference_mm:g} mm"
        if "finite" in fidelities:
            note += "; finite: to itself on a finer mesh"
        least = min(front, key=lambda row: row["error_sd"])
        price = (
            f"{PER_CENT * least['error_sd']:.2g} % in $S_d$ for {least['seconds_thousand']:.2g} s a thousand presses"
        )
        titled(figure, f"{price}: {least['fidelity']}, {least['element']}, {least['size_mm']:g} mm", note, formula=True)
    return figure


def _points(rows: Sequence[Mapping]) -> tuple[list[float], list[float]]:
    """Seconds, and errors in %."""
    return [priced["seconds_thousand"] for priced in rows], [PER_CENT * priced["error_sd"] for priced in rows]


def _curve(axes: Axes, rows: list[Mapping], marker: str, color: str, place: tuple[float, float, str]) -> None:
    ordered = sorted(rows, key=lambda row: -row["size_mm"])
    seconds, errors = _points(ordered)
    face = color if marker == FIDELITY_MARKERS["contact"] else "white"
    style: dict = {"marker": marker, "markersize": MARK_SIZE_PT, "markerfacecolor": face, "markeredgewidth": THICK_PT}
    axes.plot(seconds, errors, color=color, **style)
    right, up, align = place
    for row, x, y in zip(ordered, seconds, errors, strict=True):
        axes.annotate(
            f"{row['size_mm']:g}", (x, y), xytext=(right, up), textcoords="offset points", ha=align, fontsize="small",
            color=color,
        )  # fmt: skip
