"""Runs the designs of a study: batches go to workers, records come back and are stored; stored designs are not run
again. `price` estimates the cost before.

Workers are processes on this machine, or those of a given Dask scheduler; both are used through the interface of
`concurrent.futures`, and both replace a killed worker and begin its batch again. What a worker sends is checked. A few
batches are in progress at a time, so memory does not grow with the study.
"""

import hashlib
import math
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Executor, Future, wait
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from itertools import islice, zip_longest
from time import perf_counter

from papilla.core import cache
from papilla.core.errors import InputError, SolverError, WorkerKilledError
from papilla.core.progress import CountedStep, Progress, silent
from papilla.core.workers import MOST_TRIES, Processes, one_thread_each
from papilla.design import sampling
from papilla.design.batch import STATUS_OK, Batch, Done, JudgedDesign, check_done, evaluate, judged, version
from papilla.design.cluster import Scheduler, cluster
from papilla.design.geometry import measure_base, with_sites
from papilla.design.in_scene import DesignInScene
from papilla.design.sampling import Values
from papilla.design.store import Store
from papilla.design.study import Study, probes

DESIGNS_PER_BATCH = 50
"""Number of designs in a batch: 0.5 to 1 s of work, compared with 8 ms that a task costs in Dask; a killed client loses
the batches in progress."""
BATCHES_PER_WORKER = 2
"""Number of batches in progress for each worker."""
PRICED_DESIGNS = 5
"""Number of designs whose cost is measured for an estimate."""

Row = tuple[int, Values, str]
"""A design: number, values of its free parameters, key of its record."""


@dataclass
class Tally:
    """What a run cost. spent : processor seconds of all workers by stage of `geometry`; memory_MB : of the largest
    one."""

    designs: int = 0
    reused: int = 0
    failed: int = 0
    seconds: float = 0.0
    spent: defaultdict[str, float] = field(default_factory=partial(defaultdict, float))
    memory_MB: float = 0.0
    workers: int = 1
    how: str = "this process"
    notes: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class Pool:
    """An executor with `workers` workers, and what to call them."""

    executor: Executor | Processes
    workers: int
    how: str


@contextmanager
def pool(workers: int, scheduler: Scheduler | None) -> Iterator[Pool]:
    """Workers of a Dask scheduler, `workers` processes here, or this process (0). Raises what `cluster` raises."""
    if scheduler is not None:
        with cluster(scheduler) as (executor, count, how):
            yield Pool(executor, count, how)
        return
    if not workers:
        yield Pool(_Here(), 1, "this process")
        return
    with one_thread_each(), Processes(workers) as processes:
        try:
            yield Pool(processes, workers, f"{workers} process{'es' * (workers > 1)} on this machine")
        except BaseException:
            processes.kill()
            raise


def run(
    study: Study, store: Store, *, workers: int = 1, scheduler: Scheduler | None = None, progress: Progress = silent
) -> Tally:
    """Run a study and store its records; stored records are not computed again.

    workers : processes on this machine, 0 for this process. progress : told the designs done, and those in all. Raises
    what `pool` raises, and `FileAccessError` if the store cannot be written.
    """
    began, tally = perf_counter(), Tally()
    if note := measure_base(with_sites(study.finger, study.places), 1, progress):
        tally.notes.append(note)
    with pool(workers, scheduler) as running_pool:
        tally.workers, tally.how = running_pool.workers, running_pool.how
        runner = _Runner(study, store, tally, progress, running_pool)
        if study.sampler.kind == "optimise":
            sampling.optimised(study, runner.scores)
        else:
            runner.run(sampling.groups(study))
    tally.seconds = perf_counter() - began
    return tally


class _Here(Executor):
    """This process as an executor."""

    def submit(self, fn, /, *args, **kwargs):
        future: Future = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except BaseException as error:
            future.set_exception(error)
        return future


@dataclass
class _Runner:
    study: Study
    store: Store
    tally: Tally
    progress: Progress
    pool: Pool
    number: int = 0

    def __post_init__(self) -> None:
        study, self.place = self.study, self.study.places
        self.records: dict[int, JudgedDesign] | None = {} if study.sampler.kind == "optimise" else None
        self.total = sampling.count(study)[0]
        self.began = perf_counter()
        # Of all its designs: the client would spend a millisecond on each
        self.shared = cache.key("papilla.design.batch", study.finger.sha256, study.scene, study.asked, self.place)

    def run(self, groups: Iterable[list[Values]]) -> None:
        """Store the records of designs; at most `BATCHES_PER_WORKER` batches a worker are in flight.

        The records of designs that an optimiser asks for are kept, too.
        """
        flight: dict[Future, tuple[list[Row], Batch]] = {}
        try:
            for rows, batch in self._interleaved(groups):
                flight[self.pool.executor.submit(evaluate, batch)] = rows, batch
                while len(flight) >= BATCHES_PER_WORKER * self.pool.workers:
                    self._take(flight)
            while flight:
                self._take(flight)
        except CancelledError as error:
            raise SolverError(f"{self.pool.how} was lost; --resume goes on with what is stored") from error

    def scores(self, designs: list[Values]) -> list[float]:
        """The scores of designs for an optimiser: the first objective, smaller is better."""
        first = self.number
        self.run([designs])
        assert self.records is not None
        goal, scores = self.study.objectives[0], []
        for record in (self.records[first + k] for k in range(len(designs))):
            if record.status != STATUS_OK:
                scores.append(sampling.FAILED_SCORE)
                continue
            beyond = sum(
                max(limit.least - record.found[name], record.found[name] - limit.most, 0.0)
                for name, limit in self.study.limits.items()
            )
            scores.append(
                goal.sign * record.found[goal.name] if not beyond else sampling.FAILED_SCORE / 1000 * (1 + beyond)
            )
        return scores

    def _interleaved(self, groups: Iterable[list[Values]]) -> Iterator[tuple[list[Row], Batch]]:
        """The batches to run; batches of as many geometries as there are workers alternate, so that each worker starts
        with another geometry."""
        waiting = iter(groups)
        while turn := list(islice(waiting, self.pool.workers)):
            for batches in zip_longest(*map(self._batches, turn)):
                yield from filter(None, batches)

    def _batches(self, group: list[Values]) -> Iterator[tuple[list[Row], Batch]]:
        first, self.number = self.number, self.number + len(group)
        size = min(DESIGNS_PER_BATCH, max(1, math.ceil(len(group) / self.pool.workers)))
        for start in range(0, len(group), size):
            yield from self._prepared(first + start, group[start : start + size])

    def _prepared(self, first: int, designs: Sequence[Values]) -> Iterator[tuple[list[Row], Batch]]:
        """A batch of the designs that are not in the store, if any; impossible ones are stored as failed at once."""
        study = self.study
        tried, failed = [], []
        for number, free in enumerate(designs, start=first):
            try:
                finger = study.finger_of(free)
            except InputError as error:
                failed.append((number, free, cache.key(__name__, study.sha256, free), JudgedDesign.failed(error)))
                continue
            key = hashlib.sha256(f"{finger.sha256} {self.shared}".encode()).hexdigest()
            tried.append(((number, free, key), finger))
        stored = self.store.known({design[2]: design[0] for design, _ in tried}, study.asked)
        for (number, _, key), finger in tried:
            if key in stored and stored[key].finger_sha256 != finger.sha256:
                raise self.store.fault(number, "its record is of another finger")
        reused = [(*design, stored[design[2]]) for design, _ in tried if design[2] in stored]
        self.tally.reused += len(reused)
        self._store(reused + failed)
        if fresh := [(design, finger) for design, finger in tried if design[2] not in stored]:
            rows, fingers = zip(*fresh, strict=True)
            batch = Batch(fingers, study.finger, self.place, study.scene, study.asked, version(), study.geometry)
            yield list(rows), batch

    def _take(self, flight: dict[Future, tuple[list[Row], Batch]]) -> None:
        """Store the finished batches."""
        finished, _ = wait(flight, return_when=FIRST_COMPLETED)
        for future in finished:
            rows, batch = flight.pop(future)
            try:
                report: Done = future.result()
            except Exception as error:
                # By its name: the error of Dask, which may not be installed
                if not isinstance(error, WorkerKilledError) and type(error).__name__ != "KilledWorker":
                    raise
                why = f"its worker was killed {MOST_TRIES} times"
                records = [JudgedDesign.failed(why, finger.sha256) for finger in batch.fingers]
                report = Done(tuple(records), version(), {}, 0.0)
            check_done(report, batch)
            self._store([(*design, record) for design, record in zip(rows, report.records, strict=True)])
            for name, seconds in report.spent.items():
                self.tally.spent[name] += seconds
            self.tally.memory_MB = max(self.tally.memory_MB, report.memory_MB)

    def _store(self, rows: list) -> None:
        if not rows:
            return
        self.store.add(self.study.sha256, rows)
        if self.records is not None:
            self.records |= {design[0]: design[3] for design in rows}
        self.tally.designs += len(rows)
        self.tally.failed += sum(design[3].status != STATUS_OK for design in rows)
        finished, fresh = self.tally.designs, self.tally.designs - self.tally.reused
        seconds = (perf_counter() - self.began) * max(self.total - finished, 0) / max(fresh, 1)
        rest = f", about {seconds:.0f} s left" if fresh and finished < self.total else ""
        self.progress(CountedStep(f"designs, {finished} of {self.total}{rest}", finished, self.total))


@dataclass(frozen=True)
class Price:
    """Designs and geometries of a study, places of gauges, seconds of a design and of a geometry, measured here, and
    whether the geometry came from the cache."""

    designs: int
    geometries: int
    sites: int
    per_design: float
    per_geometry: float
    cached: bool

    def seconds(self, workers: int) -> float:
        """Approximate duration of the study with `workers` workers; the geometry that was measured is in the cache."""
        return ((self.geometries - 1) * self.per_geometry + self.designs * self.per_design) / workers


def price(study: Study, progress: Progress) -> Price:
    """Measure the middle geometry and a few of its designs; the results stay in the cache."""
    places = study.places
    designs, geometries = sampling.count(study)
    base = with_sites(study.finger, places)
    measure_base(base, 1, progress)
    progress("reducing one geometry")
    began = perf_counter()
    tried = [study.finger_of(free) for free in islice(probes(study), PRICED_DESIGNS)]
    first = with_sites(tried[0], places)
    geometry = study.geometry(first, places, base)
    took = perf_counter() - began
    cached = took < 1.0
    began = perf_counter()
    for finger in tried:
        judged(DesignInScene(finger, geometry, study.scene), study.asked)
    seconds = (perf_counter() - began) / len(tried)
    return Price(designs, geometries, len(first.gauges), seconds, took, cached)
