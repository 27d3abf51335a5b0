"""Plots of a calibration from plain arrays: curves of S_d, maps of the error of E. Each returns a matplotlib Figure."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle

from papilla.units import PER_CENT
from papilla.view.style import (
    ACCENTS,
    FAINT,
    INK,
    MUTED,
    THICK,
    THIN,
    color_bar,
    literal,
    nice_limit,
    plain_log,
    styled,
)

CEILING = 50.0  # Uncertainty in % above which a modulus counts as not identifiable; the colour scale ends there
SPREAD = "viridis"
BAR = (0.84, 0.13, 0.025, 0.8)  # Position of a map's colour bar in the figure


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
    with _plot() as (figure, axes):
        if published is not None:
            dashed: dict = {"linestyle": "--", "zorder": 3}
            for modulus, values in zip(published[1], published[2].T, strict=True):
                axes.plot(published[0], values / 1000, color=colors[_nearest(moduli, modulus)], **dashed)
            axes.plot([], [], color=MUTED, label="published (9), one scale factor", **dashed)
            axes.plot([], [], color=MUTED, linewidth=THICK, label="calibration")
            axes.legend(loc="lower right")
        frame = {"xlabel": "force (N)", "ylabel": r"$S_d$ (10³ µε)", "xlim": (0, float(force_N.max()))}
        _curves(axes, force_N, sd / 1000, _megapascals(moduli), colors, ylim=(0, None), **frame)
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
    with _plot() as (figure, axes):
        for force, modulus, value, bar in zip(*measured, strict=True):
            dot = {"color": colors[_nearest(moduli, modulus)], "markeredgecolor": "white"}
            axes.errorbar(force, value, yerr=bar, fmt="o", **dot)
        frame = {"xlabel": "force (N)", "ylabel": r"$S_d$ (µε)", "xlim": (0, None), "ylim": (0, None)}
        _curves(axes, force_N, sd, _megapascals(moduli), colors, **frame)
    return figure


def residuals_against_force(force_N: np.ndarray, gauges: Sequence[str], residual: np.ndarray) -> Figure:
    """Residuals (n, g) in standard deviations against force (n,) in N, one colour per gauge."""
    with _plot(3.2, (0.18, 0.75)) as (figure, axes):
        axes.axhspan(-2, 2, color=FAINT, linewidth=0)
        for name, values, color in zip(gauges, residual.T, _spread(len(gauges)), strict=True):
            axes.plot(force_N, values, "o", color=color, label=name)
        axes.set(xlabel="force (N)", ylabel="residual (sigma)", xlim=(0, None))
        axes.legend(loc="center left", bbox_to_anchor=(1.02, 0.5))
    return figure


def sd_against_modulus(modulus_MPa: np.ndarray, forces: Sequence[float], sd: np.ndarray) -> Figure:
    """S_d in microstrain (force, modulus) against modulus in MPa on a logarithmic axis, a curve per force (N)."""
    with _plot() as (figure, axes):
        names = [f"{force:.3g} N" for force in forces]
        frame = {"xlabel": "modulus of the specimen (MPa)", "ylabel": r"$S_d$ (10³ µε)", "xscale": "log"}
        ends = float(modulus_MPa.min()), float(modulus_MPa.max())
        _curves(axes, modulus_MPa, sd.T / 1000, names, _spread(len(forces)), xlim=ends, ylim=(0, None), **frame)
        plain_log(axes.xaxis)
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
    share = np.where(identified, PER_CENT * relative_sigma, np.nan)
    levels = np.array([0.1, 0.2, 0.5, 1, 2, 5, 10, 20, CEILING])
    with styled(7.2, 4.4) as figure:
        axes = figure.add_axes((0.11, 0.13, 0.7, 0.8))
        shades = axes.contourf(
            force_N, modulus_MPa, np.log10(np.clip(share, levels[0], CEILING)).T, levels=np.log10(levels), cmap="YlOrBr"
        )
        lines = axes.contour(force_N, modulus_MPa, share.T, levels=levels[1:-1], colors=INK, linewidths=THIN)
        axes.clabel(lines, fmt=lambda level: f"{level:g} %", fontsize="small")
        blank = (~identified).astype(float).T
        axes.contourf(force_N, modulus_MPa, blank, levels=[0.5, 1.5], colors="#eceff3", hatches=["////"])
        if checked is not None:
            low_force, high_force, low_modulus, high_modulus = checked
            box = Rectangle((low_force, low_modulus), high_force - low_force, high_modulus - low_modulus)
            box.set(fill=False, edgecolor=ACCENTS[0], linewidth=THICK)
            axes.add_patch(box)
        handles = [Patch(facecolor="#eceff3", hatch="////", edgecolor=MUTED, label="not identifiable")]
        if checked is not None:
            handles.append(Patch(facecolor="none", edgecolor=ACCENTS[0], label="where recovery was checked"))
        axes.legend(handles=handles, loc="lower right")
        _force_modulus_axes(axes, force_N, modulus_MPa)
        bar = color_bar(figure, shades, BAR, r"$\sigma_E / E$")
        bar.set_ticks(list(np.log10(levels)), labels=[f"{level:g} %" for level in levels])
    return figure


def recovery_map(force_N: np.ndarray, modulus_MPa: np.ndarray, error: np.ndarray) -> Figure:
    """Relative error (n,) of recovered moduli at forces (n,) in N and moduli (n,) in MPa; NaN where none was given."""
    known = np.isfinite(error)
    limit = nice_limit(max(PER_CENT * float(np.abs(error[known]).max(initial=0.0)), 1e-9))
    with styled(7.2, 4.4) as figure:
        axes = figure.add_axes((0.11, 0.13, 0.7, 0.8))
        dots = axes.scatter(
            force_N[known], modulus_MPa[known], c=PER_CENT * error[known], s=90, cmap="PuOr_r", vmin=-limit, vmax=limit,
            edgecolors=MUTED, linewidths=THIN,
        )  # fmt: skip
        if not known.all():
            axes.scatter(force_N[~known], modulus_MPa[~known], marker="x", color=INK, s=40, label="no answer")
            axes.legend(loc="lower right")
        _force_modulus_axes(axes, force_N, modulus_MPa, margin=1.08)
        color_bar(figure, dots, BAR, "error of the recovered E (%)")
    return figure


def gauge_readings(force_N: np.ndarray, names: Sequence[str], readings: np.ndarray, title: str) -> Figure:
    """Readings in microstrain (force, gauge) against force in N, one curve per gauge; equal curves coincide."""
    with _plot(4.0, (0.14, 0.74)) as (figure, axes):
        colors = [ACCENTS[number % len(ACCENTS)] for number in range(len(names))]
        dashes = ["solid" if number <= len(names) // 2 else "--" for number in range(len(names))]
        axes.axhline(0, color=MUTED, linewidth=THIN)
        frame = {"xlabel": "force (N)", "ylabel": "reading (10³ µε)", "xlim": (0, float(force_N.max())), "title": title}
        _curves(axes, force_N, readings / 1000, [literal(name) for name in names], colors, dashes, **frame)
    return figure


@contextmanager
def _plot(height: float = 4.3, place: tuple[float, float] = (0.13, 0.8)) -> Iterator[tuple[Figure, Axes]]:
    """A figure of this height (inches), and axes with room for names on the right; place : bottom and height."""
    bottom, share = place
    with styled(7.2, height) as figure:
        yield figure, figure.add_axes((0.11, bottom, 0.66, share))


def _curves(axes: Axes, x: np.ndarray, table: np.ndarray, names: Sequence[str], colors, dashes=None, **frame) -> None:
    """Curves, columns of a table (n, k) over x (n,), with their names at the right ends; frame : of `Axes.set`."""
    ends = []
    for values, name, color, dash in zip(table.T, names, colors, dashes or ["solid"] * len(names), strict=True):
        axes.plot(x, values, color=color, linestyle=dash, linewidth=THICK)
        ends.append((float(values[np.isfinite(values)][-1]), name, color))
    axes.set(**frame)
    _label_ends(axes, float(x.max()), _merged(ends))


def _megapascals(moduli: Sequence[float]) -> list[str]:
    return [f"{modulus:.3g} MPa" for modulus in moduli]


def _force_modulus_axes(axes: Axes, force_N: np.ndarray, modulus_MPa: np.ndarray, margin: float = 1.0) -> None:
    axes.set(xscale="log", yscale="log", xlabel="force (N)", ylabel="modulus of the specimen (MPa)")
    axes.set_xlim(float(force_N.min()) / margin, float(force_N.max()) * margin)
    axes.set_ylim(float(modulus_MPa.min()) / margin, float(modulus_MPa.max()) * margin)
    plain_log(axes.xaxis)
    plain_log(axes.yaxis)
    axes.grid(False)


def _spread(count: int) -> list:
    return [colormaps[SPREAD](place) for place in np.linspace(0.05, 0.78, count)]


def _nearest(moduli: Sequence[float], modulus: float) -> int:
    return int(np.argmin(np.abs(np.log(np.array(moduli) / modulus))))


def _merged(ends: list) -> list:
    """Labels of curves that end at the same place (mirrored gauges), on one line."""
    merged: list = []
    for value, name, color in ends:
        same = next((item for item in merged if abs(item[0] - value) < 1e-3 * max(abs(value), 1e-9)), None)
        if same is None:
            merged.append([value, name, color])
        else:
            same[1] += f", {name}"
    return [tuple(item) for item in merged]


def _label_ends(axes: Axes, x: float, ends: list) -> None:
    """Name curves at their right ends, moved apart where they would overlap, none above the axes."""
    low, high = axes.get_ylim()
    gap = 0.055 * (high - low)
    ends = sorted(ends, key=lambda end: end[0])
    places = [value for value, _, _ in ends]
    for k in range(1, len(places)):
        places[k] = max(places[k], places[k - 1] + gap)
    limit = high
    for k in reversed(range(len(places))):
        places[k] = min(places[k], limit)
        limit = places[k] - gap
    for (value, name, color), place in zip(ends, places, strict=True):
        axes.annotate(
            name, (x, value), xytext=(1.03, (place - low) / (high - low)), textcoords="axes fraction", va="center",
            fontsize="small", color=color, annotation_clip=False, arrowprops={"arrowstyle": "-", "color": FAINT},
            parse_math=False,
        )  # fmt: skip
