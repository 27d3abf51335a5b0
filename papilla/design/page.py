"""study.html: the results of a study, in one self-contained page."""

from collections.abc import Callable
from dataclasses import replace
from os import PathLike
from typing import TYPE_CHECKING

import numpy as np
from markupsafe import Markup

from papilla import fem, view
from papilla.design.figures import front_figure, sigma_figure
from papilla.design.results import Effect
from papilla.errors import InputError, PapillaError
from papilla.files import write_text
from papilla.finger import Finger
from papilla.view.page import either, environment, image, number

if TYPE_CHECKING:
    from papilla.design.job import Outcome

MAP = (7, 9)
"""Number of forces and moduli of a map of sigma."""
ALT = {"front": "All designs over the first objectives", "sigma": "Sigma of ln E over force and modulus"}
"""What the diagrams are, in words."""
MOST_ROWS = 12
"""Largest number of designs of the front in the page's table; the CSV has all."""


def write_page(path: str | PathLike, outcome: "Outcome", say: Callable[[str], None] = lambda line: None) -> None:
    """Write the page of a study; raises `FileAccessError`."""
    from papilla.design.job import first_words, in_scene

    study, results = outcome.study, outcome.results
    say("pictures of the page")
    designs = [(f"finger_{k}.toml", results.finger(row)) for k, row in enumerate(results.chosen, start=1)]
    shown = [*designs[:1], (study.finger.name, study.finger)]
    figures = {"front": front_figure(results, outcome.base)}
    if study.finger.gauges[1:]:
        dense = replace(study.scene, forces=MAP[0], moduli=MAP[1])
        mapped = [replace(in_scene(study, finger), scene=dense) for _, finger in shown]
        try:
            sigmas = [design.sigma_gauges for design in mapped]
            figures["sigma"] = sigma_figure(*dense.points, sigmas, [name for name, _ in shown])
        except InputError:
            pass  # The study's own finger may not cover its scene
    rows = np.flatnonzero(results.front)
    rows = rows[np.argsort(results.costs[rows, 0], kind="stable")]
    text = (
        environment("papilla.design")
        .get_template("study.html")
        .render(
            outcome=outcome,
            study=study,
            results=results,
            tally=outcome.tally,
            said=first_words(outcome),
            designs=designs,
            chosen=[(row, int(results.numbers[row])) for row in results.chosen],
            front=rows[:MOST_ROWS].tolist(),
            on_front=len(rows),
            effects=[words for one in results.effects if (words := in_words(one))],
            figures={name: image(figure, ALT[name]) for name, figure in figures.items()},
            strains=[(name, picture) for name, finger in shown if (picture := _strain(finger, outcome, say))],
        )
    )
    write_text(path, text)


def in_words(one: Effect) -> str:
    """An effect as a sentence; empty if the interval contains "no effect"."""
    if not one.sure:
        return ""
    low, high = (number(value) for value in one.interval)
    what = f"{one.parameter} from {number(one.low)} to {number(one.high)}"
    if one.factor:
        return f"{what} multiplies {one.objective} by {number(one.change)} ({low} to {high})"
    return f"{what} changes {one.objective} by {number(one.change)} ({low} to {high})"


def _strain(finger: Finger, outcome: "Outcome", say: Callable[[str], None]) -> Markup | None:
    """The picture of the strain field under the largest force of the scene on its hardest specimen."""
    scene = outcome.study.scene
    specimen = finger.bench.specimen(scene.modulus_MPa[1])
    try:
        reduced = fem.prepare(finger, progress=say)
        press = view.shown(reduced, specimen, force=scene.force_N[1], friction=0.0)
        return either(
            view.strain_pictures(finger, reduced, press, specimen, say), f"Strain field of {finger.name}", "png"
        )
    except PapillaError:
        return None
