"""`papilla design` as a function: runs a study, and writes its table, its page and the files of the chosen designs."""

import textwrap
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from markupsafe import Markup
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from papilla import fem, view
from papilla.core.errors import InputError, PapillaError
from papilla.core.files import check_writable, write_text
from papilla.core.progress import Progress, silent
from papilla.core.units import PER_CENT
from papilla.design.cluster import Scheduler
from papilla.design.confirming import confirm
from papilla.design.objectives import Objective
from papilla.design.results import Effect, Outcome, Results, first_words, write_tables
from papilla.design.running import run
from papilla.design.store import Store
from papilla.design.study import Study
from papilla.design.texts import short
from papilla.model.finger import Finger
from papilla.view.page import either, environment, image, number
from papilla.view.style import ACCENT_COLORS, FAINT_COLOR, INK_COLOR, MUTED_COLOR, THIN_PT, color_bar, plain_log, styled

MAP_SHAPE = (7, 9)
"""Number of forces and moduli of a map of sigma."""
MOST_FRONT_ROWS = 12
"""Largest number of designs of the front in the page's table; the CSV has all."""
STAR_SIZE_PT, TITLE_LETTERS, PANEL_FORCE_TICKS, LOGARITHMIC_AXIS_RATIO = 13, 18, 3, 5
"""Size of a star in points; letters of a line of a panel's title; ticks of a panel's force; ratio of the ends of an
axis from which it is logarithmic."""
SIGMA_LEVELS_PERCENT = (1, 2, 5, 10, 20, 50, 100)
"""Values of sigma of ln E in % at which colours change."""


def run_study(
    study: Study,
    out: Path,
    *,
    resume: bool = False,
    workers: int = 1,
    scheduler: Scheduler | None = None,
    progress: Progress = silent,
    with_page: bool = True,
) -> Outcome:
    """Run a study and write designs.csv (and .parquet), study.html and finger_1.toml, ... into a folder.

    The chosen designs are judged again before a file is written, and each file of a finger is the one that was judged.

    resume : continue with the designs of this study in the folder's store; without it, such a store is refused.
    with_page : whether to write the page, whose pictures take half a minute.

    Raises `InputError` if no design has an answer, `FileFormatError` for a row of the store that papilla did not write,
    and what `papilla.design.running.run` raises.
    """
    check_writable(out)
    store = Store(study.store or out / "store.sqlite")
    try:
        if study.store is None and not resume and store.holds(study.sha256):
            raise InputError(f"{store.path} holds designs of this study: --resume goes on with them")
        tally = run(study, store, workers=workers, scheduler=scheduler, progress=progress)
        results = Results.of(study, store)
        progress("judging the chosen designs again")
        results.check_chosen(store)
        front = results.numbers[results.front].tolist()
        tables = write_tables(out / "designs.csv", study, store, front)
    finally:
        store.close()
    names = [f"finger_{rank}.toml" for rank in range(1, len(results.chosen) + 1)]
    for name, rank_row in zip(names, results.chosen, strict=True):
        results.save_finger(rank_row, out / name)
    confirmed = []
    for rank, (name, rank_row) in enumerate(zip(names, results.chosen[: study.confirm], strict=False), start=1):
        progress(f"confirming design {rank} by a calibration")
        confirmed.append(confirm(name, study.in_scene(results.finger(rank_row)), workers or 1, progress))
    if study.confirm:
        progress("calibrating the study's own finger")
        confirmed.append(confirm(short(study.finger.name), study.in_scene(study.finger), workers or 1, progress))
    base = {}
    for objective in study.objectives:
        try:
            base[objective.name] = objective.of(study.in_scene(study.finger))
        except InputError:
            base[objective.name] = float("nan")
    page = out / "study.html"
    written = {
        "tables": [*map(str, tables)],
        "fingers": [str(out / name) for name in names],
        "page": [str(page)] * with_page,
    }
    outcome = Outcome(study, results, tally, base, confirmed, written)
    if with_page:
        write_page(page, outcome, progress)
    return outcome


def write_page(path: Path, outcome: Outcome, progress: Progress = silent, *, fields: bool = True) -> None:
    """Write the page of a study, with or without strain fields; raises `FileAccessError`."""
    study, results = outcome.study, outcome.results
    progress("pictures of the page")
    best = [("finger_1.toml", results.finger(index)) for index in results.chosen[:1]]
    pictured = [*best, (short(study.finger.name), study.finger)]
    figures = {"front": image(front_figure(results, outcome.base), "All designs over the first objectives")}
    if study.finger.gauges[1:]:
        dense = replace(study.scene, forces=MAP_SHAPE[0], moduli=MAP_SHAPE[1])
        mapped = [(name, replace(study.in_scene(finger), scene=dense)) for name, finger in pictured]
        try:
            picture_of_sigma = sigma_figure(*dense.points, [(name, effect.sigma_gauges) for name, effect in mapped])
            figures["sigma"] = image(picture_of_sigma, "Sigma of ln E over force and modulus")
        except InputError:
            pass  # The study's own finger may not cover its scene
    rows = np.flatnonzero(results.front)
    rows = rows[np.argsort(results.costs[rows, 0], kind="stable")]
    text = environment("papilla.design").get_template("study.html").render(
        outcome=outcome,
        study=study,
        results=results,
        tally=outcome.tally,
        said=first_words(outcome),
        chosen=[(index, int(results.numbers[index])) for index in results.chosen],
        front=rows[:MOST_FRONT_ROWS].tolist(),
        on_front=len(rows),
        effects=[in_words(effect) for effect in results.effects if effect.sure],
        figures=figures,
        own=short(study.finger.name),
        strains=[(name, picture) for name, finger in pictured
                 if fields and (picture := _strain(finger, outcome, progress))],
    )  # fmt: skip
    write_text(path, text)


def in_words(effect: Effect) -> str:
    """An effect as a sentence."""
    change, low, high = map(number, (effect.change, *effect.interval))
    verb = f"multiplies {effect.objective} by" if effect.factor else f"changes {effect.objective} by"
    return f"{effect.parameter} from {number(effect.low)} to {number(effect.high)} {verb} {change} ({low} to {high})"


def _strain(finger: Finger, outcome: Outcome, progress: Progress) -> Markup | None:
    """The picture of the strain field under the largest force of the scene on its hardest specimen."""
    scene = outcome.study.scene
    specimen = finger.bench.specimen(scene.modulus_MPa[1])
    try:
        reduced = fem.prepare(finger, progress=progress)
        press = view.shown(reduced, specimen, force=scene.force_N[1], friction=0.0)
        return either(
            view.strain_pictures(finger, reduced, press, specimen, progress),
            f"Strain field of {short(finger.name)}",
            "png",
        )
    except PapillaError:
        return None


def front_figure(results: Results, base: dict[str, float]) -> Figure:
    """All designs over the first two objectives, with the front, the chosen designs and the study's own finger marked.

    With a single objective: the designs over the first parameter.
    """
    study = results.study
    goal, *others = study.objectives
    first, base_cost = results.values(goal.name), base[goal.name]
    across = results.values(others[0].name) if others else results.free[:, 0]
    with styled() as figure:
        axes = figure.subplots()
        ok, on = results.feasible, results.front
        axes.plot(across[~ok], first[~ok], ".", color=FAINT_COLOR, label="breaks a constraint")
        axes.plot(across[ok], first[ok], ".", color=MUTED_COLOR, label="designs")
        if others:
            axes.plot(across[on], first[on], "o", color=ACCENT_COLORS[0], label="Pareto front")
            axes.plot([base[others[0].name]], [base_cost], "s", color=INK_COLOR, label=short(study.finger.name))
        else:
            axes.axhline(base_cost, color=INK_COLOR, linewidth=THIN_PT, label=short(study.finger.name))
        axes.plot(
            across[results.chosen],
            first[results.chosen],
            "*",
            color=ACCENT_COLORS[1],
            markersize=STAR_SIZE_PT,
            label="chosen",
        )
        for values, axis, scale in ((first, axes.yaxis, axes.set_yscale), (across, axes.xaxis, axes.set_xscale)):
            if (values > 0).all() and values.max() > LOGARITHMIC_AXIS_RATIO * values.min():
                scale("log")
                plain_log(axis)
        axes.set(xlabel=_named(others[0]) if others else study.free[0].name, ylabel=_named(goal))
        axes.legend()
    return figure


def sigma_figure(forces: np.ndarray, moduli: np.ndarray, sigmas: Sequence[tuple[str, np.ndarray]]) -> Figure:
    """Sigma (f, m) of ln E over force and modulus, one panel per design, with its name."""
    levels = np.log10(SIGMA_LEVELS_PERCENT)
    with styled() as figure:
        panels = figure.subplots(1, len(sigmas), sharey=True, squeeze=False)[0]
        for axes, (title, sigma) in zip(panels, sigmas, strict=True):
            percent = np.clip(PER_CENT * sigma, SIGMA_LEVELS_PERCENT[0], SIGMA_LEVELS_PERCENT[-1])
            shades = axes.contourf(forces, moduli, np.log10(percent).T, levels=levels, cmap="YlOrBr", extend="both")
            axes.set(xscale="log", yscale="log", xlabel="force (N)")
            axes.set_title(textwrap.fill(title, TITLE_LETTERS), fontsize="medium")
            plain_log(axes.yaxis)
            ticks = np.geomspace(forces[0], forces[-1], PANEL_FORCE_TICKS)
            axes.set_xticks(ticks, [f"{tick:.2g}" for tick in ticks])
            axes.xaxis.set_minor_locator(NullLocator())
        panels[0].set_ylabel("modulus of the specimen (MPa)")
        bar = color_bar(shades, panels, "sigma of ln E")
        bar.set_ticks(list(levels), labels=[f"{level:g} %" for level in SIGMA_LEVELS_PERCENT])
    return figure


def _named(objective: Objective) -> str:
    return objective.name if objective.unit == "1" else f"{objective.name} ({objective.unit})"
