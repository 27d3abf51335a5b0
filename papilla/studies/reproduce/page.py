"""reproduce.html: the table of claims and a picture of each experiment on one self-contained page."""

from collections.abc import Sequence
from os import PathLike

import numpy as np
from markupsafe import Markup

from papilla import __version__
from papilla.files import write_text
from papilla.studies.figures.drawing import as_svg
from papilla.studies.figures.picture import Curve, Panel, Picture
from papilla.studies.reproduce.claim import Found, accepted, beside, number, published
from papilla.studies.reproduce.runner import Result, by_evidence, head
from papilla.view.page import either, environment


def write_page(path: str | PathLike, results: Sequence[Result], seconds: float) -> None:
    """Write the page, whole or not at all; raises `FileAccessError`. seconds : that the experiments took."""
    templates = environment("papilla.studies.reproduce")
    templates.filters |= {"number": number, "published": published, "accepted": accepted, "beside": beside}
    answers = [answer for result in results for answer in result.answers]
    pictures = {result.experiment.name: _drawn(result.found) for result in results}
    text = templates.get_template("reproduce.html").render(
        results=results,
        head=head(answers),
        evidence=by_evidence(answers),
        pictures=pictures,
        seconds=seconds,
        version=__version__,
    )
    write_text(path, text)


def picture(found: Found) -> Picture:
    """The picture of an experiment: curves, points or bars of its series."""
    curves, names, color = [], (), -1
    for before, one in zip((None, *found.series), found.series, strict=False):
        # Points after a curve are its comparison, and have its colour
        color += not (before is not None and (before.style, one.style) == ("line", "points"))
        bars = one.style == "bars"
        names = tuple(one.x) if bars else names
        x = np.arange(len(one.x)) if bars else np.asarray(one.x, float)
        curves.append(Curve(one.label, x, np.asarray(one.y, float), one.style, color=color))
    panel = Panel(found.title, found.x_label, found.y_label, tuple(curves), log=found.log, names=names)
    return Picture((panel,))


def _drawn(found: Found | None) -> Markup | None:
    if found is None or not found.series:
        return None
    shown = picture(found)
    return either((as_svg(shown), as_svg(shown, narrow=True)), found.title, "svg+xml")
