"""Plots of a calibration from plain arrays: curves of S_d, maps of the error of E. Each returns a matplotlib Figure."""

import math
from collections.abc import Sequence
from operator import itemgetter
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle

from papilla.core import checks
from papilla.core.units import PER_CENT
from papilla.view import style

LARGEST_SIGMA_PERCENT = 50.0
"""Uncertainty in % above which a modulus counts as not identifiable; the colour scale ends there."""
SPREAD_COLORS, DARK_COLOR_SHARES = "viridis", (0.05, 0.78)
"""Colours of curves in an order, and the part of them that is dark enough."""
BLANK_STYLE: Any = {"hatch": "////", "facecolor": "#eceff3"}  # A region without an identified modulus
SIGMA_LEVELS = (0.1, 0.2, 0.5, 1, 2, 5, 10, 20, LARGEST_SIGMA_PERCENT)  # Ends of the shades of an uncertainty, %
LOW_FIGURE = 3.2  # Height of a figure of residuals, inches
RECOVERY_DOT_AREA, AXES_MARGIN = 90, 1.08  # Area of a dot, square points; factor of axes beyond the last dots
NAMES_AT = 1.03  # Where the names of curves stand, as a share of the axes
SAME_END_DISTANCE = 1e-3  # Relative distance of the ends of two curves that coincide
NAME_GAP = 0.055  # Least distance of the names of two curves, as a share of the axes: a line of small letters


def sd_against_force(
    force_N: np.ndarray,
    moduli: Sequence[float],
    sd: np.ndarray,
    published: tuple[np.ndarray, Sequence[float], np.ndarray] | None = None,
) -> Figure:
    """S_d in microstrain (force, modulus) against force in N, a curve per modulus (MPa).

    published : force (N), moduli (MPa) and S_d (force, modulus) of the published regression, scaled to microstrain;
        dashed in the colours of the nearest moduli.
    """
    colors = _spread(len(moduli))
    with style.styled() as figure:
        axes = figure.subplots()
        if published is not None:
            dashed: dict = {"linestyle": "--", "zorder": 3}
            for modulus, values in zip(published[1], published[2].T / style.MICROSTRAIN_A_THOUSAND, strict=True):
                axes.plot(published[0], values, color=colors[_nearest(moduli, modulus)], **dashed)
            axes.plot([], [], color=style.MUTED_COLOR, label="published (9), one scale factor", **dashed)
            axes.plot([], [], color=style.MUTED_COLOR, linewidth=style.THICK_PT, label="calibration")
            axes.legend(loc="lower right")
        frame = {"xlabel": "force (N)", "ylabel": r"$S_d$ (10³ µε)", "xlim": (0, float(force_N.max()))}
        _curves(axes, force_N, sd / style.MICROSTRAIN_A_THOUSAND, _megapascals(moduli), colors, ylim=(0, None), **frame)
    return figure


def sd_of_presses(
    force_N: np.ndarray,
    moduli: Sequence[float],
    sd: np.ndarray,
    measured: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray],
) -> Figure:
    """S_d in microstrain (force, modulus) against force in N, a curve per modulus (MPa), with measured presses on it.

    measured : force (N), modulus (MPa), S_d and its standard deviation (microstrain) of n presses.
    """
    colors = _spread(len(moduli))
    with style.styled() as figure:
        axes = figure.subplots()
        for force, modulus, value, bar in zip(*measured, strict=True):
            dot = {"color": colors[_nearest(moduli, modulus)], "markeredgecolor": "white"}
            axes.errorbar(force, value, yerr=bar, fmt="o", **dot)
        frame = {"xlabel": "force (N)", "ylabel": r"$S_d$ (µε)", "xlim": (0, None), "ylim": (0, None)}
        _curves(axes, force_N, sd, _megapascals(moduli), colors, **frame)
    return figure


def residuals_against_force(force_N: np.ndarray, gauges: Sequence[str], residual: np.ndarray) -> Figure:
    """Residuals (n, g) in standard deviations against force (n,) in N, one colour per gauge."""
    with style.styled(height=LOW_FIGURE) as figure:
        axes = figure.subplots()
        axes.axhspan(-2, 2, color=style.FAINT_COLOR, linewidth=0)
        for name, values, color in zip(gauges, residual.T, _spread(len(gauges)), strict=True):
            axes.plot(force_N, values, "o", color=color, label=style.named(name))
        axes.set(xlabel="force (N)", ylabel="residual (sigma)", xlim=(0, None))
        figure.legend(loc="outside right center")
    return figure


def sd_against_modulus(modulus_MPa: np.ndarray, forces: Sequence[float], sd: np.ndarray) -> Figure:
    """S_d in microstrain (force, modulus) against modulus in MPa on a logarithmic axis, a curve per force (N)."""
    with style.styled() as figure:
        axes = figure.subplots()
        names = [f"{force:.3g} N" for force in forces]
        frame = {"xlabel": "modulus of the specimen (MPa)", "ylabel": r"$S_d$ (10³ µε)", "xscale": "log"}
        limits = {"xlim": (float(modulus_MPa.min()), float(modulus_MPa.max())), "ylim": (0, None)}
        table, colors = sd.T / style.MICROSTRAIN_A_THOUSAND, _spread(len(forces))
        _curves(axes, modulus_MPa, table, names, colors, **limits, **frame)
        style.plain_log(axes.xaxis)
    return figure


def uncertainty_map(
    force_N: np.ndarray,
    modulus_MPa: np.ndarray,
    relative_sigma: np.ndarray,
    identified: np.ndarray,
    checked: tuple[float, float, float, float] | None = None,
) -> Figure:
    """sigma_E / E (force, modulus) over force in N and modulus in MPa; regions without an identified modulus (bool) are
    hatched.

    checked : (force low, high, modulus low, high) of a rectangle to draw, where recovered moduli were checked.
    """
    share, levels = np.where(identified, PER_CENT * relative_sigma, np.nan), np.array(SIGMA_LEVELS)
    with style.styled() as figure:
        axes = figure.subplots()
        log_share = np.log10(np.clip(share, levels[0], LARGEST_SIGMA_PERCENT)).T
        shades = axes.contourf(force_N, modulus_MPa, log_share, levels=np.log10(levels), cmap="YlOrBr")
        thin: Any = {"colors": style.INK_COLOR, "linewidths": style.THIN_PT}
        lines = axes.contour(force_N, modulus_MPa, share.T, levels=levels[1:-1], **thin)
        axes.clabel(lines, fmt=lambda level: f"{level:g} %", fontsize="small")
        blank = (~identified).astype(float).T
        hatched: Any = {"colors": BLANK_STYLE["facecolor"], "hatches": [BLANK_STYLE["hatch"]]}
        axes.contourf(force_N, modulus_MPa, blank, levels=[0.5, 2], **hatched)
        handles = [Patch(**BLANK_STYLE, edgecolor=style.MUTED_COLOR, label="not identifiable")]
        if checked is not None:
            low_force, high_force, low_modulus, high_modulus = checked
            size = high_force - low_force, high_modulus - low_modulus
            edge: Any = {"fill": False, "edgecolor": style.ACCENT_COLORS[0]}
            axes.add_patch(Rectangle((low_force, low_modulus), *size, linewidth=style.THICK_PT, **edge))
            handles.append(Patch(**edge, label="where recovery was checked"))
        axes.legend(handles=handles, loc="lower right")
        _force_modulus_axes(axes, force_N, modulus_MPa)
        bar = style.color_bar(shades, axes, r"$\sigma_E / E$")
        bar.set_ticks(list(np.log10(levels)), labels=[f"{level:g} %" for level in levels])
    return figure


def recovery_map(force_N: np.ndarray, modulus_MPa: np.ndarray, error: np.ndarray) -> Figure:
    """Relative error (n,) of recovered moduli at forces (n,) in N and moduli (n,) in MPa; NaN where none was given."""
    recovered = np.isfinite(error)
    limit = style.nice_limit(PER_CENT * float(np.abs(error[recovered]).max(initial=checks.ROUNDING_SHARE)))
    with style.styled() as figure:
        axes = figure.subplots()
        dots = axes.scatter(
            force_N[recovered], modulus_MPa[recovered], c=PER_CENT * error[recovered], s=RECOVERY_DOT_AREA,
            cmap="PuOr_r",
            vmin=-limit, vmax=limit, edgecolors=style.MUTED_COLOR, linewidths=style.THIN_PT,
        )  # fmt: skip
        if not recovered.all():
            cross: Any = {"marker": "x", "color": style.INK_COLOR, "label": "no answer"}
            axes.scatter(force_N[~recovered], modulus_MPa[~recovered], **cross)
            axes.legend(loc="lower right")
        _force_modulus_axes(axes, force_N, modulus_MPa, margin=AXES_MARGIN)
        style.color_bar(dots, axes, "error of the recovered E (%)")
    return figure


def gauge_readings(force_N: np.ndarray, names: Sequence[str], readings: np.ndarray, title: str) -> Figure:
    """Readings in microstrain (force, gauge) against force in N, one curve per gauge; equal curves coincide."""
    with style.styled() as figure:
        axes = figure.subplots()
        colors = [style.ACCENT_COLORS[number % len(style.ACCENT_COLORS)] for number in range(len(names))]
        dashes = ["solid" if number <= len(names) // 2 else "--" for number in range(len(names))]
        axes.axhline(0, color=style.MUTED_COLOR, linewidth=style.THIN_PT)
        frame = {"xlabel": "force (N)", "ylabel": "reading (10³ µε)", "xlim": (0, float(force_N.max())), "title": title}
        labels = list(map(style.named, names))
        _curves(axes, force_N, readings / style.MICROSTRAIN_A_THOUSAND, labels, colors, dashes, **frame)
    return figure


def _curves(axes: Axes, x: np.ndarray, table: np.ndarray, names: Sequence[str], colors, dashes=None, **frame) -> None:
    """Curves, columns of a table (n, k) over x (n,), with their names at the right ends; frame : of `Axes.set`."""
    ends = []
    for values, name, color, dash in zip(table.T, names, colors, dashes or ["solid"] * len(names), strict=True):
        axes.plot(x, values, color=color, linestyle=dash, linewidth=style.THICK_PT)
        ends.append((float(values[np.isfinite(values)][-1]), name, color))
    axes.set(**frame)
    style.with_formula(axes.yaxis.label)
    _label_ends(axes, float(x.max()), ends)


def _megapascals(moduli: Sequence[float]) -> list[str]:
    return [f"{modulus:.3g} MPa" for modulus in moduli]


def _force_modulus_axes(axes: Axes, force_N: np.ndarray, modulus_MPa: np.ndarray, margin: float = 1.0) -> None:
    axes.set(xscale="log", yscale="log", xlabel="force (N)", ylabel="modulus of the specimen (MPa)")
    axes.set_xlim(float(force_N.min()) / margin, float(force_N.max()) * margin)
    axes.set_ylim(float(modulus_MPa.min()) / margin, float(modulus_MPa.max()) * margin)
    style.plain_log(axes.xaxis)
    style.plain_log(axes.yaxis)
    axes.grid(False)


def _spread(count: int) -> list:
    return [colormaps[SPREAD_COLORS](place) for place in np.linspace(*DARK_COLOR_SHARES, count)]


def _nearest(moduli: Sequence[float], modulus: float) -> int:
    return int(np.argmin(np.abs(np.log(np.array(moduli) / modulus))))


def _label_ends(axes: Axes, x: float, ends: list[tuple]) -> None:
    """Name curves at their right ends, moved apart where they would overlap, none above the axes.

    Curves that end at the same place (mirrored gauges) have their names on one line."""
    merged: list[list] = []
    for value, name, color in ends:
        same = next((curve for curve in merged if math.isclose(curve[0], value, rel_tol=SAME_END_DISTANCE)), None)
        if same is None:
            merged.append([value, name, color])
        else:
            same[1] += f", {name}"
    merged.sort(key=itemgetter(0))
    low, high = axes.get_ylim()
    step = NAME_GAP * np.arange(len(merged))
    places = np.maximum.accumulate((np.array([end[0] for end in merged]) - low) / (high - low) - step) + step
    places = np.minimum(places, 1 - step[::-1])
    for (value, name, color), place in zip(merged, places.tolist(), strict=True):
        axes.annotate(
            name, (x, value), xytext=(NAMES_AT, place), textcoords="axes fraction", va="center", fontsize="small",
            color=color, annotation_clip=False, parse_math=False,
            arrowprops={"arrowstyle": "-", "color": style.FAINT_COLOR},
        )  # fmt: skip
