"""How much memory is left, and the refusal of a job that needs more, before it starts.

What counts as free: on Linux what the kernel could give without swapping, or less where a control group (a container, a
batch job) allows less; elsewhere the free pages or, where the system does not count them, all of its memory. Where
nothing is known (Windows) nothing is refused.
"""

import os
from collections.abc import Callable
from pathlib import Path, PurePosixPath

from papilla.errors import MemoryEstimateError

MEMINFO = Path("/proc/meminfo")
CGROUPS_OF_SELF = Path("/proc/self/cgroup")
CGROUP_ROOTS = {"v1": (Path("/sys/fs/cgroup/memory"),), "v2": (Path("/sys/fs/cgroup"), Path("/sys/fs/cgroup/unified"))}
CGROUP_FILES = {
    "v1": ("memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file"),
    "v2": ("memory.max", "memory.current", "inactive_file"),
}
"""Limit and usage in bytes, and the line of `memory.stat` with the cached files in it, which the kernel gives back."""

GIB = 2**30


def available_bytes() -> int | None:
    """Memory (bytes) that this process may still take without swapping; None where the system does not tell."""
    known = [free for free in (_of_machine(), *_of_cgroups()) if free is not None]
    return min(known) if known else None


def refuse_beyond(needed: float, job: str, advice: Callable[[int], str]) -> None:
    """Raise `MemoryEstimateError` where `job` needs more bytes than are free; `advice(free)` says what would do."""
    free = available_bytes()
    if free is not None and needed > free:
        found = f"{job} needs about {in_gib(needed)} of memory, {in_gib(free)} are free"
        raise MemoryEstimateError(f"{found}: {advice(free)}")


def in_gib(number: float) -> str:
    """Bytes in words, to two digits."""
    return f"{number / GIB:.2g} GiB" if number < 99.5 * GIB else f"{number / GIB:.0f} GiB"


def _of_machine() -> int | None:
    try:
        lines = MEMINFO.read_text().splitlines()
        return next(1024 * int(line.split()[1]) for line in lines if line.startswith("MemAvailable:"))
    except (OSError, ValueError, IndexError, StopIteration):
        pass
    for pages in ("SC_AVPHYS_PAGES", "SC_PHYS_PAGES"):
        try:
            count = os.sysconf(pages) * os.sysconf("SC_PAGE_SIZE")
        except (AttributeError, ValueError, OSError):
            continue
        if count > 0:
            return count
    return None


def _of_cgroups() -> list[int]:
    """What each control group around this process still allows."""
    try:
        lines = CGROUPS_OF_SELF.read_text().splitlines()
    except OSError:
        return []
    free = []
    for line in lines:
        _, controllers, path = line.split(":", 2)
        kind = "v2" if not controllers else "v1" if "memory" in controllers.split(",") else None
        if kind is not None:
            own = PurePosixPath(path.lstrip("/"))
            groups = {root / group for root in CGROUP_ROOTS[kind] for group in (own, *own.parents)}
            free += [left for group in groups if (left := _left_in(group, *CGROUP_FILES[kind])) is not None]
    return free


def _left_in(group: Path, limit: str, usage: str, cached: str) -> int | None:
    try:
        allowed, used = int((group / limit).read_text()), int((group / usage).read_text())
        counts = dict(line.split() for line in (group / "memory.stat").read_text().splitlines())
        return max(0, allowed - used + int(counts.get(cached, 0)))
    except (OSError, ValueError):
        # No such file, or "max": this group has no limit
        return None
