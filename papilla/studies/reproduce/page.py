"""reproduce.html: the table of claims and a picture of each experiment on one self-contained page."""

from collections.abc import Sequence
from os import PathLike

import numpy as np
from markupsafe import Markup
from matplotlib.figure import Figure

from papilla import __version__
from papilla.files import write_text
from papilla.studies.reproduce.claim import Found, accepted, beside, number, published
from papilla.studies.reproduce.runner import Result, by_evidence, head
from papilla.view.page import environment, image
from papilla.view.style import ACCENTS, MUTED, literal, styled, titled

MOST_POINTS = 1500
"""Largest number of drawn points of a curve; more would not be visible."""


def write_page(path: str | PathLike, results: Sequence[Result], seconds: float) -> None:
    """Write the page, whole or not at all; raises `FileAccessError`. seconds : that the experiments took."""
    templates = environment("papilla.studies.reproduce")
    templates.filters |= {"number": number, "published": published, "accepted": accepted, "beside": beside}
    answers = [answer for result in results for answer in result.answers]
    pictures = {result.experiment.name: _picture(result.found) for result in results}
    text = templates.get_template("reproduce.html").render(
        results=results,
        head=head(answers),
        evidence=by_evidence(answers),
        pictures=pictures,
        seconds=seconds,
        version=__version__,
    )
    write_text(path, text)


def _picture(found: Found | None) -> Markup | None:
    return None if found is None or not found.series else image(draw(found), found.title)


def draw(found: Found) -> Figure:
    """The picture of an experiment: curves, points or bars of its series."""
    with styled(8.0, 4.4) as figure:
        axes = figure.add_axes((0.1, 0.13, 0.87, 0.72))
        bars = [one for one in found.series if one.style == "bars"]
        place, before = -1, ""
        for one in found.series:
            # Points after a curve are its comparison, and have its colour
            place += not (one.style == "points" and before == "line")
            color, before = ACCENTS[place % len(ACCENTS)], one.style
            if one.style == "bars":
                width = 0.8 / len(bars)
                left = np.arange(len(one.x)) + (bars.index(one) - (len(bars) - 1) / 2) * width
                axes.bar(left, one.y, width, color=color, label=literal(one.label))
                axes.set_xticks(np.arange(len(one.x)), list(one.x))
                continue
            x, y = (np.asarray(values, float) for values in (one.x, one.y))
            step = max(1, len(x) // MOST_POINTS)
            marks = {"linestyle": "", "marker": "o", "markersize": 4} if one.style == "points" else {"linewidth": 1.4}
            axes.plot(x[::step], y[::step], color=color, label=literal(one.label), **marks)
        if "x" in found.log:
            axes.set_xscale("log")
        if "y" in found.log:
            axes.set_yscale("log")
        axes.set_xlabel(found.x_label)
        axes.set_ylabel(found.y_label)
        if bars:
            axes.margins(y=0.3)  # Room for the legend
        if len(found.series) > 1:
            axes.legend(loc="best", fontsize=8, frameon=True, framealpha=0.85, edgecolor="none")
        titled(figure, found.title, "", size=9.5)
        axes.tick_params(colors=MUTED)
        return figure
