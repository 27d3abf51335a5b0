"""Processes that are replaced if they are killed: local studies, calibrations and claims run on them."""

import os
import signal
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import contextmanager, suppress
from functools import partial
from multiprocessing import get_context
from queue import SimpleQueue
from typing import Any

from papilla.core.errors import WorkerKilledError
from papilla.core.workers import THREADS, end_with_parent

spawned = get_context("spawn")
"""New processes begin afresh, without copies of this one's threads and locks."""
TRIES = 4
"""Number of times that a job is begun whose process is killed each time: once, and three times more."""


class Processes(Executor):
    """Processes as an executor of `concurrent.futures`. They talk through pipes: no port is opened.

    A process that is killed, as by the system when memory runs out, is replaced, and its job begins again; a job whose
    process was killed `TRIES` times raises `WorkerKilledError`. Each process does one job at a time.

    begin, arguments : a function that each process calls first. fresh : a new process for each job.
    """

    def __init__(self, count: int, begin: Callable | None = None, arguments: tuple = (), *, fresh: bool = False):
        self._threads = ThreadPoolExecutor(count)
        self._begin, self._fresh, self._ended = partial(_begin, begin, arguments), fresh, False
        self._idle: SimpleQueue[ProcessPoolExecutor | None] = SimpleQueue()
        self._numbers: dict[ProcessPoolExecutor, int] = {}
        for _ in range(count):
            self._idle.put(None)

    def submit(self, function: Callable, /, *args: Any, **kwargs: Any) -> Future:
        """A future of `function(*args, **kwargs)`."""
        return self._threads.submit(self._result, partial(function, *args, **kwargs))

    def kill(self) -> None:
        """Let no job go on; their futures raise."""
        self._ended = True
        for number in list(self._numbers.values()):
            with suppress(ProcessLookupError):
                os.kill(number, signal.SIGTERM)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Wait for the jobs that have begun, and end the processes."""
        self._threads.shutdown(wait, cancel_futures=cancel_futures)
        while not self._idle.empty():
            self._end(self._idle.get())

    def _result(self, job: Callable) -> Any:
        """The result of a job, in a thread of its own, which waits for the process."""
        for _ in range(TRIES):
            process = self._idle.get()
            try:
                process = process or self._started()
                return process.submit(job).result()
            except BrokenExecutor:
                self._end(process)
                process = None
                if self._ended:
                    raise
            finally:
                if self._fresh:
                    self._end(process)
                    process = None
                self._idle.put(process)
        raise WorkerKilledError(
            f"a worker process was killed {TRIES} times, the last time while it began its job again"
        )

    def _started(self) -> ProcessPoolExecutor:
        process = ProcessPoolExecutor(1, spawned, self._begin)
        self._numbers[process] = process.submit(os.getpid).result()
        if self._ended:
            self._end(process)
            raise BrokenExecutor("the work was stopped")
        return process

    def _end(self, process: ProcessPoolExecutor | None) -> None:
        if process is not None:
            self._numbers.pop(process, None)
            process.shutdown()


@contextmanager
def one_thread_each() -> Iterator[None]:
    """Processes that are started in this block compute with one thread each: with two of two threads each, a
    calibration took half as long again."""
    before = {name: os.environ.get(name) for name in THREADS}
    os.environ.update(dict.fromkeys(THREADS, "1"))
    try:
        yield
    finally:
        os.environ.update({name: value for name, value in before.items() if value is not None})
        for name in (name for name, value in before.items() if value is None):
            os.environ.pop(name, None)


def _begin(begin: Callable | None, arguments: tuple) -> None:
    end_with_parent()
    if begin is not None:
        begin(*arguments)
