"""Long jobs in other processes, which report their progress to this one, and are replaced if they are killed."""

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from threading import Thread
from time import perf_counter
from typing import Any

Say = Callable[[str], None]
"""Takes a line of text."""

Start = Callable[..., Callable[[], Any]]
"""start(function, *arguments) begins `function(*arguments, say)` and returns a function that waits for its result."""

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "RAYON_NUM_THREADS")
"""Environment variables that say how many threads the numerical libraries of a new process may use."""

_lines: Any = None


@contextmanager
def workers(processes: int, say: Say | None = None, *, fresh: bool = False) -> Iterator[Start]:
    """A function that starts jobs in up to `processes` other processes; below 2 they run here, when asked for results.

    A job is a function of a module, whose arguments can be pickled; its last argument takes lines of progress, which go
    to `say`. New processes import the program again, so it must be the command line or a module that guards its main
    part by `if __name__ == "__main__"`. With `fresh` each job has a process of its own, whose memory is freed at its
    end. If a job raises, asking for its result raises the same. A killed process is replaced, as `Processes` says.
    """
    if processes < 2:
        yield lambda function, *arguments: partial(function, *arguments, say or _nothing)
        return
    from papilla.processes import Processes, one_thread_each, spawned

    lines = spawned.SimpleQueue()
    listener = Thread(target=_listen, args=(lines, say or _nothing), daemon=True)
    listener.start()
    with one_thread_each():
        pool = Processes(processes, _keep, (lines,), fresh=fresh)
        try:
            yield lambda function, *arguments: pool.submit(_call, function, arguments).result
        finally:
            pool.shutdown(cancel_futures=True)
            lines.put(None)
            listener.join()


def counted(say: Say, name: str) -> Callable[[int, int], None]:
    """A function of (done, total) that reports how much is done, and about how long the rest takes."""
    began = perf_counter()

    def step(done: int, total: int) -> None:
        left = (perf_counter() - began) * (total - done) / done
        say(f"{name}: {done} of {total}" + (f", about {left:.0f} s left" if done < total else ""))

    return step


def end_with_parent() -> None:
    """Let this process end as soon as the one that started it has ended, even if that one was killed."""
    Thread(target=_wait_for_parent, daemon=True).start()


def _wait_for_parent() -> None:
    from multiprocessing import parent_process

    if (parent := parent_process()) is not None:
        parent.join()
        os._exit(1)


def _nothing(line: str) -> None:
    pass


def _keep(lines: Any) -> None:
    global _lines
    _lines = lines


def _call(function: Callable, arguments: tuple) -> Any:
    return function(*arguments, _lines.put)


def _listen(lines: Any, say: Say) -> None:
    while (line := lines.get()) is not None:
        say(line)
