"""Through how many files and functions of papilla a command goes when all that the cache can hold is there.

Run with `python benchmarks/files_read.py` for all four commands, or name some: `press calibrate`. `--names` lists the
functions of each file, `--pairs` the pairs of files that call each other both ways. Each command runs twice, in a
process of its own each time; the second run is counted. What runs while a module is imported does not count (nor what
imports a name on first use), nor does the compiled code of a page's template; and a comprehension or a lambda counts as
part of the function around it.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import papilla

ROOT = Path(papilla.__file__).parent
IMPORTS = str(ROOT / "core" / "_lazy.py")
"""Module that imports names on first use."""
COMMANDS = {
    "press": ["press", "--force", "0.5", "--modulus", "0.51", "--json"],
    "calibrate": ["calibrate", "--out", "calibrated"],
    "estimate": ["estimate", "log.csv", "--calibration", "calibrated/calibration.json", "--out", "estimates.csv"],
    "identify": ["identify", "presses.csv", "--out", "identified.toml"],
}
"""Arguments of each command, in a folder with the files that `prepared` writes."""

SLIDE = "slide --groove 1 --ridge 1 --speed 20 --seconds 1 --out log.csv"
EVERY = 129
"""Rows of the sweep of which one is in the log of presses: 20 of 2580."""


@dataclass
class Read:
    """What a task ran: functions by file, and pairs of files of which the first called the second."""

    functions: dict[str, set[str]] = field(default_factory=dict)
    calls: set[tuple[str, str]] = field(default_factory=set)

    @property
    def both_ways(self) -> list[tuple[str, str]]:
        """Pairs of files that call each other."""
        return sorted((one, other) for one, other in self.calls if one < other and (other, one) in self.calls)

    def line(self, name: str) -> str:
        """The figures of a task."""
        count = sum(len(found) for found in self.functions.values())
        pairs = len(self.both_ways)
        return f"{name}: {len(self.functions)} files, {count} functions, {pairs} pairs of files that call both ways"


def read_by(task: Callable[[], object]) -> Read:
    """What of papilla a task runs, imports apart."""
    seen: dict[tuple[str, str, int], bool] = {}
    found = Read()

    def file_of(frame) -> str | None:
        path = frame.f_code.co_filename
        if not path.startswith(f"{ROOT}/") or not path.endswith(".py") or path == IMPORTS:
            return None
        return path[len(str(ROOT)) + 1 :]

    def note(frame, event: str, _) -> None:
        """Keep the function that is called, and the files of a call from one to another."""
        if event != "call" or (file := file_of(frame)) is None:
            return
        code = frame.f_code
        key = (file, code.co_qualname, code.co_firstlineno)
        if not seen.get(key):
            seen[key] = code.co_name != "<module>" and not _imported(frame)
        if seen[key]:
            if not code.co_name.startswith("<"):
                found.functions.setdefault(file, set()).add(f"{code.co_qualname}:{code.co_firstlineno}")
            caller = frame.f_back and file_of(frame.f_back)
            if caller and caller != file:
                found.calls.add((caller, file))

    sys.setprofile(note)
    try:
        task()
    finally:
        sys.setprofile(None)
    return found


def _imported(frame) -> bool:
    """Whether a frame runs on behalf of an import."""
    while frame is not None:
        if frame.f_code.co_filename == "<frozen importlib._bootstrap>":
            return True
        frame = frame.f_back
    return False


def prepared(names: list[str], folder: Path) -> None:
    """Write what the commands need: a calibration, a log of a slide, a log of presses."""
    if {"estimate", "identify"} & set(names):
        _run(COMMANDS["calibrate"], folder)
    if "estimate" in names:
        _run(SLIDE.split(), folder)
    if "identify" in names:
        head, *rows = (folder / "calibrated" / "sweep.csv").read_text(encoding="utf-8").splitlines()
        columns = [k for k, name in enumerate(head.split(",")) if name in ("force_N", "modulus_MPa") or name[0] == "g"]
        kept = [[line.split(",")[k] for k in columns] for line in (head, *rows[::EVERY])]
        (folder / "presses.csv").write_text("\n".join(map(",".join, kept)) + "\n", encoding="utf-8")


def _run(arguments: list[str], folder: Path, *, counted: bool = False) -> str:
    """Run a command of papilla in a process of its own; what is printed, or what it read where it is counted."""
    program = [sys.executable, __file__, "--inside"] if counted else [sys.executable, "-m", "papilla"]
    done = subprocess.run([*program, *arguments], cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode:
        raise SystemExit(f"papilla {' '.join(arguments)} failed:\n{done.stderr}")
    return done.stdout.splitlines()[-1] if done.stdout else ""


def inside(arguments: list[str]) -> None:
    """Run a command here and print what it read as the last line."""
    from papilla.cli.main import app

    found = read_by(lambda: app(arguments, standalone_mode=False))
    print(json.dumps({"functions": {k: sorted(v) for k, v in found.functions.items()}, "calls": sorted(found.calls)}))


def main() -> None:
    """Count and print."""
    if sys.argv[1:2] == ["--inside"]:
        return inside(sys.argv[2:])
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("commands", nargs="*", default=list(COMMANDS), help=f"of {', '.join(COMMANDS)}")
    parser.add_argument("--names", action="store_true", help="the functions of each file")
    parser.add_argument("--pairs", action="store_true", help="the pairs of files that call each other")
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        prepared(chosen.commands, folder)
        for command in chosen.commands:
            _run(COMMANDS[command], folder)
            told = json.loads(_run(COMMANDS[command], folder, counted=True))
            found = Read({k: set(v) for k, v in told["functions"].items()}, {(a, b) for a, b in told["calls"]})
            print(found.line(command))
            for file, functions in sorted(found.functions.items()) if chosen.names else ():
                print(f"    {file} ({len(functions)}): {', '.join(sorted(functions))}")
            for pair in found.both_ways if chosen.pairs else ():
                print(f"    {' <-> '.join(pair)}")


if __name__ == "__main__":
    main()
