"""What all commands answer on fixed inputs: record it before a change that no user should see, compare after it.

    python benchmarks/recorded_outputs.py record before.json
    python benchmarks/recorded_outputs.py compare before.json

Each command runs in a folder of its own on inputs that commands before it have made. Its JSON, and the tables and
documents that it writes, are kept as numbers and text; pictures and pages by their name alone. Times, versions, hashes
and paths are left out of the comparison. It takes some minutes, and prints the relative difference of every number that
has moved by more than 1e-9.
"""

import argparse
import csv
import json
import math
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

TOLERANCE = 1e-9
"""Largest relative difference that counts as equal: rounding in another order of the same operations."""
CHANGING = re.compile(
    r"second|_ms$|_s$|_us$|ratio|memory|version|sha256|hash|provenance|created|when|date|written|path|page|host|platform"
    r"|processor|doctor|peers|solver_time"
)
"""Keys whose values change from run to run or with the place of a file."""

PRESSES = "force_N,modulus_MPa,g1,g2,g3,g4,g5\n"
STUDY = """name = "two moduli"
objectives = ["sigma_gauges", "signal_over_noise"]
[free]
"outer.modulus_MPa" = [0.1, 0.2]
"inner.modulus_MPa" = [0.03, 0.05]
[sampler]
kind = "grid"
"""
CALIBRATION = "calibration/calibration.json"
COMMANDS: dict[str, str] = {
    "press": "press --modulus 0.1 --force 0.4 --log touch.csv --json",
    "press rigid ball": "press --modulus 1000 --force 0.2 --specimen sphere --radius 20 --json",
    "press stuck": "press --modulus 0.3 --indentation 0.8 --friction stick --json",
    "press aside": "press --modulus 0.2 --force 0.3 --at 2 1 --fidelity contact --json",
    "press published": "press --modulus 0.51 --force 0.5 --finger published --json",
    "press half-space": "press --modulus 0.2 --force 0.1 --specimen half-space --fidelity hertz --json",
    "slide": "slide --groove 0.9 --ridge 0.9 --speed 60 --seconds 4 --friction 0.3 --noise-microstrain 2 --seed 3 "
    "--out slide.csv --json",
    "calibrate": "calibrate --quick --out calibration --json",
    "calibrate published": "calibrate --quick --finger published --friction 0 --out published --json",
    "estimate": f"estimate slide.csv --calibration {CALIBRATION} --out estimate.csv --json",
    "estimate touch": f"estimate touch.csv --calibration {CALIBRATION} --thickness 10 --out touch_estimate.csv --json",
    "estimate by S_d": f"estimate touch.csv --calibration {CALIBRATION} --softness sd --out sd.csv --json",
    "estimate printed": f"estimate touch.csv --calibration {CALIBRATION} --softness printed --out printed.csv --json",
    "identify": "identify presses.csv --out finger.toml --json",
    "identify suggest": "identify --suggest 3 --moduli 0.089,0.72 --json",
    "press identified": "press --modulus 0.1 --force 0.4 --finger finger.toml --json",
    "export-c": "export-c calibration/calibration.json --out finger.h",
    "compare": "compare calibration/calibration.json published/calibration.json --json",
    "slide again": "slide --groove 0.9 --ridge 0.9 --speed 60 --seconds 4 --seed 4 --out again.csv",
    "slide coarse": "slide --groove 1.5 --ridge 1.5 --speed 60 --seconds 4 --out coarse.csv",
    "slide coarse again": "slide --groove 1.5 --ridge 1.5 --speed 50 --seconds 5 --out coarser.csv",
    "texture train": "texture train fine=slide.csv fine=again.csv coarse=coarse.csv coarse=coarser.csv "
    "--out textures.json --json",
    "texture classify": "texture classify slide.csv --model textures.json --json",
    "log map": "log map slide.csv --out log_map.toml --json",
    "new": "new design.toml --shape slab",
    "design": "design study.toml --out study --workers 1 --json",
    "view receptive": "view receptive --gauge g3 --screenshot receptive.png --json",
    "telepresence": "telepresence simulate --seconds 3 --json",
    "verify": "verify --only hertz --json",
    "reproduce": "reproduce --json",
}  # fmt: skip
"""Name -> arguments; the commands run in this order and find the files of those before them."""


def run_all(folder: Path, only: str | None = None) -> dict[str, Any]:
    """What each command, or the one of a name, answers and writes."""
    (folder / "study.toml").write_text(STUDY, encoding="utf-8")
    answers: dict[str, Any] = {}
    for name, arguments in COMMANDS.items():
        if only not in (None, name):
            continue
        if "presses.csv" in arguments:
            _write_presses(folder)
        before = {path: path.stat().st_mtime_ns for path in folder.rglob("*") if path.is_file()}
        print(name, file=sys.stderr, flush=True)
        done = subprocess.run(
            [sys.executable, "-m", "papilla", *arguments.split()], cwd=folder, capture_output=True, text=True
        )
        made = [path for path in sorted(folder.rglob("*")) if path.is_file()]
        fresh = [path for path in made if path.stat().st_mtime_ns != before.get(path)]
        answers[name] = {
            "exit": done.returncode,
            "json": json.loads(done.stdout) if "--json" in arguments and done.stdout.startswith("{") else done.stdout,
            "refusal": done.stderr.splitlines()[-1:] if done.returncode else [],
            "files": {path.relative_to(folder).as_posix(): _content(path) for path in fresh},
        }
    return answers


def _write_presses(folder: Path) -> None:
    """A bench log of the calibration's sweep: every seventh press of blocks below 0.5 MPa."""
    with (folder / "calibration" / "sweep.csv").open(encoding="utf-8") as stream:
        rows = [row for row in csv.DictReader(stream) if 0.05 < float(row["modulus_MPa"]) < 0.5]
    names = PRESSES.strip().split(",")
    lines = [",".join(row[name] for name in names) for row in rows[::7]]
    (folder / "presses.csv").write_text(PRESSES + "\n".join(lines) + "\n", encoding="utf-8")


def _content(path: Path) -> Any:
    if path.suffix == ".json":
        return json.loads(path.read_text(encoding="utf-8"))
    if path.suffix == ".csv":
        with path.open(encoding="utf-8") as stream:
            return [[_cell(cell) for cell in row] for row in csv.reader(stream)]
    return path.read_text(encoding="utf-8").splitlines() if path.suffix in (".toml", ".h") else "written"


def _cell(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text


def differences(before: Any, after: Any, place: str = "") -> Iterator[str]:
    """Each place at which two answers differ, with both values."""
    if isinstance(before, dict) and isinstance(after, dict):
        for key in dict.fromkeys([*before, *after]):
            if not CHANGING.search(str(key).lower()) or str(key).endswith((".csv", ".json")):
                yield from differences(before.get(key), after.get(key), f"{place}/{key}")
    elif isinstance(before, list) and isinstance(after, list) and len(before) == len(after):
        for number, (one, other) in enumerate(zip(before, after, strict=True)):
            yield from differences(one, other, f"{place}/{number}")
    elif isinstance(before, float | int) and isinstance(after, float | int):
        if not math.isclose(before, after, rel_tol=TOLERANCE, abs_tol=1e-12) and not (
            before != before and after != after
        ):
            yield f"{place}: {before!r} -> {after!r}"
    elif before != after:
        yield f"{place}: {str(before)[:300]!r} -> {str(after)[:300]!r}"


def main() -> int:
    """Record or compare; exit code 1 if something differs."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("job", choices=("record", "compare"))
    parser.add_argument("file", type=Path)
    parser.add_argument("--only", choices=COMMANDS, help="one command, which must need no other's files")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        answers = run_all(Path(folder), given.only)
    if given.job == "record":
        given.file.write_text(json.dumps(answers), encoding="utf-8")
        print(f"{len(answers)} commands recorded")
        return 0
    found = list(differences(json.loads(given.file.read_text(encoding="utf-8")), json.loads(json.dumps(answers))))
    print("\n".join(found) or f"{len(answers)} commands answer as before")
    return bool(found)


if __name__ == "__main__":
    sys.exit(main())
