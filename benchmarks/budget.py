"""What the main jobs cost, against the last release: time over a piece of NumPy work, peak memory, lines of code.

`python benchmarks/budget.py [--jobs TEXT ...] [--tests] [--release]`; `--release` keeps the figures.

Every job runs in a process of its own, on one thread a process. The same piece of NumPy work is timed before and after
it, and the job's processor time is divided by the mean of both: the quotient depends little on the machine. What costs
a third more than in the last release is printed first, and the reason belongs into CHANGELOG.md. It never fails.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from time import process_time

import numpy as np
from rich.console import Console
from rich.progress import track

import papilla
from papilla.core.files import write_text
from papilla.core.workers import THREAD_VARIABLES

ROOT = Path(__file__).parents[1]
RELEASE = Path(__file__).with_name("budget_of_release.json")
WORSE = 4 / 3
"""Growth that is printed first."""

UNIT_SIZE = 600
"""Rows of the matrices of the piece of work: a tenth of a second, half of it in BLAS."""

OWN = {
    "outer_mm = [24.0, 30.0, 20.0]": "outer_mm = [24.0, 24.0, 20.0]",
    "[21.0, 27.0": "[21.0, 21.0",
    "[10.0, 16.0": "[10.0, 10.0",
}
"""What makes a dome of revolution of the default finger's design file."""

SCENES = """
from papilla import Finger, fem
from papilla.cli.speed.measure import drawn, thousand
from time import process_time
reduced = fem.prepare(Finger.default())
{job}
"""
DRAWN = "print(sorted(drawn(reduced, 100, seed=1)[1:])[49])"
THOUSAND = "print(thousand(reduced, 'contact')[0])"
UPDATE = """
from benchmarks.estimators.cost import costs
print(1e-6 * costs(None, 2.0)[0].update_mean_us)
"""


@dataclass(frozen=True)
class Figure:
    """What a job cost: seconds of processor, the same over the piece of work, and MiB of its largest process."""

    seconds: float
    units: float
    peak_MiB: float


def main() -> None:
    """Run the jobs, print the report, and keep the figures of a release."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--jobs", nargs="+", metavar="TEXT", help="those whose names hold one of these")
    parser.add_argument("--tests", action="store_true", help="time the quick tests, too")
    parser.add_argument("--release", action="store_true", help=f"keep the figures in {RELEASE.name}")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        wanted = {
            name: job
            for name, job in jobs(Path(folder), options.tests)
            if any(text in name for text in options.jobs or [""])
        }
        found = {name: measured(job) for name, job in track(wanted.items(), "jobs", console=Console(stderr=True))}
    before = json.loads(RELEASE.read_text()) if RELEASE.exists() else {}
    lines = code_lines()
    for row in report(found, before, lines):
        print(row)
    if options.release:
        kept = before.get("jobs", {}) | {name: vars(figure) for name, figure in found.items()}
        text = json.dumps({"version": papilla.__version__, "code_lines": lines, "jobs": kept}, indent=2)
        write_text(RELEASE, text + "\n")


def jobs(folder: Path, tests: bool) -> Iterator[tuple[str, Callable[[], tuple[float, float]]]]:
    """Name and job, each of which returns seconds of processor and MiB of its largest process."""
    own = folder / "own.toml"
    design = (ROOT / "papilla" / "data" / "default_finger.toml").read_text()
    for old, new in OWN.items():
        assert old in design
        design = design.replace(old, new)
    own.write_text(design)
    cold = {"PAPILLA_CACHE": str(folder / "cold")}, {"PAPILLA_CACHE": str(folder / "own")}
    calibrate = ("calibrate", "--out", str(folder / "calibration"))
    press = ("press", "--modulus", "0.1", "--force", "0.4")
    yield "calibrate, default finger, cold", lambda: command(calibrate, cold[0])
    yield "calibrate, default finger, warm", lambda: command(calibrate, cold[0])
    yield "press, default finger, warm", lambda: (command(press, cold[0]), command(press, cold[0]))[1]
    yield "calibrate, own dome, cold", lambda: command((*calibrate, "--finger", str(own)), cold[1])
    yield "one drawn scene, default physics", lambda: snippet(SCENES.format(job=DRAWN), cold[0])
    yield "1000 drawn scenes, linear", lambda: snippet(SCENES.format(job=THOUSAND), cold[0])
    yield "one update of the pipeline", lambda: snippet(UPDATE, cold[0])
    if tests:
        yield (
            "quick tests",
            lambda: run([sys.executable, "-m", "pytest", "-q", "-m", "not slow", "-n", "2"], cold[0])[:2],
        )


def measured(job: Callable[[], tuple[float, float]]) -> Figure:
    """A job between two pieces of work."""
    before = piece_of_work()
    seconds, peak = job()
    return Figure(seconds, seconds / ((before + piece_of_work()) / 2), peak)


def piece_of_work() -> float:
    """Seconds of processor of some NumPy work: the least of five times."""
    rng = np.random.default_rng(0)
    matrix, times = rng.standard_normal((UNIT_SIZE, UNIT_SIZE)), []
    for _ in range(5):
        began = process_time()
        np.linalg.solve(matrix @ matrix.T, matrix)
        np.sort(matrix.ravel())
        np.fft.fft(matrix)
        times.append(process_time() - began)
    return min(times)


def command(arguments: tuple[str, ...], environment: dict[str, str]) -> tuple[float, float]:
    """Seconds and MiB of a papilla command and its processes."""
    return run([sys.executable, "-m", "papilla", *arguments], environment)[:2]


def snippet(code: str, environment: dict[str, str]) -> tuple[float, float]:
    """The seconds that a program prints, and its MiB."""
    _, peak, said = run([sys.executable, "-c", code], environment)
    return float(said.split()[-1]), peak


def run(line: list[str], environment: dict[str, str]) -> tuple[float, float, str]:
    """Seconds of processor and MiB of the largest process of a program and those it started, and what it printed."""
    with tempfile.TemporaryFile("w+") as said:
        one_thread = dict.fromkeys(THREAD_VARIABLES, "1")
        process = subprocess.Popen(
            line, cwd=ROOT, env=os.environ | one_thread | environment, stdout=said, stderr=subprocess.DEVNULL
        )
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        said.seek(0)
        text = said.read()
    if process.returncode:
        print(f"{' '.join(line[2:5])} ended with code {process.returncode}", file=sys.stderr)
    return usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024, text


def code_lines() -> int:
    """Lines of code of the package, counted by `benchmarks/size.py`."""
    from size import code_lines as of_source

    return sum(of_source(path.read_text(encoding="utf-8")) for path in ROOT.glob("papilla*/**/*.py"))


def report(found: dict[str, Figure], before: dict, lines: int) -> Iterator[str]:
    """What is to be printed: first what got worse than in the last release, then every job, then the lines of code."""
    old = {name: Figure(**figure) for name, figure in before.get("jobs", {}).items()}
    for name, now in found.items():
        for what in ("units", "peak_MiB"):
            then = getattr(old.get(name), what, None)
            if then and getattr(now, what) > WORSE * then:
                quantity = "time" if what == "units" else "memory"
                yield f"WORSE than in {before['version']}: {name}, {quantity} {getattr(now, what) / then:.2f} times"
    yield f"{'job':<36} {'seconds':>9} {'units':>9} {'MiB':>6} {'over the release, units and MiB':>32}"
    for name, now in found.items():
        then = old.get(name)
        over = f"{now.units / then.units:.2f} {now.peak_MiB / then.peak_MiB:.2f}" if then else "new"
        yield f"{name:<36} {now.seconds:>9.3g} {now.units:>9.3g} {now.peak_MiB:>6.0f} {over:>32}"
    yield f"{lines} lines of code, {before.get('code_lines', 'unknown')} in the last release"


if __name__ == "__main__":
    main()
