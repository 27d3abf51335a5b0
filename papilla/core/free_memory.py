"""Free memory: what the kernel can give without swapping, or what a control group allows if that is less.

A control group is that of a container or a batch job. Where the system has no such files, it is the free pages, or all
memory if the system does not count them. On Windows it is unknown.
"""

import os
from collections.abc import Callable
from pathlib import Path, PurePosixPath

from papilla.core.outside import read_text

CONTROL_GROUPS = {"v1": ("sys/fs/cgroup/memory",), "v2": ("sys/fs/cgroup", "sys/fs/cgroup/unified")}
GROUP_FILES = {
    "v1": ("memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file"),
    "v2": ("memory.max", "memory.current", "inactive_file"),
}
"""Files of limit and usage in bytes, and the line of `memory.stat` that counts cached files, which can be freed."""

Pages = Callable[[str], int]
"""What the system says about its pages, such as `os.sysconf`; raises `ValueError` or `OSError` for what it does not."""


MEMORY_INFO: Pages | None = getattr(os, "sysconf", None)
"""This system's; Windows has none."""


def free_bytes(root: Path = Path("/"), pages: Pages | None = MEMORY_INFO) -> int | None:
    """Memory (bytes) that this process can still use without swapping; None if the system does not say.

    root : the folder with the kernel's files proc/meminfo, proc/self/cgroup and sys/fs/cgroup.
    """
    machine = _of_kernel(root)
    if machine is None and pages is not None:
        machine = _of_pages(pages)
    return min((free for free in (machine, *_of_groups(root)) if free is not None), default=None)


def _of_kernel(root: Path) -> int | None:
    try:
        lines = read_text(root / "proc/meminfo").splitlines()
        return next(1024 * int(line.split()[1]) for line in lines if line.startswith("MemAvailable:"))
    except (OSError, ValueError, IndexError, StopIteration):
        return None


def _of_pages(pages: Pages) -> int | None:
    for name in ("SC_AVPHYS_PAGES", "SC_PHYS_PAGES"):
        try:
            count = pages(name) * pages("SC_PAGE_SIZE")
        except (ValueError, OSError):
            continue
        if count > 0:
            return count
    return None


def _of_groups(root: Path) -> list[int]:
    """Memory (bytes) that each control group around this process still allows."""
    try:
        lines = read_text(root / "proc/self/cgroup").splitlines()
    except OSError:
        return []
    free = []
    for line in lines:
        _, controllers, path = line.split(":", 2)
        version = "v2" if not controllers else "v1" if "memory" in controllers.split(",") else None
        if version is not None:
            process_group = PurePosixPath(path.lstrip("/"))
            groups = {
                root / place / group
                for place in CONTROL_GROUPS[version]
                for group in (process_group, *process_group.parents)
            }
            free += [
                free_bytes for group in groups if (free_bytes := _left_in(group, *GROUP_FILES[version])) is not None
            ]
    return free


def _left_in(group: Path, limit: str, usage: str, cached: str) -> int | None:
    """Bytes that a control group of processes may still take; None where it has no limit."""
    try:
        allowed, used = int(read_text(group / limit)), int(read_text(group / usage))
        counts = dict(line.split() for line in read_text(group / "memory.stat").splitlines())
        return max(0, allowed - used + int(counts.get(cached, 0)))
    except (OSError, ValueError):
        # No such file, or "max": the group has no limit
        return None
