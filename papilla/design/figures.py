"""The pictures of a study's page: the Pareto front, and sigma of ln E over the scene for designs side by side."""

import textwrap
from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from papilla.design.results import Results
from papilla.units import PER_CENT
from papilla.view.style import ACCENTS, FAINT, INK, MUTED, color_bar, plain_log, styled

LEVELS = (1, 2, 5, 10, 20, 50, 100)
"""Values of sigma of ln E in % at which colours change."""


def front_figure(results: Results, base: dict[str, float]) -> Figure:
    """All designs over the first two objectives, with the front, the chosen designs and the study's own finger marked.

    With a single objective: the designs over the first parameter.
    """
    goals, study = results.study.objectives, results.study
    first = results.values(goals[0].name)
    if len(goals) > 1:
        other, name, own = results.values(goals[1].name), _named(goals[1].name, goals[1].unit), base[goals[1].name]
    else:
        other, name, own = results.free[:, 0], study.free[0].name, float("nan")
    with styled(7.2, 4.6) as figure:
        axes = figure.add_axes((0.11, 0.13, 0.84, 0.8))
        ok, on = results.feasible, results.front
        axes.plot(other[~ok], first[~ok], ".", color=FAINT, markersize=4, label="breaks a constraint")
        axes.plot(other[ok], first[ok], ".", color=MUTED, markersize=4, label="designs")
        if len(goals) > 1:
            axes.plot(other[on], first[on], "o", color=ACCENTS[0], markersize=5, label="Pareto front")
            axes.plot([own], [base[goals[0].name]], "s", color=INK, markersize=7, label=study.finger.name)
        else:
            axes.axhline(base[goals[0].name], color=INK, linewidth=0.9, label=study.finger.name)
        rows = results.chosen
        axes.plot(other[rows], first[rows], "*", color=ACCENTS[1], markersize=13, label="chosen")
        for values, axis, scale in ((first, axes.yaxis, axes.set_yscale), (other, axes.xaxis, axes.set_xscale)):
            if (values > 0).all() and values.max() > 5 * values.min():
                scale("log")
                plain_log(axis)
        axes.set(xlabel=name, ylabel=_named(goals[0].name, goals[0].unit))
        axes.legend(fontsize=8.5)
    return figure


def sigma_figure(forces: np.ndarray, moduli: np.ndarray, sigmas: Sequence[np.ndarray], titles: Sequence[str]) -> Figure:
    """Sigma (f, m) of ln E over force and modulus, one panel per design."""
    with styled(7.2, 3.6) as figure:
        width = 0.78 / len(sigmas)
        for k, (sigma, title) in enumerate(zip(sigmas, titles, strict=True)):
            axes = figure.add_axes((0.09 + k * (width + 0.02), 0.15, width - 0.03, 0.7))
            percent = np.clip(PER_CENT * sigma, LEVELS[0], LEVELS[-1])
            shades = axes.contourf(
                forces, moduli, np.log10(percent).T, levels=np.log10(LEVELS), cmap="YlOrBr", extend="both"
            )
            axes.set(xscale="log", yscale="log", xlabel="force (N)")
            axes.set_title(textwrap.fill(title, 18), fontsize=9)
            plain_log(axes.yaxis)
            ticks = np.geomspace(forces[0], forces[-1], 3)
            axes.set_xticks(ticks, [f"{tick:.2g}" for tick in ticks])
            axes.xaxis.set_minor_locator(NullLocator())
            if k:
                axes.tick_params(labelleft=False)
            else:
                axes.set_ylabel("modulus of the specimen (MPa)")
        bar = color_bar(figure, shades, (0.9, 0.15, 0.018, 0.7), "sigma of ln E")
        bar.set_ticks(list(np.log10(LEVELS)), labels=[f"{level:g} %" for level in LEVELS])
    return figure


def _named(name: str, unit: str) -> str:
    return name if unit == "1" else f"{name} ({unit})"
