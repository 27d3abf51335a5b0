"""Runs the designs of a study: batches go to workers, records come back and are stored; stored designs are not run
again. `price` estimates the cost before.

Workers belong to a Dask cluster (processes on this machine, or a given scheduler), which restarts a task on another
worker if one is killed; without Dask they are plain processes. Both are used through the interface of
`concurrent.futures`. A few batches are in progress at a time, so memory does not grow with the study.
"""

import hashlib
import logging
import math
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from itertools import islice, zip_longest
from multiprocessing import get_context
from time import perf_counter
from typing import Any

from papilla.core import cache
from papilla.core.errors import InputError, MissingExtraError, SolverError
from papilla.core.workers import THREADS, end_with_parent
from papilla.design import sampling
from papilla.design.batch import OK, Batch, Done, Record, evaluate, judged, version
from papilla.design.geometry import geometry_map, measure_base, with_sites
from papilla.design.in_scene import DesignInScene
from papilla.design.sampling import Values
from papilla.design.store import Store
from papilla.design.study import Study, probes

BATCH = 50
"""Number of designs in a batch: 0.5 to 1 s of work, compared with 8 ms that a task costs in Dask; a killed client loses
the batches in progress."""
AHEAD = 2
"""Number of batches in progress for each worker."""
MEMORY = "3GiB"
"""Memory limit of a worker on this machine; a geometry needs up to 1.5 GB to reduce, and 1 to 12 MB afterwards."""
ANSWER_S = 20
"""Seconds within which a scheduler answers."""
RETRIES = 3
"""Number of times that Dask runs a batch again after its worker was killed."""

TRIED = 5
"""Number of designs whose cost is measured for an estimate."""

Stage = Callable[[str, int, int], None]
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

    executor: Executor
    workers: int
    how: str


@contextmanager
def pool(workers: int, scheduler: str | None) -> Iterator[Pool]:
    """Workers of a Dask scheduler, `workers` processes here, or this process (0). Raises `MissingExtraError` for a
    scheduler without Dask, `InputError` for one that does not answer or whose workers have another version."""
    if not workers and scheduler is None:
        yield Pool(_Here(), 1, "this process")
        return
    try:
        from dask import config
        from distributed import Client, LocalCluster
    except ImportError as error:
        if scheduler is not None:
            raise MissingExtraError('--scheduler needs Dask: pip install "papilla[cluster]"') from error
        from concurrent.futures import ProcessPoolExecutor

        with ProcessPoolExecutor(workers, get_context("spawn"), end_with_parent) as executor:
            yield Pool(executor, workers, "processes, without Dask")
        return
    with config.set({"distributed.nanny.pre-spawn-environ": dict.fromkeys(THREADS, "1")}):
        try:
            cluster: Any = scheduler or LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                processes=True,
                memory_limit=MEMORY,
                dashboard_address=":0",
                silence_logs=logging.CRITICAL,
            )
            client = Client(cluster, timeout=ANSWER_S)
        except (OSError, TimeoutError, ValueError) as error:
            raise InputError(f"no Dask scheduler answers at {scheduler}: {error}") from error
        try:
            _refuse_other_versions(client)
            count = max(1, sum(client.nthreads().values()))
            where = scheduler or "on this machine"
            yield Pool(client.get_executor(pure=False), count, f"Dask {where}, dashboard {client.dashboard_link}")
        finally:
            client.close()
            if scheduler is None:
                cluster.close()


def _refuse_other_versions(client: Any) -> None:
    """Raise `InputError` if a worker has another version; the function is sent by value, because it may not exist
    there."""

    def theirs() -> str:
        try:
            from papilla.design.batch import version
        except ImportError:
            import importlib.metadata

            return f"{importlib.metadata.version('papilla')} (without studies)"
        return version()

    for worker, found in client.run(theirs, on_error="return").items():
        _refuse_version(f"worker {worker}", str(found))


def _refuse_version(who: str, found: str) -> None:
    if found != version():
        raise InputError(f"{who} has papilla {found}, this client has {version()}: install the same on all machines")


def run(
    study: Study,
    store: Store,
    *,
    workers: int = 1,
    scheduler: str | None = None,
    say: Callable[[str], None] = lambda line: None,
    stage: Stage = lambda line, done, total: None,
) -> Tally:
    """Run a study and store its records; stored records are not computed again.

    workers : processes on this machine, 0 for this process. say, stage : called with the progress. Raises what `pool`
    raises, and `FileAccessError` if the store cannot be written.
    """
    began, tally = perf_counter(), Tally()
    if note := measure_base(with_sites(study.finger, study.places), 1, say):
        tally.notes.append(note)
    with pool(workers, scheduler) as found:
        tally.workers, tally.how = found.workers, found.how
        runner = _Runner(study, store, tally, stage, found)
        if study.sampler.kind == "optimise":
            sampling.optimised(study, runner.scores)
        else:
            runner.run(sampling.groups(study))
    tally.seconds = perf_counter() - began
    return tally


class _Here(Executor):
    """This process as an executor."""

    def submit(self, fn, /, *args, **kwargs):
        made: Future = Future()
        try:
            made.set_result(fn(*args, **kwargs))
        except BaseException as error:
            made.set_exception(error)
        return made


@dataclass
class _Runner:
    study: Study
    store: Store
    tally: Tally
    stage: Stage
    pool: Pool
    number: int = 0

    def __post_init__(self) -> None:
        study, self.place = self.study, self.study.places
        self.records: dict[int, Record] | None = {} if study.sampler.kind == "optimise" else None
        self.total = sampling.count(study)[0]
        self.began = perf_counter()
        # Of all its designs: the client would spend a millisecond on each
        self.shared = cache.key("papilla.design.batch", study.finger.sha256, study.scene, study.asked, self.place)

    def run(self, groups: Iterable[list[Values]]) -> None:
        """Store the records of designs; at most `AHEAD` batches a worker are in flight.

        The records of designs that an optimiser asks for are kept, too.
        """
        flight: dict[Future, list[Row]] = {}
        try:
            for rows, batch in self._interleaved(groups):
                flight[self.pool.executor.submit(evaluate, batch)] = rows
                while len(flight) >= AHEAD * self.pool.workers:
                    self._take(flight)
            while flight:
                self._take(flight)
        except BrokenExecutor as error:
            # Raised by a result of the killed process, and by the next batch that is submitted
            raise SolverError(
                f"a worker process was killed ({error}): --resume goes on, and with papilla[cluster] Dask starts "
                "another one by itself"
            ) from error

    def scores(self, designs: list[Values]) -> list[float]:
        """The scores of designs for an optimiser: the first objective, smaller is better."""
        first = self.number
        self.run([designs])
        assert self.records is not None
        goal, scores = self.study.objectives[0], []
        for record in (self.records[first + k] for k in range(len(designs))):
            if record.status != OK:
                scores.append(sampling.FAILED)
                continue
            beyond = sum(
                max(one.least - record.found[name], record.found[name] - one.most, 0.0)
                for name, one in self.study.limits.items()
            )
            scores.append(goal.sign * record.found[goal.name] if not beyond else sampling.FAILED / 1000 * (1 + beyond))
        return scores

    def _interleaved(self, groups: Iterable[list[Values]]) -> Iterator[tuple[list[Row], Batch]]:
        """The batches to run; batches of as many geometries as there are workers alternate, so that each worker starts
        with another geometry."""
        left = iter(groups)
        while turn := list(islice(left, self.pool.workers)):
            for batches in zip_longest(*map(self._batches, turn)):
                yield from filter(None, batches)

    def _batches(self, group: list[Values]) -> Iterator[tuple[list[Row], Batch]]:
        first, self.number = self.number, self.number + len(group)
        size = min(BATCH, max(1, math.ceil(len(group) / self.pool.workers)))
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
                failed.append((number, free, cache.key(__name__, study.sha256, free), Record({}, str(error))))
                continue
            key = hashlib.sha256(f"{finger.sha256} {self.shared}".encode()).hexdigest()
            tried.append(((number, free, key), finger))
        known = self.store.known([row[2] for row, _ in tried])
        reused = [(*row, known[row[2]]) for row, _ in tried if row[2] in known]
        self.tally.reused += len(reused)
        self._store(reused + failed)
        if left := [(row, finger) for row, finger in tried if row[2] not in known]:
            rows, fingers = zip(*left, strict=True)
            yield list(rows), Batch(fingers, study.finger, self.place, study.scene, study.asked, version())

    def _take(self, flight: dict[Future, list[Row]]) -> None:
        """Store the finished batches."""
        done, _ = wait(flight, return_when=FIRST_COMPLETED)
        for future in done:
            rows = flight.pop(future)
            try:
                made: Done = future.result()
            except Exception as error:
                if type(error).__name__ != "KilledWorker":
                    raise
                made = Done((Record({}, f"its worker was killed {RETRIES} times"),) * len(rows), version(), {}, 0)
            _refuse_version("a worker", made.version)
            self._store([(*row, record) for row, record in zip(rows, made.records, strict=True)])
            for name, seconds in made.spent.items():
                self.tally.spent[name] += seconds
            self.tally.memory_MB = max(self.tally.memory_MB, made.memory_MB)

    def _store(self, rows: list) -> None:
        if not rows:
            return
        self.store.add(self.study.sha256, rows)
        if self.records is not None:
            self.records |= {row[0]: row[3] for row in rows}
        self.tally.designs += len(rows)
        self.tally.failed += sum(row[3].status != OK for row in rows)
        done, fresh = self.tally.designs, self.tally.designs - self.tally.reused
        left = (perf_counter() - self.began) * max(self.total - done, 0) / max(fresh, 1)
        rest = f", about {left:.0f} s left" if fresh and done < self.total else ""
        self.stage(f"designs, {done} of {self.total}{rest}", done, self.total)


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


def price(study: Study, say: Callable[[str], None]) -> Price:
    """Measure the middle geometry and a few of its designs; the results stay in the cache."""
    places = study.places
    designs, geometries = sampling.count(study)
    base = with_sites(study.finger, places)
    measure_base(base, 1, say)
    say("reducing one geometry")
    began = perf_counter()
    tried = [study.finger_of(free) for free in islice(probes(study), TRIED)]
    first = with_sites(tried[0], places)
    known = geometry_map(first, places, base)
    took = perf_counter() - began
    cached = took < 1.0
    began = perf_counter()
    for finger in tried:
        judged(DesignInScene(finger, known, study.scene), study.asked)
    each = (perf_counter() - began) / len(tried)
    return Price(designs, geometries, len(first.gauges), each, took, cached)
