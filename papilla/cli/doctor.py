"""`papilla doctor`: the state of this installation, a self-test, and the content of its cache."""

import os
import platform
import re
from functools import partial
from time import perf_counter
from typing import Any

from papilla.cli.options import DEFAULT_PROCESSES, option
from papilla.cli.output import CHECK_FAILED, CommandResult, say, tell
from papilla.cli.verify import case_keys

BYTES_PER_MB = 1e6
_REQUIREMENT = re.compile(r"([\w.-]+)[^;]*(?:;.*extra == ['\"]([\w-]+)['\"])?")
"""Name of a package, and the extra to which it belongs."""


def doctor(
    clean: bool = option(False, "Empty the cache first; later commands compute their results again.", "--clean"),
) -> CommandResult:
    """Show versions, solver, rendering, threads, cache and extras, and run a self-test of some seconds.

    The environment variable PAPILLA_CACHE names the cache's folder. Exit code 1 says that a check failed.
    """
    from papilla import __version__
    from papilla.core import cache

    removed = 0
    if clean:
        removed = sum(cache.entries().values())
        cache.clean()
        say(f"removed {removed / BYTES_PER_MB:.1f} MB from {cache.folder()}")
    required, extras = _packages()
    facts: dict[str, Any] = {
        "papilla": __version__,
        "python": platform.python_version(),
        "platform": platform.platform(),
        "packages": required,
        "solver": {"name": "rslab", "version": required.get("rslab")},
        "rendering": _rendering(),
        "threads": _threads(),
        "cache": _cache() | {"removed_bytes": removed},
        "extras": extras,
    }
    from papilla.verify.self_test import self_test

    began = perf_counter()
    cases = [case_keys(case) for case in self_test()]
    failed = [case["name"] for case in cases if not case["passed"]]
    facts["self_test"] = {"passed": not failed, "seconds": perf_counter() - began, "cases": cases}
    return CommandResult(facts, partial(_print, facts, failed), CHECK_FAILED if failed else 0)


def _packages() -> tuple[dict[str, str | None], dict[str, dict]]:
    """Versions of required packages, None if one is missing; and of each extra, with whether it is complete."""
    from importlib.metadata import PackageNotFoundError, requires, version

    def found(name: str) -> str | None:
        try:
            return version(name)
        except PackageNotFoundError:
            return None

    try:
        lines = requires("papilla") or []
    except PackageNotFoundError:  # In a checkout that is not installed
        lines = []
    needed: dict[str, dict[str, str | None]] = {}
    for match in filter(None, map(_REQUIREMENT.match, lines)):
        needed.setdefault(match[2] or "", {})[match[1]] = found(match[1])
    required = needed.pop("", {})
    return required, {name: {"complete": None not in of.values(), "packages": of} for name, of in needed.items()}


def _rendering() -> str:
    """The renderer of pictures: a kind of VTK window, or matplotlib alone."""
    from papilla.view.render import WINDOW_VARIABLE, use_offscreen_window

    return (os.environ.get(WINDOW_VARIABLE) or "VTK's own window") if use_offscreen_window() else "matplotlib alone"


def _threads() -> dict:
    from papilla.core.workers import THREAD_VARIABLES

    return {"cores": os.cpu_count(), "processes": DEFAULT_PROCESSES} | {
        name: os.environ.get(name) for name in THREAD_VARIABLES
    }


def _cache() -> dict:
    from papilla.core import cache

    sizes = cache.entries()
    kinds: dict[str, int] = {}
    for path, size in sizes.items():
        kinds[path.parent.name] = kinds.get(path.parent.name, 0) + size
    source = (
        f"the variable {cache.CACHE_VARIABLE}" if os.environ.get(cache.CACHE_VARIABLE) else "the user's cache folder"
    )
    return {
        "folder": str(cache.folder()),
        "chosen_by": source,
        "entries": len(sizes),
        "bytes": sum(sizes.values()),
        "bytes_by_kind": kinds,
        "usable": cache.usable(),
    }


def _print(facts: dict, failed: list[str]) -> None:
    cache_facts, threads, test = facts["cache"], facts["threads"], facts["self_test"]
    rows = [("papilla", facts["papilla"]), ("Python", f"{facts['python']}, {facts['platform']}")]
    rows += [(name, version or "MISSING") for name, version in facts["packages"].items()]
    rows.append(("rendering", facts["rendering"]))
    rows.append(
        ("threads", f"{threads['cores']} cores, {threads['processes']} processes in long jobs, each of 1 thread")
    )
    rows.append(
        (
            "cache",
            f"{cache_facts['folder']} ({cache_facts['chosen_by']})" + "; NOT USABLE" * (not cache_facts["usable"]),
        )
    )
    rows.append(("cache size", f"{cache_facts['bytes'] / BYTES_PER_MB:.1f} MB in {cache_facts['entries']} entries"))
    for name, extra in facts["extras"].items():
        missing = [package for package, version in extra["packages"].items() if version is None]
        rows.append((f"extra {name}", "there" if not missing else f"lacks {', '.join(missing)}"))
    passed = f"{len(test['cases']) - len(failed)} of {len(test['cases'])} checks passed, {test['seconds']:.1f} s"
    rows.append(("self-test", passed + "".join(f"; FAILED: {name}" for name in failed)))
    width = max(len(name) for name, _ in rows)
    for name, value in rows:
        tell(f"{name:{width}}  {value}")
