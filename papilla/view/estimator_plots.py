"""The comparison of wavelength estimators in one picture: share of answers, share of false ones, and errors."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from papilla.units import PER_CENT
from papilla.view.style import ACCENTS, FAINT, INK, MUTED, THIN, plain_log, styled, titled

PRODUCT, BESIDE = "pipeline", "STFT over the path"
RIGHT, FALSE = ACCENTS[0], ACCENTS[1]
LIMITS = (1e-3, 300.0)
"""Range of the errors shown, in %; errors beyond it are drawn at its end."""
PRODUCT_MARK = 7
"""Size in points of the pipeline's dots, which lie over the others."""
Rows = Sequence[Mapping]


def honesty_figure(rows: Rows) -> Figure:
    """One line per scene: shares of rows that the pipeline and a spectrum over the path answer rightly and falsely, and
    the median error in % of every method.

    rows : plain values of scene, method, kind, answered, false, median (fractions) and faults.
    """
    scenes = list(dict.fromkeys(row["scene"] for row in rows))
    places = np.arange(len(scenes))[::-1]
    height = 1.9 + 0.2 * len(scenes)
    with styled(10.2, height) as figure:
        grid = figure.subplots(1, 3, sharey=True, width_ratios=(1, 1, 1.7))
        figure.subplots_adjust(left=0.2, right=0.985, top=1 - 1.15 / height, bottom=0.75 / height, wspace=0.08)
        for axes, method in zip(grid, (PRODUCT, BESIDE), strict=False):
            _shares(axes, [row for row in rows if row["method"] == method], places)
            axes.set_title(method, fontsize=10)
        _errors(grid[2], rows, dict(zip(scenes, places.tolist(), strict=True)))
        grid[0].set_yticks(places, labels=scenes, fontsize="small")
        faulty = {row["scene"] for row in rows if row["faults"]}
        for label, scene in zip(grid[0].get_yticklabels(), scenes, strict=True):
            label.set_color(FALSE if scene in faulty else INK)
        grid[0].set_ylim(-0.7, len(scenes) - 0.3)
        titled(figure, _message(rows), "20 dB, 1 kHz, one gauge. Blue: ok and right; orange: ok and off by more than "
               "5 %, or without a line to find. Orange names miss a target")  # fmt: skip
    return figure


def _shares(axes: Axes, own: Rows, places) -> None:
    answered, false = (PER_CENT * np.nan_to_num([row[name] for row in own]) for name in ("answered", "false"))
    wrong = answered * false / PER_CENT
    axes.barh(places, answered - wrong, color=RIGHT, height=0.72)
    axes.barh(places, wrong, left=answered - wrong, color=FALSE, height=0.72)
    axes.set(xlim=(0, PER_CENT), xticks=(0, 25, 50, 75), xlabel="answered from 12 mm on (%)")
    axes.grid(axis="y", visible=False)


def _errors(axes: Axes, rows: Rows, places: Mapping[str, int]) -> None:
    """Dots of the median errors: the published methods in grey, every other one in its own colour."""
    single = dict.fromkeys(row["method"] for row in rows if row["kind"] != "published")
    colors = dict(zip(single, ACCENTS, strict=False))
    for method in reversed(dict.fromkeys(row["method"] for row in rows)):
        own = [row for row in rows if row["method"] == method and row["median"] == row["median"]]
        at = [min(max(PER_CENT * row["median"], LIMITS[0]), LIMITS[1]) for row in own]
        style: dict = {"color": colors[method], "label": method} if method in colors else {"color": FAINT}
        if method == PRODUCT:
            style["markersize"] = PRODUCT_MARK
        axes.plot(at, [places[row["scene"]] for row in own], "o", **style)
    axes.axvline(5, color=MUTED, linewidth=THIN, linestyle="--")
    axes.set(xscale="log", xlim=(LIMITS[0] / 1.3, LIMITS[1] * 1.3), xlabel="median error, ok or not (%)")
    plain_log(axes.xaxis, (1.0,))
    handles, _ = axes.get_legend_handles_labels()
    grey = Line2D([], [], color=FAINT, marker="o", linestyle="none", label="published")
    handles = [*handles[::-1], *([grey] if any(row["kind"] == "published" for row in rows) else [])]
    axes.legend(
        handles=handles,
        loc="lower center",
        bbox_to_anchor=(0.42, 1.0),
        ncols=4,
        columnspacing=1.0,
        handletextpad=0.2,
    )


def _message(rows: Rows) -> str:
    own = [row for row in rows if row["method"] == PRODUCT]
    clear = sum(not row["faults"] for row in own)
    return f"The pipeline holds its targets in {clear} of {len(own)} scenes"
