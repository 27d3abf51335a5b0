"""Runs the designs of a study: batches go to workers, records come back and are stored, what is stored is not run.

Workers are those of a Dask cluster (one of processes on this machine, or one that is told), which starts a task again
on another worker where one is killed; without Dask they are plain processes. Both are asked through the same
`concurrent.futures` interface. A few batches are in flight at a time, so memory does not grow with the study.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from contextlib import contextmanager
from dataclasses import dataclass, field
from time import perf_counter
from typing import Any

from papilla import cache
from papilla.design import sampling
from papilla.design.batch import OK, Batch, Done, Record, evaluate, version
from papilla.design.geometry import measure_base, with_sites
from papilla.design.sampling import Values
from papilla.design.store import Store
from papilla.design.study import Study
from papilla.errors import InputError, MissingExtraError, PapillaError, SolverError
from papilla.workers import THREADS

BATCH = 50
"""Designs of a batch: 2 s of work, against 8 ms that a task costs Dask; a killed client loses what is in flight."""
AHEAD = 2
"""Batches in flight for each worker."""
MEMORY = "3GiB"
"""Of a worker on this machine; a geometry is reduced within 1.5 GB, and is 1 to 12 MB afterwards."""
RETRIES = 3
"""Times that plain processes are started again where one of them was killed."""

Stage = Callable[[str, int, int], None]


@dataclass
class Tally:
    """What a run cost. seconds_geometry, seconds_designs : of all workers; memory_MB : of the largest worker."""

    designs: int = 0
    reused: int = 0
    failed: int = 0
    batches: int = 0
    seconds: float = 0.0
    seconds_geometry: float = 0.0
    seconds_designs: float = 0.0
    memory_MB: float = 0.0
    workers: int = 1
    how: str = "this process"
    notes: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class Pool:
    """An executor with so many workers; `again` makes a new one where it broke."""

    executor: Executor
    workers: int
    how: str


@contextmanager
def pool(workers: int, scheduler: str | None) -> Iterator[Pool]:
    """Workers: of a Dask scheduler, or so many processes here. Raises `MissingExtraError` for a scheduler without Dask,
    `InputError` for one that does not answer or whose workers have another version."""
    try:
        from dask import config
        from distributed import Client, LocalCluster
    except ImportError as error:
        if scheduler is not None:
            raise MissingExtraError('--scheduler needs Dask: pip install "papilla[cluster]"') from error
        from concurrent.futures import ProcessPoolExecutor
        from multiprocessing import get_context

        with ProcessPoolExecutor(workers, get_context("spawn")) as executor:
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
                silence_logs=50,
            )
            client = Client(cluster, timeout=20)
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
    """Raise `InputError` where a worker has not this version; the function goes by value, as it may not be there."""

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
    """Run a study into a store; what it holds is taken from there.

    workers : processes on this machine, 0 for this process. say, stage : are told what is done. Raises what `pool`
    raises, and `FileAccessError` where the store cannot be written.
    """
    began, tally = perf_counter(), Tally()
    if note := measure_base(with_sites(study.finger, study.places), 1, say):
        tally.notes.append(note)
    with pool(workers, scheduler) if workers or scheduler else _here() as found:
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


@contextmanager
def _here() -> Iterator[Pool]:
    yield Pool(_Here(), 1, "this process")


@dataclass
class _Runner:
    study: Study
    store: Store
    tally: Tally
    stage: Stage
    pool: Pool
    number: int = 0

    def __post_init__(self) -> None:
        self.total = sampling.count(self.study)[0]
        self.began = perf_counter()
        self.place = self.study.places

    def run(self, groups: Iterable[list[Values]]) -> dict[int, Record]:
        """The records of designs, by number; at most `AHEAD` batches a worker are in flight."""
        flight: dict[Future, tuple[list[tuple[int, Values, str]], Batch, int]] = {}
        found: dict[int, Record] = {}
        keep = self.study.sampler.kind == "optimise"
        for rows, batch in self._interleaved(groups):
            self._submit(flight, rows, batch, 0)
            while len(flight) >= AHEAD * self.pool.workers:
                self._take(flight, found if keep else {})
        while flight:
            self._take(flight, found if keep else {})
        return found | self._reused if keep else {}

    def scores(self, designs: list[Values]) -> list[float]:
        """What an optimiser is told of designs: the first objective, less is better."""
        first = self.number
        found = self.run([designs])
        goal, scores = self.study.objectives[0], []
        for record in (found[first + k] for k in range(len(designs))):
            if record.status != OK:
                scores.append(sampling.FAILED)
                continue
            beyond = sum(
                max(one.least - record.found[one.objective], record.found[one.objective] - one.most, 0.0)
                for one in self.study.limits
            )
            scores.append(goal.sign * record.found[goal.name] if not beyond else sampling.FAILED / 1000 * (1 + beyond))
        return scores

    def _interleaved(self, groups: Iterable[list[Values]]) -> Iterator[tuple[list[tuple[int, Values, str]], Batch]]:
        """Batches that are to be run; those of as many geometries as there are workers take turns, so that each worker
        begins with one of its own."""
        waiting: list[Iterator] = []
        self._reused: dict[int, Record] = {}
        for group in groups:
            waiting.append(self._batches(group))
            if len(waiting) == self.pool.workers:
                yield from _in_turn(waiting)
                waiting = []
        yield from _in_turn(waiting)

    def _batches(self, group: list[Values]) -> Iterator[tuple[list[tuple[int, Values, str]], Batch]]:
        first, self.number = self.number, self.number + len(group)
        size = min(BATCH, max(1, math.ceil(len(group) / self.pool.workers)))
        for start in range(0, len(group), size):
            batch = self._prepared(first + start, group[start : start + size])
            if batch is not None:
                yield batch

    def _prepared(self, first: int, designs: Sequence[Values]) -> tuple[list[tuple[int, Values, str]], Batch] | None:
        """Those designs that are not in the store; designs that cannot be are stored as failed at once."""
        rows, fingers, failed = [], [], []
        for number, free in enumerate(designs, start=first):
            try:
                finger = self.study.finger_of(free)
            except InputError as error:
                failed.append((number, free, cache.key(__name__, self.study.sha256, free), Record({}, str(error))))
                continue
            rows.append((number, free, self._key(finger)))
            fingers.append(finger)
        known = self.store.known([key for *_, key in rows])
        reused = [(*row, known[row[2]]) for row in rows if row[2] in known]
        self.tally.reused += len(reused)
        self._store(reused + failed)
        self._reused |= {row[0]: row[3] for row in reused + failed} if self.study.sampler.kind == "optimise" else {}
        left = [(row, finger) for row, finger in zip(rows, fingers, strict=True) if row[2] not in known]
        if not left:
            return None
        batch = Batch(
            tuple(finger for _, finger in left),
            self.study.finger,
            self.place,
            self.study.scene,
            self.study.asked,
            version(),
        )
        return [row for row, _ in left], batch

    def _key(self, finger: Any) -> str:
        study = self.study
        return cache.key(
            "papilla.design.batch", finger.sha256, study.finger.sha256, study.scene, study.asked, self.place
        )

    def _submit(self, flight: dict, rows: list, batch: Batch, tried: int) -> None:
        flight[self.pool.executor.submit(evaluate, batch)] = rows, batch, tried

    def _take(self, flight: dict, found: dict[int, Record]) -> None:
        """Store the batches that are done; those that a killed process had are run again."""
        done, _ = wait(flight, return_when=FIRST_COMPLETED)
        for future in done:
            rows, batch, tried = flight.pop(future)
            try:
                made: Done = future.result()
            except PapillaError:
                raise
            except BrokenExecutor as error:
                raise SolverError(
                    f"a worker process was killed ({error}): --resume goes on, and with papilla[cluster] Dask starts "
                    "another one by itself"
                ) from error
            except Exception as error:
                if type(error).__name__ != "KilledWorker":
                    raise
                made = Done((Record({}, f"its worker was killed {RETRIES} times"),) * len(rows), version(), 0, 0, 0)
            _refuse_version("a worker", made.version)
            stored = [(*row, record) for row, record in zip(rows, made.records, strict=True)]
            self._store(stored)
            found |= {row[0]: row[3] for row in stored}
            self.tally.batches += 1
            self.tally.seconds_geometry += made.seconds_geometry
            self.tally.seconds_designs += made.seconds_designs
            self.tally.memory_MB = max(self.tally.memory_MB, made.memory_MB)

    def _store(self, rows: list) -> None:
        if not rows:
            return
        self.store.add(self.study.sha256, rows)
        self.tally.designs += len(rows)
        self.tally.failed += sum(row[3].status != OK for row in rows)
        done, fresh = self.tally.designs, self.tally.designs - self.tally.reused
        left = (perf_counter() - self.began) * max(self.total - done, 0) / max(fresh, 1)
        told = f", about {left:.0f} s left" if fresh and done < self.total else ""
        self.stage(f"designs, {done} of {self.total}{told}", done, self.total)


def _in_turn(iterators: list[Iterator]) -> Iterator:
    """The items of several iterators, one of each at a time."""
    while iterators:
        alive = []
        for one in iterators:
            item = next(one, None)
            if item is not None:
                yield item
                alive.append(one)
        iterators = alive
