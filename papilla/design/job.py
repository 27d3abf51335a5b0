"""`papilla design` as a function: runs a study, and writes its table, its page and the files of the chosen designs."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from papilla.design.confirming import Confirmed, confirm
from papilla.design.costs import GAUGES, GEOMETRY, RATIO, SCENES
from papilla.design.geometry import geometry_map, with_sites
from papilla.design.in_scene import DesignInScene
from papilla.design.results import Results, write_tables
from papilla.design.running import Stage, Tally, run
from papilla.design.store import Store
from papilla.design.study import Study
from papilla.errors import InputError
from papilla.files import check_writable
from papilla.finger import Finger
from papilla.units import PER_CENT

MANY_FAILED = 0.1
"""Share of failed designs above which a study mentions it first."""


@dataclass(frozen=True, eq=False)
class Outcome:
    """The results of a study. chosen : files of the best designs; base : the study's own finger in the scene."""

    study: Study
    results: Results
    tally: Tally
    base: dict[str, float]
    confirmed: list[Confirmed]
    written: dict[str, list[str]]

    @property
    def failed_share(self) -> float:
        """Share of the designs that failed."""
        failed = len(self.results.failures)
        return failed / (failed + len(self.results.numbers))


def run_study(
    study: Study,
    out: Path,
    *,
    resume: bool = False,
    workers: int = 1,
    scheduler: str | None = None,
    say: Callable[[str], None] = lambda line: None,
    stage: Stage = lambda line, done, total: None,
) -> Outcome:
    """Run a study and write designs.csv (and .parquet), study.html and finger_1.toml, ... into a folder.

    resume : continue with the designs of this study in the folder's store; without it, such a store is refused. Raises
    `InputError` if no design has an answer, and what `papilla.design.running.run` raises.
    """
    from papilla.design.page import write_page

    check_writable(out)
    store = Store(study.store or out / "store.sqlite")
    try:
        if study.store is None and not resume and store.holds(study.sha256):
            raise InputError(f"{store.path} holds designs of this study: --resume goes on with them")
        tally = run(study, store, workers=workers, scheduler=scheduler, say=say, stage=stage)
        results = Results.of(study, store)
        front = results.numbers[results.front].tolist()
        tables = write_tables(out / "designs.csv", study, store, front)
    finally:
        store.close()
    files, confirmed = [], []
    for rank, row in enumerate(results.chosen, start=1):
        path = out / f"finger_{rank}.toml"
        results.finger(row).save(path)
        files.append(path)
    for rank, row in enumerate(results.chosen[: study.confirm], start=1):
        say(f"confirming design {rank} by a calibration")
        confirmed.append(confirm(f"finger_{rank}.toml", in_scene(study, results.finger(row)), workers or 1, say))
    if study.confirm:
        say("calibrating the study's own finger")
        confirmed.append(confirm(study.finger.name, in_scene(study, study.finger), workers or 1, say))
    base = {}
    for one in study.objectives:
        try:
            base[one.name] = one.of(in_scene(study, study.finger))
        except InputError:
            base[one.name] = float("nan")
    page = out / "study.html"
    written = {"tables": list(map(str, tables)), "fingers": list(map(str, files)), "page": [str(page)]}
    outcome = Outcome(study, results, tally, base, confirmed, written)
    write_page(page, outcome, say)
    return outcome


def in_scene(study: Study, finger: Finger) -> DesignInScene:
    """A finger in the scene of a study, with the study's places."""
    places = study.places
    base, own = with_sites(study.finger, places), with_sites(finger, places)
    return DesignInScene(finger, geometry_map(own, places, base), study.scene)


def summary(outcome: Outcome) -> dict:
    """A study as plain values, the keys of `papilla design --json`."""
    study, results, tally = outcome.study, outcome.results, outcome.tally
    goals = [one.name for one in study.objectives]
    best = []
    for row, file in zip(results.chosen, outcome.written["fingers"], strict=True):
        free = dict(zip((one.name for one in study.free), results.free[row].tolist(), strict=True))
        found = {name: float(results.values(name)[row]) for name in study.asked}
        best.append({"design": int(results.numbers[row]), "finger": file, "free": free, "objectives": found})
    return {
        "study": study.name,
        "designs": len(results.numbers) + len(results.failures),
        "failed": len(results.failures),
        "reused": tally.reused,
        "feasible": int(results.feasible.sum()),
        "front": int(results.front.sum()),
        "objectives": goals,
        "base": outcome.base,
        "best": best,
        "effects": [
            {
                "parameter": one.parameter,
                "objective": one.objective,
                "from": one.low,
                "to": one.high,
                "factor" if one.factor else "difference": one.change,
                "interval": list(one.interval),
            }
            for one in results.effects
        ],
        "confirmed": [
            {"finger": one.name, "failed": one.failed}
            | {
                channel: dict(zip(("predicted", "calibrated"), one.both(channel), strict=True))
                for channel in one.predicted
            }
            for one in outcome.confirmed
        ],
        "cost": {
            "seconds": tally.seconds,
            "seconds_geometry": tally.spent[GEOMETRY] + tally.spent[RATIO],
            "seconds_designs": tally.spent[GAUGES] + tally.spent[SCENES],
            "processor_seconds": dict(tally.spent),
            "workers": tally.workers,
            "worker_memory_MB": tally.memory_MB,
        },
        "notes": tally.notes,
        "written": outcome.written,
    }


def first_words(outcome: Outcome) -> list[str]:
    """First sentences on a study: failures if there are many, then the result."""
    study, results = outcome.study, outcome.results
    total = len(results.numbers) + len(results.failures)
    said = []
    if outcome.failed_share > MANY_FAILED:
        reasons, counts = np.unique(list(results.failures.values()), return_counts=True)
        said.append(
            f"{len(results.failures)} of {total} designs failed ({PER_CENT * outcome.failed_share:.0f} %), most often: "
            f"{reasons[counts.argmax()]}"
        )
    if not results.chosen:
        said.append(f"no design of {total} keeps all constraints")
        return said
    for one in study.objectives:
        best, own = float(results.values(one.name)[results.chosen[0]]), outcome.base[one.name]
        unit = "" if one.unit == "1" else f" {one.unit}"
        said.append(f"{one.words}: best {best:.4g}{unit}, {study.finger.name} {own:.4g}{unit}")
    return said
