"""Runs studies: named jobs, here or in other processes, with progress; results in the order of the jobs."""

import os
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from papilla.core.memory import BYTES_PER_GIB, available_bytes
from papilla.core.progress import CountedStep, Progress, silent
from papilla.core.workers import workers

LARGEST_JOB_GIB = 3.25
"""Largest memory of one job of a study: 3.25 GB in a whole `papilla verify`."""
MOST_PROCESSES = 2
"""Largest number of jobs at once: more would wait for the memory bus."""


def no_progress(line: str, finished: int, total: int) -> None:
    """Show nothing."""


def run_jobs(
    function: Callable[..., Any],
    jobs: Mapping[str, tuple],
    *,
    processes: int = 1,
    fresh: bool = False,
    progress: Progress = silent,
) -> Iterator[tuple[str, Any]]:
    """Yield the name of each job with `function(*arguments, progress)`.

    processes : how many jobs run at once; 1 runs them in this process (see `core.workers`). fresh : a new process
    for each job, so that what a job leaves in memory goes with it. Raises what the function raises.
    """
    finished = 0

    def stage(text: str) -> None:
        progress(CountedStep(text, finished, len(jobs)))

    with workers(processes if len(jobs) > 1 else 1, stage, fresh=fresh) as start:
        results = {name: start(function, *arguments) for name, arguments in jobs.items()}
        for name, result in results.items():
            if processes < 2:
                stage(name)
            answer = result()
            finished += 1
            yield name, answer


def fitting_processes() -> int:
    """Number of jobs that this machine can run at once, by its cores and its free memory."""
    free = available_bytes()
    by_memory = MOST_PROCESSES if free is None else int(free / (LARGEST_JOB_GIB * BYTES_PER_GIB))
    return max(1, min(MOST_PROCESSES, os.cpu_count() or 1, by_memory))
