"""Through how many files of papilla a task reads: those of which a function runs.

Run with `python benchmarks/files_read.py press prepare calibrate`; `--names` lists the files with some functions.
"""

import argparse
import inspect
import os
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import papilla
from papilla import Block, Finger, fem

ROOT = Path(papilla.__file__).parent


def files_of(task: Callable[[], object]) -> dict[str, set[str]]:
    """File -> functions that ran in it; what runs on import, or in a process of its own, does not count."""
    seen: dict[str, set[str]] = {}

    def note(frame, event, _):
        code = frame.f_code
        # Bodies of modules and classes are not optimised, functions are
        if event == "call" and code.co_flags & inspect.CO_OPTIMIZED and Path(code.co_filename).is_relative_to(ROOT):
            seen.setdefault(Path(code.co_filename).relative_to(ROOT).as_posix(), set()).add(code.co_name)

    sys.setprofile(note)
    try:
        task()
    finally:
        sys.setprofile(None)
    return seen


def press() -> None:
    """A press of a reduced finger."""
    fem.press(REDUCED[0], Block(0.51, 10.0), force=0.5)


def prepare() -> None:
    """Meshing (from what ships), assembly, factorisation and reduction, without a cache."""
    fem.prepare(Finger.default())


def calibrate() -> None:
    """The command, its report included."""
    from papilla.cli.main import app

    app(["calibrate", "--out", tempfile.mkdtemp(dir=os.environ["PAPILLA_CACHE"])], standalone_mode=False)


TASKS = {"press": press, "prepare": prepare, "calibrate": calibrate}
REDUCED: list[fem.ReducedFinger] = []


def main() -> None:
    """Count and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("tasks", nargs="*", default=list(TASKS), help=f"of {', '.join(TASKS)}")
    parser.add_argument("--names", action="store_true", help="the files, and functions that ran in them")
    chosen = parser.parse_args()
    for name in chosen.tasks:
        if name == "press":
            REDUCED.append(fem.prepare(Finger.default()))
            # The first press reads what ships with the package
            press()
        with tempfile.TemporaryDirectory() as folder:
            before = os.environ.get("PAPILLA_CACHE")
            os.environ["PAPILLA_CACHE"] = folder
            found = files_of(TASKS[name])
            os.environ.pop("PAPILLA_CACHE") if before is None else os.environ.update(PAPILLA_CACHE=before)
        print(f"{name}: {len(found)} files")
        if chosen.names:
            for file, functions in sorted(found.items()):
                print(f"    {file}: {', '.join(sorted(functions)[:6])}")


if __name__ == "__main__":
    main()
