"""Results of a study: the table, the Pareto front, main effects with intervals, and the chosen designs; as values for
JSON and as sentences."""

import math
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from functools import cached_property
from importlib.util import find_spec
from itertools import compress, islice
from pathlib import Path

import numpy as np
from scipy.special import stdtrit

from papilla.calibration import INTERVAL_PROBABILITY
from papilla.core.errors import InputError, SolverError
from papilla.core.files import replacing
from papilla.core.units import PER_CENT
from papilla.design.batch import STATUS_OK, JudgedDesign, judged
from papilla.design.confirming import Confirmed
from papilla.design.geometry import STAGE_GAUGES, STAGE_GEOMETRY, STAGE_RATIO, STAGE_SCENES
from papilla.design.running import Tally
from papilla.design.store import Store
from papilla.design.study import Study
from papilla.design.texts import short
from papilla.logs.frames import estimates_writer
from papilla.model.finger import Finger

CHOSEN_DESIGNS = 3
"""Number of designs for which a file is written: the best in the first objective."""
DISTINCT_RANGE_SHARE = 0.05
"""Share of its range by which two chosen designs differ in at least one parameter."""
ROWS_AT_ONCE = 2000
"""Number of rows that are written at once."""
REJUDGED_DIFFERENCE = 1e-6
"""Largest relative difference between a stored value and that of the design when it is judged again."""
MANY_FAILED = 0.1
"""Share of failed designs above which a study mentions it first."""


@dataclass(frozen=True)
class Effect:
    """Effect of a parameter on an objective from the low to the high end of its range, with the others unchanged: a
    factor, or a difference if the objective is not positive everywhere; with a 95 % interval."""

    parameter: str
    objective: str
    low: float
    high: float
    change: float
    interval: tuple[float, float]
    factor: bool

    @property
    def sure(self) -> bool:
        """Whether the interval excludes "no effect"."""
        nothing = 1.0 if self.factor else 0.0
        return not self.interval[0] <= nothing <= self.interval[1]


@dataclass(frozen=True, eq=False)
class Results:
    """Designs of a study, n of which succeeded. numbers (n,); free (n, p); found (n, a) by `study.asked`; feasible
    (n,); fingers : `sha256` of the n fingers that were judged; failures : number -> reason."""

    study: Study
    numbers: np.ndarray
    free: np.ndarray
    found: np.ndarray
    feasible: np.ndarray
    fingers: Sequence[str]
    failures: dict[int, str]

    @classmethod
    def of(cls, study: Study, store: Store) -> "Results":
        """The results in a store; raises `InputError` if no design succeeded, and `FileFormatError` for a row that
        papilla did not write."""
        failures: dict[int, str] = {}
        rows = []
        for number, free, record in store.rows(study):
            if record.status != STATUS_OK:
                failures[number] = record.status
                continue
            asked = [record.found[name] for name in study.asked]
            point = [free[name] for name in study.free_names]
            rows.append((number, point, asked, study.feasible(record.found), record.finger_sha256))
        if not rows:
            first = next(iter(failures.values()), "nothing was run")
            raise InputError(f"none of the {len(failures)} designs of the study has an answer; the first says: {first}")
        *columns, fingers = zip(*rows, strict=True)
        numbers, values, objectives, feasible = map(np.array, columns)
        return cls(study, numbers, values, objectives, feasible, fingers, failures)

    def values(self, objective: str) -> np.ndarray:
        """(n,) values of an objective."""
        return self.found[:, self.study.asked.index(objective)]

    @cached_property
    def costs(self) -> np.ndarray:
        """(n, o) values of the study's objectives, with the sign that makes less better."""
        return np.column_stack([goal.sign * self.values(goal.name) for goal in self.study.objectives])

    @cached_property
    def front(self) -> np.ndarray:
        """(n,) whether a design meets all limits and no other such design is better in one objective and at least as
        good in all."""
        on_front = np.zeros(len(self.numbers), bool)
        rows = np.flatnonzero(self.feasible)
        front_costs = np.zeros((0, self.costs.shape[1]))
        for design in rows[np.lexsort(self.costs[rows].T)]:
            cost = self.costs[design]
            if not ((front_costs <= cost).all(axis=1) & (front_costs < cost).any(axis=1)).any():
                on_front[design] = True
                front_costs = np.vstack([front_costs, cost])
        return on_front

    @cached_property
    def chosen(self) -> list[int]:
        """Rows of the best designs in the first objective that meet all limits, each different from the others."""
        rows = np.flatnonzero(self.feasible)
        shares = self._shares
        chosen: list[int] = []
        for design in rows[np.argsort(self.costs[rows, 0], kind="stable")].tolist():
            if all(np.abs(shares[design] - shares[better]).max() > DISTINCT_RANGE_SHARE for better in chosen):
                chosen.append(design)
            if len(chosen) == CHOSEN_DESIGNS:
                break
        return chosen

    def finger(self, design: int) -> Finger:
        """The finger of a row."""
        return self.study.finger_of(self.free_of(design))

    def free_of(self, design: int) -> dict[str, float]:
        """Values of the free parameters of a row, by name."""
        return dict(zip(self.study.free_names, self.free[design].tolist(), strict=True))

    @cached_property
    def _shares(self) -> np.ndarray:
        """(n, p) shares of the ranges at which the values of free parameters lie."""
        columns = zip(self.study.free, self.free.T, strict=True)
        return np.array([[free.share(value) for value in values] for free, values in columns]).T

    def check_chosen(self, store: Store) -> None:
        """Judge the chosen designs again; raises `FileFormatError` for a design that has another finger or other values
        than its record, which papilla then did not write."""
        for design in self.chosen:
            number, finger = int(self.numbers[design]), self.finger(design)
            if finger.sha256 != self.fingers[design]:
                raise store.fault(number, "its record is of another finger than its parameters make")
            again = judged(self.study.in_scene(finger), self.study.asked)
            for name, stored in zip(self.study.asked, self.found[design].tolist(), strict=True):
                if again.status != STATUS_OK or not math.isclose(
                    again.found[name], stored, rel_tol=REJUDGED_DIFFERENCE
                ):
                    now = f"{again.found[name]:.7g}" if again.status == STATUS_OK else f"no value ({again.status})"
                    raise store.fault(number, f"{name} is {stored:.7g} there, and {now} when it is judged again")

    def save_finger(self, design: int, path: Path) -> None:
        """Write the design file of a row; raises `SolverError`, and writes nothing, if it would hold another finger
        than the one that was judged."""
        with replacing(path) as temporary:
            self.finger(design).save(temporary)
            if Finger.load(temporary).sha256 != self.fingers[design]:
                raise SolverError(f"{path} was not written: it would hold another finger than design "
                                  f"{self.numbers[design]}, which was judged")  # fmt: skip

    @cached_property
    def effects(self) -> list[Effect]:
        """Main effects of all parameters on all objectives, by least squares over all designs; empty if there are too
        few."""
        varied = (self.free != self.free[0]).any(axis=0)
        free, shares = list(compress(self.study.free, varied)), self._shares[:, varied]
        freedom = len(shares) - len(free) - 1
        if freedom < 3 or not free:
            return []
        terms = np.column_stack([np.ones(len(shares)), shares])
        inverse = np.linalg.pinv(terms.T @ terms)
        half = float(stdtrit(freedom, 0.5 + INTERVAL_PROBABILITY / 2))
        effects = []
        for goal in self.study.objectives:
            values = self.values(goal.name)
            factor = bool((values > 0).all())
            y = np.log(values) if factor else values
            slopes = inverse @ terms.T @ y
            noise = float(np.sum((y - terms @ slopes) ** 2)) / freedom
            for k, parameter in enumerate(free, start=1):
                wide = half * float(np.sqrt(noise * inverse[k, k]))
                ends = [float(slopes[k] + side * wide) for side in (0, -1, 1)]
                change, low, high = np.exp(ends).tolist() if factor else ends
                span = parameter.low, parameter.high
                effects.append(Effect(parameter.name, goal.name, *span, change, (low, high), factor))
        return effects


def write_tables(path: Path, study: Study, store: Store, front: Sequence[int]) -> list[Path]:
    """Write the table of all designs, including failed ones, as CSV, and as Parquet if pyarrow is installed.

    front : numbers of the designs on the front. Rows are written in blocks. Returns the files that were written.
    """
    free_names = study.free_names
    names = ["design", *free_names, *study.asked, "feasible", "front", "finger_sha256", "status"]
    on_front, rows = set(front), store.rows(study)

    def cells(number: int, free: dict[str, float], record: JudgedDesign) -> list:
        values = [record.found.get(name, float("nan")) for name in study.asked]
        feasible = record.status == STATUS_OK and study.feasible(record.found)
        point = [free[name] for name in free_names]
        return [number, *point, *values, feasible, number in on_front, record.finger_sha256, record.status]

    paths = [path, path.with_suffix(".parquet")][: 1 + bool(find_spec("pyarrow"))]
    with ExitStack() as opened:
        writes = [opened.enter_context(estimates_writer(table, names)) for table in paths]
        while block := list(islice(rows, ROWS_AT_ONCE)):
            *numbers, fingers, status = zip(*(cells(*design) for design in block), strict=True)
            columns = [np.array(column) * 1 for column in numbers]
            for write in writes:
                write([*columns, fingers, status])
    return paths


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


def summary(outcome: Outcome) -> dict:
    """A study as plain values, the keys of `papilla design --json`."""
    study, results, tally = outcome.study, outcome.results, outcome.tally
    goals = [goal.name for goal in study.objectives]
    best = []
    for index, file in zip(results.chosen, outcome.written["fingers"], strict=True):
        values = {name: float(results.values(name)[index]) for name in study.asked}
        best.append({"design": int(results.numbers[index]), "finger": file, "finger_sha256": results.fingers[index],
                     "free": results.free_of(index), "objectives": values})  # fmt: skip
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
                "parameter": effect.parameter,
                "objective": effect.objective,
                "from": effect.low,
                "to": effect.high,
                "factor" if effect.factor else "difference": effect.change,
                "interval": list(effect.interval),
            }
            for effect in results.effects
        ],
        "confirmed": [
            {"finger": confirmation.name, "failed": confirmation.failed}
            | {
                channel: dict(zip(("predicted", "calibrated"), confirmation.both(channel), strict=True))
                for channel in confirmation.predicted
            }
            for confirmation in outcome.confirmed
        ],
        "cost": {
            "seconds": tally.seconds,
            "seconds_geometry": tally.spent[STAGE_GEOMETRY] + tally.spent[STAGE_RATIO],
            "seconds_designs": tally.spent[STAGE_GAUGES] + tally.spent[STAGE_SCENES],
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
    sentences = []
    if outcome.failed_share > MANY_FAILED:
        reasons, counts = np.unique(list(results.failures.values()), return_counts=True)
        sentences.append(
            f"{len(results.failures)} of {total} designs failed ({PER_CENT * outcome.failed_share:.0f} %), most often: "
            f"{reasons[counts.argmax()]}"
        )
    if not results.chosen:
        sentences.append(f"no design of {total} keeps all constraints")
        return sentences
    for goal in study.objectives:
        best, base = float(results.values(goal.name)[results.chosen[0]]), outcome.base[goal.name]
        unit = "" if goal.unit == "1" else f" {goal.unit}"
        sentences.append(f"{goal.words}: best {best:.4g}{unit}, {short(study.finger.name)} {base:.4g}{unit}")
    return sentences
