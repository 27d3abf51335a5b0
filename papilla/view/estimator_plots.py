"""Plots of the comparison of wavelength estimators from its plain values: each title says what the picture shows.

Estimators with known velocity have a colour each; the many published ones are drawn as the range that they span.
"""

import math
from collections.abc import Mapping, Sequence
from itertools import cycle
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from papilla.view.style import ACCENTS, INK, plain_log, styled, titled

GROUPS = {"as printed": ("#94a3b8", "published, as printed"), "corrected": ("#d9a25f", "published, corrected")}
"""Families that are drawn as a range: colour and label."""
SCENES = {
    "const": "constant, about 100 mm/s",
    "act1": "active, 100 sin 2πt mm/s",
    "act2": "active, 197 sin 2π1.07t mm/s",
    "harsh": "active and harsh",
}
PLAIN_DB = 20.0
NEVER_MS = 1000.0  # Where times that never came are drawn: the scenes end then
WIDE_TICKS = (-6, 0, 10, 20, 30, 40)
_MARKS = ("o", "s", "D", "^", "v", "P", "X", "*")
Rows = Sequence[Mapping]


def all_plots(comparison: Mapping[str, Rows]) -> dict[str, Figure]:
    """Every plot that the rows allow, by a name for its file; `comparison` is what a comparison gives as plain values.

    Keys: scenes (estimator, family, scene, snr_dB, error, bound, outliers), steps, velocity, costs, targets.
    """
    scenes = comparison["scenes"]
    colors = colors_of(scenes)
    plots = {
        "error": error_against_snr(scenes, colors),
        "cost": error_against_cost(scenes, comparison["costs"], colors),
    }
    if len({row["snr_dB"] for row in _where(scenes, scene="const")}) > 1:
        plots["outliers"] = outliers_against_snr(scenes, colors)
    if comparison["steps"]:
        plots["steps"] = settling_times(comparison["steps"], comparison["targets"], colors)
    if comparison["velocity"]:
        plots["velocity"] = wrong_velocity(comparison["velocity"], colors)
    return plots


def colors_of(rows: Rows) -> dict[str, str]:
    """A colour for each estimator, the same in every plot."""
    single = dict.fromkeys(row["estimator"] for row in rows if row["family"] not in GROUPS)
    found = {name: ACCENTS[number % len(ACCENTS)] for number, name in enumerate(single)}
    return {row["estimator"]: GROUPS[row["family"]][0] for row in rows if row["family"] in GROUPS} | found


def error_against_snr(rows: Rows, colors: Mapping[str, str]) -> Figure:
    """RMS error in % against SNR in dB, a panel a scene; dashed are the Cramér-Rao bounds of the declared memories."""
    names = [name for name in SCENES if _where(rows, scene=name)]
    with styled(9.6, 7.6) as figure:
        grid = figure.subplots(2, 2, sharex=True, sharey=True, squeeze=False)
        figure.subplots_adjust(left=0.08, right=0.975, top=0.85, bottom=0.155, hspace=0.2, wspace=0.07)
        for axes, name in zip(grid.ravel(), SCENES, strict=True):
            axes.set_visible(name in names)
            here = _where(rows, scene=name)
            _curves(axes, here, "error", colors)
            _bounds(axes, here)
            axes.set_title(SCENES[name], fontsize=10, fontweight="normal")
            axes.set_yscale("log")
            plain_log(axes.yaxis, (1.0,))
        for axes in grid[-1]:
            axes.set_xlabel("SNR: power of the texture over noise of a sample (dB)")
        for axes in grid[:, 0]:
            axes.set_ylabel("RMS error of the wavelength (%)")
        _level_ticks(grid[0, 0], rows)
        detail = "0.6-3.0 mm, seeds never tuned on; a sample without an answer counts as 300 %"
        titled(figure, _error_message(rows), detail)
        _shared_legend(figure, grid[0, 0])
    return figure


def outliers_against_snr(rows: Rows, colors: Mapping[str, str]) -> Figure:
    """Share of samples in % whose wavelength is more than 10 % off, against SNR in dB, at constant speed."""
    here = _where(rows, scene="const")
    with styled(8.2, 5.0) as figure:
        axes = figure.add_axes((0.09, 0.25, 0.88, 0.58))
        _curves(axes, here, "outliers", colors)
        axes.set(xlabel="SNR (dB)", ylabel="samples more than 10 % off (%)", ylim=(-2, 102))
        lowest = _level_ticks(axes, here)[0]
        worst = {row["estimator"]: row["outliers"] for row in _where(here, snr_dB=lowest)}
        clean = sum(share == 0 for share in worst.values())
        message = f"At {lowest:g} dB {clean} of {len(worst)} estimators are never more than 10 % off"
        titled(figure, message, "constant speed; 0.6-3.0 mm")
        _shared_legend(figure, axes)
    return figure


def settling_times(rows: Rows, targets: Rows, colors: Mapping[str, str]) -> Figure:
    """Time in ms to stay within 5 % after each wavelength step: median (dot) to 90 % quantile (bar's end).

    targets : rows with measure "median_ms" and where, "1 to 4 mm", are drawn as lines.
    """
    kinds = list(dict.fromkeys((row["from_mm"], row["to_mm"]) for row in rows))
    names = list(dict.fromkeys(row["estimator"] for row in rows))[::-1]
    height = 1.9 + 0.26 * len(names)
    with styled(9.6, height) as figure:
        grid = figure.subplots(1, len(kinds), sharey=True, squeeze=False)[0]
        figure.subplots_adjust(left=0.27, right=0.975, top=1 - 1.0 / height, bottom=0.55 / height, wspace=0.06)
        for axes, kind in zip(grid, kinds, strict=True):
            here = {row["estimator"]: row for row in _where(rows, from_mm=kind[0], to_mm=kind[1])}
            for place, name in enumerate(names):
                median, most = (min(here[name][key], NEVER_MS) for key in ("median_ms", "p90_ms"))
                axes.plot([median, most], [place, place], color=colors[name], linewidth=3, solid_capstyle="round")
                mark = "o" if here[name]["median_ms"] < NEVER_MS else "x"
                axes.plot(median, place, mark, color=colors[name], markersize=6)
            axes.set(xscale="log", xlim=(8, 1.15 * NEVER_MS), xlabel="time to stay within 5 % (ms)")
            title = f"{kind[0]:g} to {kind[1]:g} mm"
            wanted = {row["high"] for row in _where(targets, measure="median_ms", where=title)}
            for limit in wanted:
                axes.axvline(limit, color=INK, linewidth=1, linestyle=(0, (4, 2)))
                title += f"; dashed: target, {limit:g} ms"
            axes.set_title(title, fontsize=10, fontweight="normal")
            plain_log(axes.xaxis, (1.0,))
        grid[0].set_yticks(range(len(names)), labels=names, fontsize=8.5)
        detail = "dot: median over seeds and step phases; bar: to 90 %; cross: not within 1 s"
        titled(figure, _step_message(rows, kinds), detail)
    return figure


def wrong_velocity(rows: Rows, colors: Mapping[str, str]) -> Figure:
    """RMS error in % in act1 at 20 dB, against the delay of the velocity in ms and against its error in %."""
    late = _where(rows, gain=1)
    wrong = _where(rows, delay_ms=0)
    gains = sorted({row["gain"] for row in wrong})
    with styled(9.6, 5.0) as figure:
        grid = figure.subplots(1, 2, sharey=True, width_ratios=(1.6, 1))
        figure.subplots_adjust(left=0.08, right=0.975, top=0.82, bottom=0.25, wspace=0.06)
        later = [{**row, "snr_dB": row["delay_ms"]} for row in late]
        faster = [{**row, "snr_dB": 100 * row["gain"] - 100} for row in wrong]
        for axes, shifted in zip(grid, (later, faster), strict=True):
            _curves(axes, shifted, "error", colors)
            axes.set_yscale("log")
            plain_log(axes.yaxis, (1.0,))
        grid[0].set(xlabel="velocity known late by (ms)", ylabel="RMS error of the wavelength (%)")
        grid[0].set_xticks(sorted({row["delay_ms"] for row in late}))
        grid[1].set(xlabel="velocity too large by (%)")
        grid[1].set_xticks([round(100 * gain - 100) for gain in gains])
        titled(figure, _velocity_message(rows), "active touch 100 sin 2πt mm/s, 20 dB; no answer counts as 300 %")
        _shared_legend(figure, grid[0])
    return figure


def error_against_cost(rows: Rows, costs: Rows, colors: Mapping[str, str]) -> Figure:
    """RMS error in % in act1 at 20 dB against microseconds of one update, the fastest kernel of each estimator."""
    fastest: dict[str, float] = {}
    for row in costs:
        fastest[row["estimator"]] = min(row["update_us"], fastest.get(row["estimator"], math.inf))
    here = _where(rows, scene="act1", snr_dB=PLAIN_DB)
    marks = dict(zip(dict.fromkeys(row["estimator"] for row in here), cycle(_MARKS), strict=False))
    with styled(8.6, 5.4) as figure:
        axes = figure.add_axes((0.09, 0.11, 0.56, 0.73))
        for row in sorted(here, key=lambda row: -row["error"]):
            axes.plot(
                fastest[row["estimator"]], 100 * row["error"], marks[row["estimator"]], markersize=8,
                color=colors[row["estimator"]], markeredgecolor="white", markeredgewidth=0.6, label=row["estimator"],
            )  # fmt: skip
        axes.set(xscale="log", yscale="log", xlabel="one update in a loop (µs, median)", ylabel="RMS error in act1 (%)")
        plain_log(axes.xaxis)
        plain_log(axes.yaxis, (1.0,))
        axes.legend(loc="center left", bbox_to_anchor=(1.02, 0.5), fontsize=8, labelspacing=0.75)
        best = min(here, key=lambda row: row["error"])
        cost = f"{fastest[best['estimator']]:.0f} µs"
        titled(figure, f"Smallest error in active touch: {best['estimator']}, {100 * best['error']:.2g} % at {cost}",
               "speed against error; 100 sin 2πt mm/s, 20 dB; compiled where numba is installed")  # fmt: skip
    return figure


def _bounds(axes: Axes, rows: Rows) -> None:
    """Cramér-Rao bounds of what is drawn alone, dashed; each lies below the estimator that declares its memory."""
    alone = [row for row in rows if row["family"] not in GROUPS and math.isfinite(row["bound"])]
    label: str | None = "Cramér-Rao bound of the declared memory"
    for name in dict.fromkeys(row["estimator"] for row in alone):
        points = sorted((row["snr_dB"], 100 * row["bound"]) for row in _where(alone, estimator=name))
        marker = "_" if len(points) == 1 else ""
        axes.plot(
            *zip(*points, strict=True), color=INK, linewidth=1, linestyle=(0, (4, 2)), marker=marker, markersize=14,
            label=label,
        )  # fmt: skip
        label = None


def _curves(axes: Axes, rows: Rows, key: str, colors: Mapping[str, str]) -> None:
    """Percent over SNR: the span of each family of `GROUPS` between its best and its worst, and a line for others."""
    for family, (color, label) in GROUPS.items():
        levels = sorted({row["snr_dB"] for row in _where(rows, family=family)})
        if levels:
            at = [[100 * row[key] for row in _where(rows, family=family, snr_dB=level)] for level in levels]
            low, high = [min(values) for values in at], [max(values) for values in at]
            if len(levels) == 1:
                axes.plot(2 * levels, [low[0], high[0]], color=color, alpha=0.5, linewidth=7, solid_capstyle="butt")
            axes.fill_between(levels, low, high, color=color, alpha=0.28, linewidth=0, label=label)
            axes.plot(levels, low, levels, high, color=color, linewidth=1)
    names = dict.fromkeys(row["estimator"] for row in rows if row["family"] not in GROUPS)
    for name, mark in zip(names, cycle(_MARKS), strict=False):
        x, y = zip(*sorted((row["snr_dB"], 100 * row[key]) for row in _where(rows, estimator=name)), strict=True)
        axes.plot(x, y, color=colors[name], marker=mark, markersize=4.5, linewidth=1.6, label=name)


def _where(rows: Rows, **wanted: Any) -> Rows:
    """The rows that hold all these values."""
    return [row for row in rows if all(row[key] == value for key, value in wanted.items())]


def _error_message(rows: Rows) -> str:
    here = _where(rows, scene="act1", snr_dB=PLAIN_DB)
    grouped = [row["error"] for row in here if row["family"] in GROUPS]
    alone = [row for row in here if row["family"] not in GROUPS]
    if not grouped or not alone:
        return "Error of the wavelength against noise"
    best = min(alone, key=lambda row: row["error"])
    factor = _times(min(grouped) / best["error"])
    return f"Active touch: {best['estimator']} errs {factor} less than the best published one"


def _step_message(rows: Rows, kinds: Sequence[tuple[float, float]]) -> str:
    parts = []
    for kind in kinds:
        best = min(row["median_ms"] for row in _where(rows, from_mm=kind[0], to_mm=kind[1]))
        parts.append(f"{best:.0f} ms from {kind[0]:g} to {kind[1]:g} mm")
    return f"A new wavelength is known at the earliest {' and '.join(parts)}"


def _velocity_message(rows: Rows) -> str:
    def at(delay):
        known = _where(rows, delay_ms=delay, gain=1)
        return min((row["error"] for row in known if row["family"] not in GROUPS), default=math.nan)

    delays = [row["delay_ms"] for row in rows if row["gain"] == 1 and row["delay_ms"] > 0]
    if not delays or not at(0) > 0:
        return "Error against what is known of the velocity"
    first = min(delays)
    return f"A velocity {first} ms late costs {_times(at(first) / at(0))} the error: align it with the signal"


def _times(factor: float) -> str:
    return f"{np.format_float_positional(factor, precision=2, fractional=False, trim='-')} x"


def _level_ticks(axes: Axes, rows: Rows) -> list[float]:
    """Ticks at the SNRs of the rows, as far as there is room; these, rising."""
    levels = sorted({row["snr_dB"] for row in rows})
    axes.set_xticks(levels if len(levels) < 8 else WIDE_TICKS)
    return levels


def _shared_legend(figure: Figure, axes: Axes) -> None:
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(
        handles, labels, loc="lower center", ncols=4, fontsize=8, columnspacing=1.4, bbox_to_anchor=(0.5, 0.005)
    )
