"""`papilla design`: studies of designs, and optimal places of gauges."""

import os
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING

from papilla.cli.options import DEFAULT_PROCESSES, argument, keep_inputs, option
from papilla.cli.output import CommandResult, progress, say, show_rows, tell
from papilla.core.errors import InputError
from papilla.core.units import MS_PER_S

if TYPE_CHECKING:
    from papilla.design.results import Outcome
    from papilla.design.study import Study

MOST_PLACED_GAUGES = 8
"""Largest number of gauges that can be placed."""


def design(
    study: Path = argument(..., "Study file (TOML).", metavar="STUDY.toml"),
    out: Path = option(Path("study"), "Folder for the results."),
    resume: bool = option(False, "Continue with the designs of this study that are in the folder.", "--resume"),
    explain: bool = option(False, "Estimate the duration of the study by a measurement, and run nothing.", "--explain"),
    place: int | None = option(None, "Place 1 to N gauges on the study's finger instead (1 to 8).", metavar="N"),
    scheduler: str | None = option(None, "Dask scheduler whose workers to use.", metavar="tls://HOST:PORT"),
    tls_ca: Path | None = option(None, "Certificate of the authority of the scheduler.", "--tls-ca"),
    tls_cert: Path | None = option(None, "Certificate by which the scheduler knows you.", "--tls-cert"),
    tls_key: Path | None = option(None, "Key of this certificate.", "--tls-key"),
    insecure: bool = option(
        False, "Accept a scheduler at tcp://: whoever reaches it runs code as you, and reads all.", "--insecure"
    ),
    workers: int | None = option(None, f"Worker processes on this machine.  [default: {DEFAULT_PROCESSES}]"),
) -> CommandResult:
    """Run a study: which design meets the objectives best.

    Writes designs.csv, study.html and the design files of the three best. A study is a TOML file: free, fixed and
    coupled parameters, the scene, objectives, constraints, and a sampler; docs/design_studies.md explains it.
    """
    began = perf_counter()
    if workers is not None and not 1 <= workers <= 4 * (os.cpu_count() or 1):
        raise InputError(f"--workers must be from 1 to {4 * (os.cpu_count() or 1)}, got {workers}")
    if workers is not None and scheduler is not None:
        raise InputError("give --workers (processes on this machine) or --scheduler, not both")
    if place is not None and not 1 <= place <= MOST_PLACED_GAUGES:
        raise InputError(f"--place must be from 1 to {MOST_PLACED_GAUGES}, got {place}")
    at = None
    if scheduler is not None:
        from papilla.design.cluster import Scheduler

        at = Scheduler(scheduler, tls_ca, tls_cert, tls_key, insecure)
    elif insecure or any((tls_ca, tls_cert, tls_key)):
        raise InputError(
            "--tls-ca, --tls-cert, --tls-key and --insecure are for --scheduler; other studies open no port"
        )
    from papilla.design.study import read_study

    read = read_study(study)
    keep_inputs([study], [out / "designs.csv", out / "study.html"])
    count = workers or DEFAULT_PROCESSES
    if explain:
        return _explain(read, count)
    if place is not None:
        return _place(read, place, out)
    from papilla.design.job import run_study
    from papilla.design.results import summary

    with progress() as reporter:
        outcome = run_study(read, out, resume=resume, workers=count, scheduler=at, progress=reporter)
    result = summary(outcome)
    return CommandResult(result, partial(_show, read, outcome, result, perf_counter() - began))


def _show(read: "Study", outcome: "Outcome", result: dict, seconds: float) -> None:
    """Print the results of a study: first sentences, the chosen designs, and the page."""
    from papilla.design.results import first_words

    for line in first_words(outcome):
        tell(line)
    for confirmed in outcome.confirmed:
        tell(confirmed.sentence)
    heads = ["", *(option.name for option in read.free), *(goal.name for goal in read.objectives)]
    rows = [
        [f"finger_{k}.toml", *(f"{value:.4g}" for value in confirmed["free"].values())]
        + [f"{confirmed['objectives'][goal.name]:.4g}" for goal in read.objectives]
        for k, confirmed in enumerate(result["best"], start=1)
    ]
    if rows:
        show_rows(heads, rows)
    tell(f"{result['designs']} designs in {seconds:.0f} s: {outcome.written['page'][0]}")


def _explain(study: "Study", workers: int) -> CommandResult:
    from papilla.design.running import price

    with progress() as reporter:
        prices = price(study, reporter)
    seconds = prices.seconds(workers)

    def show() -> None:
        at_most = "at most " if study.sampler.kind == "optimise" else ""
        tell(f"{at_most}{prices.designs} designs of {prices.geometries} geometries, gauges at {prices.sites} places")
        geometry = "from the cache" if prices.cached else f"{prices.per_geometry:.0f} s"
        tell(f"a geometry: {geometry}; a design: {MS_PER_S * prices.per_design:.0f} ms")
        tell(f"about {seconds:.0f} s with {workers} workers, and {study.confirm} calibrations at the end")
        if prices.cached and prices.geometries > 1:
            say("the other geometries may not be in the cache: half a minute each on an idle core")

    return CommandResult(vars(prices) | {"workers": workers, "seconds": seconds}, show)


def _place(study: "Study", count: int, out: Path) -> CommandResult:
    from papilla.design.placement import place_gauges

    with progress() as reporter:
        placement = place_gauges(study, count, out, reporter)
    chosen = placement.of(placement.sets[-1]).gauges
    keys = ("name", "angle_deg", "y_mm", "direction_deg")
    gauges = [{key: getattr(gauge, key) for key in keys} for gauge in chosen]

    def show() -> None:
        for line in placement.sentences:
            tell(line)
        show_rows(keys, [[gauge["name"], *(f"{gauge[key]:g}" for key in keys[1:])] for gauge in gauges])
        tell(f"written: {', '.join(placement.written)}")

    return CommandResult({"gauges": gauges, "sigma": placement.sigma, "written": placement.written}, show)
