"""Long pieces of work in other processes, which tell here how far they are."""

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
"""start(function, *arguments) begins `function(*arguments, say)` and gives what waits for its result."""

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "RAYON_NUM_THREADS")
"""Environment variables that say how many threads the numerical libraries of a new process may use."""

_lines: Any = None


@contextmanager
def workers(processes: int, say: Say | None = None, *, fresh: bool = False) -> Iterator[Start]:
    """What starts functions in up to `processes` other processes; below 2 in this one, when the result is asked for.

    Functions are those of modules, their arguments can be pickled, and the last is called with lines of progress, which
    `say` gets. The program must be one that can be imported anew: the command line, or a module with an
    `if __name__ == "__main__"`. With `fresh` each call has a new process, whose memory is freed at its end.
    Raises what a function raises where its result is asked for.
    """
    if processes < 2:
        yield lambda function, *arguments: partial(function, *arguments, say or _nothing)
        return
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import get_context

    context = get_context("spawn")
    # Two processes of one thread each: of two threads each, a calibration took half as long again
    before = {name: os.environ.get(name) for name in THREADS}
    os.environ.update(dict.fromkeys(THREADS, "1"))
    lines = context.SimpleQueue()
    listener = Thread(target=_listen, args=(lines, say or _nothing), daemon=True)
    listener.start()
    pool = ProcessPoolExecutor(processes, context, _begin, (lines,), max_tasks_per_child=1 if fresh else None)
    try:
        yield lambda function, *arguments: pool.submit(_call, function, arguments).result
    finally:
        pool.shutdown(cancel_futures=True)
        os.environ.update({name: value for name, value in before.items() if value is not None})
        for name in (name for name, value in before.items() if value is None):
            os.environ.pop(name, None)
        lines.put(None)
        listener.join()


def counted(say: Say, name: str) -> Callable[[int, int], None]:
    """What tells how many pieces are done, and about how long the rest takes, from (done, in all)."""
    began = perf_counter()

    def step(done: int, total: int) -> None:
        left = (perf_counter() - began) * (total - done) / done
        say(f"{name}: {done} of {total}" + (f", about {left:.0f} s left" if done < total else ""))

    return step


def _nothing(line: str) -> None:
    pass


def _begin(lines: Any) -> None:
    global _lines
    _lines = lines


def _call(function: Callable, arguments: tuple) -> Any:
    return function(*arguments, _lines.put)


def _listen(lines: Any, say: Say) -> None:
    while (line := lines.get()) is not None:
        say(line)
