"""Speed against error: what a thousand scenes cost on each rung, element and mesh, and the front of the best buys."""

from collections.abc import Sequence
from dataclasses import dataclass

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from papilla.view.style import ACCENTS, INK, MUTED, plain_log, styled, titled

MARKERS = {"hertz": "^", "contact": "o", "finite": "s"}

PERCENT = 100.0

LABEL_PLACES = ((-10, -8, "right"), (9, 6, "left"), (0, 10, "center"))
"""Where the sizes of the first, second, third element are written: offset in points, and alignment."""


@dataclass(frozen=True)
class Price:
    """A point of the plot: seconds of set-up and 1000 scenes, error of S_d (a fraction), and what it belongs to."""

    rung: str
    element: str
    size_mm: float
    seconds: float
    error: float
    on_front: bool


def price_figure(prices: Sequence[Price], reference_mm: float) -> Figure:
    """Error of S_d in % against seconds, both logarithmic, a curve a rung and element over its meshes.

    Prices without an error, as that of the reference, are left out.
    """
    shown = [price for price in prices if price.error > 0]
    elements = list(dict.fromkeys(price.element for price in shown))
    colors = dict(zip(elements, ACCENTS, strict=False))
    with styled(8.2, 5.2) as figure:
        axes = figure.add_axes((0.09, 0.115, 0.88, 0.735))
        for rung, marker in MARKERS.items():
            for element in elements:
                place = LABEL_PLACES[elements.index(element)]
                belong = [price for price in shown if (price.rung, price.element) == (rung, element)]
                _curve(axes, belong, marker, colors[element], place)
        front = sorted((price for price in shown if price.on_front), key=lambda price: price.seconds)
        seconds, errors = [price.seconds for price in front], [PERCENT * price.error for price in front]
        axes.step(seconds, errors, where="post", color=INK, linewidth=1.1, linestyle=(0, (1, 1.5)), zorder=1)
        axes.scatter(seconds, errors, s=190, facecolors="none", edgecolors=INK, linewidths=1.1, zorder=4)
        axes.set(xscale="log", yscale="log")
        axes.set(xlabel="set-up and 1000 scenes (s)", ylabel=r"worst error of $S_d$, 10-100 gf (%)")
        axes.margins(0.09)
        plain_log(axes.xaxis)
        plain_log(axes.yaxis)
        _legend(axes, {price.rung for price in shown}, colors)
        note = f"Numbers: element size (mm). Errors: to rung contact, Taylor-Hood, {reference_mm:g} mm"
        if any(price.rung == "finite" for price in shown):
            note += "; finite: to itself on a finer mesh"
        titled(figure, _message(front), note)
    return figure


def _curve(axes: Axes, prices: list[Price], marker: str, color: str, place: tuple[float, float, str]) -> None:
    ordered = sorted(prices, key=lambda price: -price.size_mm)
    seconds, errors = [price.seconds for price in ordered], [PERCENT * price.error for price in ordered]
    face = color if marker == MARKERS["contact"] else "white"
    axes.plot(
        seconds, errors, marker=marker, markersize=7, color=color, linewidth=1.3, zorder=3, markerfacecolor=face,
        markeredgewidth=1.4,
    )  # fmt: skip
    right, up, align = place
    for price, x, y in zip(ordered, seconds, errors, strict=True):
        axes.annotate(
            f"{price.size_mm:g}", (x, y), xytext=(right, up), textcoords="offset points", ha=align, fontsize=8.5,
            color=color, zorder=5,
        )  # fmt: skip


def _message(front: list[Price]) -> str:
    best = min(front, key=lambda price: price.error)
    return (
        f"{PERCENT * best.error:.2g} % in $S_d$ for {best.seconds:.2g} s a thousand presses: "
        f"{best.rung}, {best.element}, {best.size_mm:g} mm"
    )


def _legend(axes: Axes, rungs: set[str], colors: dict[str, str]) -> None:
    handles = [
        Line2D([], [], color=MUTED, marker=marker, linestyle="none", markersize=7, label=f"rung {rung}",
               markerfacecolor=MUTED if rung == "contact" else "white", markeredgewidth=1.4)
        for rung, marker in MARKERS.items() if rung in rungs
    ]  # fmt: skip
    handles += [Line2D([], [], color=color, linewidth=2.2, label=element) for element, color in colors.items()]
    handles.append(
        Line2D([], [], color=INK, linestyle=(0, (1, 1.5)), marker="o", markersize=11, markerfacecolor="none",
               label="Pareto front of hertz and contact")
    )  # fmt: skip
    axes.legend(handles=handles, fontsize=8.5, ncols=1, loc="best", frameon=True, facecolor="white", framealpha=0.9)
