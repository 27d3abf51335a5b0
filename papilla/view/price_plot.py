"""Speed against error: cost of a thousand presses for each fidelity, element and mesh, and the best combinations."""

from collections.abc import Mapping, Sequence
from itertools import cycle

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from papilla.units import PER_CENT
from papilla.view.style import ACCENTS, INK, MUTED, THICK, THIN, plain_log, styled, titled

MARKERS = {"hertz": "^", "contact": "o", "finite": "s"}

MARK = 7
"""Size in points of the mark of a mesh, and of its key."""

LABEL_PLACES = ((-10, -8, "right"), (9, 6, "left"), (0, 10, "center"))
"""Position of the size labels of the first, second and third element: offset in points, and alignment."""


def price_figure(rows: Sequence[Mapping], reference_mm: float) -> Figure:
    """Error of S_d in % against seconds, both logarithmic, a curve over the meshes for each fidelity and element.

    rows : fidelity, element, size_mm, seconds_thousand (set-up and 1000 scenes), error_sd (a fraction), pareto. Rows
    without an error, such as the reference, are left out.
    """
    shown = [row for row in rows if row["error_sd"] > 0]
    colors = dict(zip(dict.fromkeys(row["element"] for row in shown), ACCENTS, strict=False))
    with styled(8.2, 5.2) as figure:
        axes = figure.add_axes((0.09, 0.115, 0.88, 0.735))
        for fidelity, marker in MARKERS.items():
            for place, (element, color) in zip(cycle(LABEL_PLACES), colors.items(), strict=False):
                belong = [row for row in shown if (row["fidelity"], row["element"]) == (fidelity, element)]
                _curve(axes, belong, marker, color, place)
        front = sorted((row for row in shown if row["pareto"]), key=lambda row: row["seconds_thousand"])
        axes.step(*_points(front), where="post", color=INK, linestyle=":", zorder=1)
        axes.scatter(*_points(front), s=190, facecolors="none", edgecolors=INK, linewidths=THIN, zorder=4)
        axes.set(xscale="log", yscale="log")
        axes.set(xlabel="set-up and 1000 scenes (s)", ylabel=r"worst error of $S_d$, 10-100 gf (%)")
        axes.margins(0.09)
        plain_log(axes.xaxis, (1.0,) if max(row["seconds_thousand"] for row in shown) > 1000 else (1.0, 2.0, 5.0))
        plain_log(axes.yaxis)
        fidelities = {row["fidelity"] for row in shown}
        _legend(axes, fidelities, colors)
        note = f"Numbers: element size (mm). Errors: to fidelity contact, Taylor-Hood, {reference_mm:g} mm"
        if "finite" in fidelities:
            note += "; finite: to itself on a finer mesh"
        titled(figure, _message(front), note)
    return figure


def _points(rows: Sequence[Mapping]) -> tuple[list[float], list[float]]:
    """Seconds, and errors in %."""
    return [row["seconds_thousand"] for row in rows], [PER_CENT * row["error_sd"] for row in rows]


def _curve(axes: Axes, rows: list[Mapping], marker: str, color: str, place: tuple[float, float, str]) -> None:
    ordered = sorted(rows, key=lambda row: -row["size_mm"])
    seconds, errors = _points(ordered)
    face = color if marker == MARKERS["contact"] else "white"
    style: dict = {"marker": marker, "markersize": MARK, "markerfacecolor": face, "markeredgewidth": THICK}
    axes.plot(seconds, errors, color=color, zorder=3, **style)
    right, up, align = place
    for row, x, y in zip(ordered, seconds, errors, strict=True):
        axes.annotate(
            f"{row['size_mm']:g}", (x, y), xytext=(right, up), textcoords="offset points", ha=align, fontsize="small",
            color=color, zorder=5,
        )  # fmt: skip


def _message(front: list[Mapping]) -> str:
    best = min(front, key=lambda row: row["error_sd"])
    return (
        f"{PER_CENT * best['error_sd']:.2g} % in $S_d$ for {best['seconds_thousand']:.2g} s a thousand presses: "
        f"{best['fidelity']}, {best['element']}, {best['size_mm']:g} mm"
    )


def _legend(axes: Axes, fidelities: set[str], colors: dict[str, str]) -> None:
    handles = [
        Line2D([], [], color=MUTED, marker=marker, linestyle="none", markersize=MARK, label=f"fidelity {fidelity}",
               markerfacecolor=MUTED if fidelity == "contact" else "white", markeredgewidth=THICK)
        for fidelity, marker in MARKERS.items() if fidelity in fidelities
    ]  # fmt: skip
    handles += [Line2D([], [], color=color, linewidth=THICK, label=element) for element, color in colors.items()]
    handles.append(
        Line2D([], [], color=INK, linestyle=":", marker="o", markersize=11, markerfacecolor="none",
               label="Pareto front of hertz and contact")
    )  # fmt: skip
    axes.legend(handles=handles, ncols=1, loc="best")
