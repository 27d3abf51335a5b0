"""The four places where a test may stand in for the machine: clock, free memory, new processes, exchange of files.

Each is a plain function that papilla calls through this module (`seams.now_ns()`), so a test that replaces it here
replaces it everywhere. Nothing else of papilla is replaced in a test.
"""

import os
import subprocess
import time
from collections.abc import Callable, Sequence
from os import PathLike
from typing import TYPE_CHECKING, Any

from papilla.core import free_memory

if TYPE_CHECKING:
    from concurrent.futures import ProcessPoolExecutor


def now_ns() -> int:
    """The monotonic clock (ns)."""
    return time.monotonic_ns()


def now_s() -> float:
    """The same clock in seconds."""
    return 1e-9 * now_ns()


def free_bytes() -> int | None:
    """Memory (bytes) that this process can still use without swapping; None if the system does not say."""
    return free_memory.free_bytes()


def executor(begin: Callable[[], object] | None = None) -> "ProcessPoolExecutor":
    """One new process for jobs, which calls `begin` first."""
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import get_context

    return ProcessPoolExecutor(1, get_context("spawn"), begin)


def start(command: Sequence[str], **options: Any) -> subprocess.Popen:
    """Another program, as `subprocess.Popen` starts it."""
    return subprocess.Popen(command, **options)


def replace(source: str | PathLike, target: str | PathLike) -> None:
    """Move a file to where another may be; a disk that is full or broken raises `OSError`."""
    os.replace(source, target)
