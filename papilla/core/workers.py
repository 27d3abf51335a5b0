"""The one way in which papilla starts other processes.

`workers` runs long jobs, functions of papilla, in other processes, which report their progress to this one and are
replaced if they are killed; `Processes` is what it is made of. `run_program` runs another program for a bounded time.
"""

import os
import signal
import subprocess
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from queue import SimpleQueue
from threading import Thread
from typing import TYPE_CHECKING, Any, Self

from papilla.core import seams
from papilla.core.errors import WorkerKilledError
from papilla.core.progress import Progress, silent

if TYPE_CHECKING:
    from concurrent.futures import Future, ProcessPoolExecutor

Start = Callable[..., Callable[[], Any]]
"""start(function, *arguments) begins `function(*arguments, progress)`; what it returns waits for the result."""

THREAD_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "RAYON_NUM_THREADS")
"""Environment variables that say how many threads the numerical libraries of a new process may use."""

MOST_TRIES = 4
"""Number of times that a job is begun whose process is killed each time: once, and three times more."""

_stages: Any = None


@contextmanager
def workers(processes: int, progress: Progress = silent, *, fresh: bool = False) -> Iterator[Start]:
    """A function that starts jobs in up to `processes` other processes; below 2 they run here, when asked for results.

    A job is a function of a module, whose arguments can be pickled; its last argument is a `Progress`, which
    tells `progress`. New processes import the program again, so it must be the command line or a module that guards its
    main part by `if __name__ == "__main__"`. With `fresh` each job has a process of its own, whose memory is freed at
    its end. If a job raises, asking for its result raises the same. A killed process is replaced, as `Processes` says.
    """
    if processes < 2:
        yield lambda function, *arguments: partial(function, *arguments, progress)
        return
    from multiprocessing import get_context

    stages = get_context("spawn").SimpleQueue()
    listener = Thread(target=_listen, args=(stages, progress), daemon=True)
    listener.start()
    try:
        with one_thread_each(), Processes(processes, _keep, (stages,), fresh=fresh) as pool:
            yield lambda function, *arguments: pool.submit(_call, function, arguments).result
    finally:
        stages.put(None)
        listener.join()


class Processes:
    """Up to `count` processes for jobs, used like an executor of `concurrent.futures`, and ended by a `with` block.
    They talk through pipes: no port is opened.

    A process that is killed, as by the system when memory runs out, is replaced, and its job begins again; a job whose
    process was killed `MOST_TRIES` times raises `WorkerKilledError`. Each process does one job at a time.

    begin, arguments : a function that each process calls first. fresh : a new process for each job.
    """

    def __init__(self, count: int, begin: Callable | None = None, arguments: tuple = (), *, fresh: bool = False):
        from concurrent.futures import ThreadPoolExecutor

        self._threads = ThreadPoolExecutor(count)
        self._begin, self._fresh, self._ended = partial(_begin, begin, arguments), fresh, False
        self._idle: SimpleQueue[ProcessPoolExecutor | None] = SimpleQueue()
        self._numbers: dict[ProcessPoolExecutor, int] = {}
        for _ in range(count):
            self._idle.put(None)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        self.shutdown()

    def submit(self, function: Callable, /, *args: Any) -> "Future":
        """A future of `function(*args)`."""
        return self._threads.submit(self._result, partial(function, *args))

    def kill(self) -> None:
        """Let no job go on; their futures raise."""
        self._ended = True
        for number in list(self._numbers.values()):
            with suppress(ProcessLookupError):
                os.kill(number, signal.SIGTERM)

    def shutdown(self) -> None:
        """Wait for the jobs that have begun, cancel the others, and end the processes."""
        self._threads.shutdown(cancel_futures=True)
        while not self._idle.empty():
            self._end(self._idle.get())

    def _result(self, job: Callable) -> Any:
        """The result of a job, in a thread of its own, which waits for the process."""
        from concurrent.futures import BrokenExecutor

        for _ in range(MOST_TRIES):
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
            f"a worker process was killed {MOST_TRIES} times, the last time while it began its job again"
        )

    def _started(self) -> "ProcessPoolExecutor":
        from concurrent.futures import BrokenExecutor

        # A pool of one, as only then is it known whose job was killed
        process = seams.executor(self._begin)
        self._numbers[process] = process.submit(os.getpid).result()
        if self._ended:
            self._end(process)
            raise BrokenExecutor("the work was stopped")
        return process

    def _end(self, process: "ProcessPoolExecutor | None") -> None:
        if process is not None:
            self._numbers.pop(process, None)
            process.shutdown()


@contextmanager
def one_thread_each() -> Iterator[None]:
    """Processes that are started in this block compute with one thread each: with two of two threads each, a
    calibration took half as long again."""
    before = {name: os.environ.get(name) for name in THREAD_VARIABLES}
    os.environ.update(dict.fromkeys(THREAD_VARIABLES, "1"))
    try:
        yield
    finally:
        os.environ.update({name: value for name, value in before.items() if value is not None})
        for name in (name for name, value in before.items() if value is None):
            os.environ.pop(name, None)


HEARTBEAT_S = 0.5
"""Time between two reports on a program that runs."""


def run_program(
    command: Sequence[str], most_s: float, beat: Callable[[float], None] | None = None, **options: Any
) -> int | None:
    """Exit code of another program, None if it takes longer than `most_s`; it has ended when this returns or raises.

    beat : gets the seconds since its start, about twice a second. options : those of `subprocess.Popen`.
    """
    child, start = seams.start(command, **options), seams.now_s()
    try:
        while True:
            with suppress(subprocess.TimeoutExpired):
                return child.wait(timeout=HEARTBEAT_S)
            elapsed = seams.now_s() - start
            if beat is not None:
                beat(elapsed)
            if elapsed > most_s:
                return None
    finally:
        child.kill()
        child.wait()


def end_with_parent() -> None:
    """Let this process end as soon as the one that started it has ended, even if that one was killed."""
    Thread(target=_wait_for_parent, daemon=True).start()


def _wait_for_parent() -> None:
    from multiprocessing import parent_process

    if (parent := parent_process()) is not None:
        parent.join()
        os._exit(1)


def _begin(begin: Callable | None, arguments: tuple) -> None:
    end_with_parent()
    if begin is not None:
        begin(*arguments)


def _keep(stages: Any) -> None:
    global _stages
    _stages = stages


def _call(function: Callable, arguments: tuple) -> Any:
    return function(*arguments, _stages.put)


def _listen(stages: Any, progress: Progress) -> None:
    while (stage := stages.get()) is not None:
        progress(stage)
