"""The figure of the comparison of wavelength estimators, side by side over all scenes."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from papilla.core.units import PER_CENT
from papilla.view.style import ACCENT_COLORS, FAINT_COLOR, INK_COLOR, MUTED_COLOR, THIN_PT, plain_log, styled, titled

Rows = Sequence[Mapping]

PRODUCT, BESIDE = "pipeline", "STFT over the path"
RIGHT, FALSE = ACCENT_COLORS[:2]
LIMITS, BOUND = (1e-3, 300.0), 5.0
"""Range of the errors shown, in %, at whose ends errors beyond it are drawn; error that counts as false."""
WIDE_IN, SCENE_IN, AROUND_IN = 10.2, 0.2, 1.9
"""Inches of the comparison of estimators: width, height of a scene, and height of everything else."""
ERRORS, BAR_SHARE = 1.7, 0.72
"""Width of the panel of errors over that of one of shares; height of a bar over that of a scene."""

DOT = 7
"""Size in points of the mark of the pipeline."""


def honesty_figure(rows: Rows) -> Figure:
    """One line per scene: shares of rows that the pipeline and a spectrum over the path answer rightly and falsely, and
    the median error in % of every method.

    rows : plain values of scene, method, kind, answered, false, median (fractions) and faults.
    """
    scenes = list(dict.fromkeys(row["scene"] for row in rows))
    places = np.arange(len(scenes))[::-1]
    with styled(WIDE_IN, AROUND_IN + SCENE_IN * len(scenes)) as figure:
        left, middle, right = figure.subplots(1, 3, sharey=True, width_ratios=(1, 1, ERRORS))
        for axes, method in ((left, PRODUCT), (middle, BESIDE)):
            _shares(axes, [row for row in rows if row["method"] == method], places)
            axes.set_title(method, fontsize="medium")
        _errors(right, rows, dict(zip(scenes, places.tolist(), strict=True)))
        left.set_yticks(places, labels=scenes, fontsize="small")
        faulty = {row["scene"] for row in rows if row["faults"]}
        for label, scene in zip(left.get_yticklabels(), scenes, strict=True):
            label.set_color(FALSE if scene in faulty else INK_COLOR)
        left.set_ylim(-BAR_SHARE, len(scenes) - 1 + BAR_SHARE)
        own = [row for row in rows if row["method"] == PRODUCT]
        titled(
            figure, f"The pipeline holds its targets in {sum(not row['faults'] for row in own)} of {len(own)} scenes",
            f"20 dB, 1 kHz, one gauge. Blue: ok and right; orange: ok and off by more than {BOUND:g} %, or without a "
            "line to find. Orange names miss a target",
        )  # fmt: skip
    return figure


def _shares(axes: Axes, own: Rows, places) -> None:
    answered, false = (PER_CENT * np.nan_to_num([row[name] for row in own]) for name in ("answered", "false"))
    wrong = answered * false / PER_CENT
    axes.barh(places, answered - wrong, color=RIGHT, height=BAR_SHARE)
    axes.barh(places, wrong, left=answered - wrong, color=FALSE, height=BAR_SHARE)
    axes.set(xlim=(0, PER_CENT), xlabel="answered from 12 mm on (%)")
    axes.grid(axis="y", visible=False)


def _errors(axes: Axes, rows: Rows, places: Mapping[str, int]) -> None:
    """Dots of the median errors: the published methods in grey, every other one in its own colour."""
    single = dict.fromkeys(row["method"] for row in rows if row["kind"] != "published")
    colors = dict(zip(single, ACCENT_COLORS, strict=False))
    for method in reversed(dict.fromkeys(row["method"] for row in rows)):
        own = [row for row in rows if row["method"] == method and row["median"] == row["median"]]
        at = [min(max(PER_CENT * row["median"], LIMITS[0]), LIMITS[1]) for row in own]
        style: dict = {"color": colors[method], "label": method} if method in colors else {"color": FAINT_COLOR}
        if method == PRODUCT:
            style["markersize"] = DOT  # These dots lie over the others
        axes.plot(at, [places[row["scene"]] for row in own], "o", clip_on=False, **style)
    axes.axvline(BOUND, color=MUTED_COLOR, linewidth=THIN_PT, linestyle="--")
    axes.set(xscale="log", xlim=LIMITS, xlabel="median error, ok or not (%)")
    plain_log(axes.xaxis, (1.0,))
    handles, _ = axes.get_legend_handles_labels()
    grey = Line2D([], [], color=FAINT_COLOR, marker="o", linestyle="none", label="published")
    handles = [*handles[::-1], *([grey] if any(row["kind"] == "published" for row in rows) else [])]
    axes.legend(handles=handles, loc="lower center", bbox_to_anchor=(0.5, 1), ncols=-(-len(handles) // 2))
