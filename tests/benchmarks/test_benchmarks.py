"""Every script of benchmarks/ runs, in a short form: a coarse mesh, or fewer scenes."""

import importlib
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[2] / "benchmarks"

SHORT = {
    "amplitude_curve": ("--wavelengths 1.8", "1.8 mm: 1.0000, shipped"),
    "budget": ("--jobs update", "one update of the pipeline"),
    "design_studies": ("--designs 120", "efficiency of two workers"),
    "estimator_comparison": ("--short --scene start --method pipeline --json", '"scene": "start"'),
    "files_read": ("press", "press: "),
    "friction_honesty": ("--runs 3", "every drawn log"),
    "identified_fingers": ("presses --fingers 2 --family --size-mm 2.8 --variant 0 --counts 5", "9 of 10: "),
    "load_growth": ("--growths 3 --finest 2.5", "growth 3: "),
    "log_throughput": ("--rows 1500 --logs strong@line", "strong line: "),
    "mesh_convergence": ("--size-mm 2.8 --forces-gf 60 --meshes 2", "sd, hertz, worst"),
    "moved_meshes": ("--shapes narrow --drawn 1 --variants 1 --size-mm 2.8 --forces-gf 30", "narrow "),
    "mutants": ("calibration --list --count 3", "calibration: papilla/calibration/"),
    "own_fingers": ("--geometry A --size-mm 2.8 --frictions 0", "0.0: 5 of 5 with large strain"),
    "own_identification": (
        "--geometry default --rings 1 --draws 1 --presses 15 --friction stated --size-mm 2.8",
        "default, 15 presses, friction stated: 1 fingers",
    ),
    "peers": ("--help", "one press by each installed library"),
    "pipeline": ("--seconds 2", "wavelength, friction"),
    "published_finger": ("--quick", "grid_length: "),
    "recorded_outputs": ("record answers.json --only new", "1 commands recorded"),
    "recovered_modulus": ("--moduli 3 --forces 2 --draws 2 --meshes 4 --frictions 0", "dominant: friction"),
    "renamed_names": ("--count 3 --rooms scenes", "0 tests fail after 3 renames"),
    "section_against_presses": (
        "--forces 0.3 --size-mm 2.8 --places 4 --gratings 1 --fingers 1",
        "swing of the section over that in three dimensions",
    ),
    "shipped_tables": ("--help", "the prices of the fidelities"),
    "size": ("", "in all"),
    "specimen_strain": ("--draws 1", "without friction, p/E "),
    "suggested_presses": ("--fingers 2 --size 2.8", "suggested presses are better by"),
    "wavelength_estimators": ("--scenes start --seeds 1 --workers 1", "in 2 sigma"),
}  # fmt: skip
"""Script -> arguments (@ is a space in one), and what it must print. What peers.py runs is tested in test_peers.py;
`papilla bench --short` itself is run, with its numbers looked at, in tests/cli."""


def test_every_benchmark_has_a_short_form():
    assert set(SHORT) == {path.stem for path in FOLDER.glob("[!_]*.py")}


@pytest.mark.parametrize(
    "name", [name if name == "mutants" else pytest.param(name, marks=pytest.mark.slow) for name in SHORT]
)
def test_short_form(name, tmp_path):
    arguments, expected = SHORT[name]
    environment = os.environ | {"PYTHONPATH": str(FOLDER.parent), "COLUMNS": "200"}
    command = [sys.executable, str(FOLDER / f"{name}.py"), *(one.replace("@", " ") for one in arguments.split())]
    done = subprocess.run(command, env=environment, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    assert expected in done.stdout
    if name == "estimator_comparison":
        assert json.loads(done.stdout)["short"] is True


@pytest.mark.parametrize("room", ["scenes", "view", "papilla_papers"])
def test_mutants_are_drawn_the_same_for_the_same_seed(room):
    mutants = importlib.import_module("benchmarks.mutants")
    plan = mutants.drawn(room, 5, seed=3)
    assert len(plan) == 5 and plan == mutants.drawn(room, 5, seed=3) != mutants.drawn(room, 5, seed=4)
    for one in plan:
        source = (FOLDER.parent / one.file).read_text(encoding="utf-8")
        assert one.file.startswith(room if room == "papilla_papers" else f"papilla/{room}/")
        assert one.applied(source) != source
        compile(one.applied(source), one.file, "exec")


def test_what_costs_a_third_more_than_in_the_last_release_is_printed_first():
    budget = importlib.import_module("benchmarks.budget")
    was = {"version": "0.1", "jobs": {"press": {"seconds": 1.0, "units": 10.0, "peak_MiB": 100.0}}, "code_lines": 9}
    rows = list(budget.report({"press": budget.Figure(3.0, 14.0, 120.0), "new": budget.Figure(1, 1, 1)}, was, 7))
    assert rows[0] == "WORSE than in 0.1: press, time 1.40 times" and "WORSE" not in "".join(rows[1:])
    assert rows[-1] == "7 lines of code, 9 in the last release"
