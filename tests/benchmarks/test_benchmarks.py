"""Every script of benchmarks/ runs, in a short form: a coarse mesh, or fewer scenes."""

import importlib.util
import inspect
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import typer

from benchmarks.estimators.comparison import Plan
from papilla.fem.pressing.response import response
from papilla.identification.posing import family_of
from papilla.mesh import build
from papilla.model.finger import Finger
from papilla.model.specimen import Block, Friction

FOLDER = Path(__file__).parents[2] / "benchmarks"


def along(_name: str, modulus: float, ratio: float, friction: Friction) -> np.ndarray:
    """What the model itself says, in place of the rings."""
    loads = np.geomspace(0.5, 34.0, 28)
    pressed = response(family_of(Finger.default(), size_mm=2.8), Block(1.0, 10.0), friction=friction)
    felt = pressed.felt(loads, np.full(len(loads), modulus), ratio, 1.0)
    return np.column_stack([felt.indentation / loads ** (2 / 3), felt.values.reshape(len(loads), -1) / loads[:, None]])


START = Plan(scenes=("start",), methods=("pipeline", "STFT over"), seeds=(3,), longest_s=0.4)

SHORT = {
    "amplitude_curve": ([], {"WAVELENGTHS_MM": (1.8,)}, "1.8 mm: 1.0000, shipped"),
    "identified_fingers": (
        ["presses", "--fingers", "2", "--family"],
        {"SIZE_MM": 2.8, "FIT_SIZE_MM": 2.8, "VARIANT": 0, "COUNTS": (5,)},
        "9 of 10: ",
    ),
    "design_studies": (["--designs", "120"], {}, "efficiency of two workers"),
    "friction_honesty": (["--runs", "3"], {}, "every drawn log"),
    "log_throughput": (["--rows", "1500"], {"NOISE": {"a line": 1.0}}, "a line: "),
    "mesh_convergence": ([], {"DEFAULT_SIZE_MM": 2.8, "FORCES_GF": (60,), "VARIANTS": 2}, "sd, hertz, worst"),
    "moved_meshes": (["--shapes", "narrow"], {"SIZE_MM": 2.8, "drawn": build, "FORCES_GF": (30.0,)}, "narrow "),
    "own_fingers": (
        ["--geometry", "A", "--moduli", "0.2"],
        {"SIZE_MM": 2.8, "FORCES_GF": (20.0,), "FRICTIONS": (0.0,)},
        "A, 0.0: 0.2 MPa, 1 of 1: ",
    ),
    "own_identification": (
        ["--fingers", "1", "--presses", "15", "--friction", "told"],
        {"SIZE_MM": 2.8, "GEOMETRIES": {"A": SimpleNamespace(finger=Finger.default())}, "along": along},
        "A, 15 presses, friction told, stick: 1 fingers",
    ),
    "pipeline": (["--seconds", "2"], {}, "wavelength, friction"),
    "published_finger": (
        [],
        {"SIZE_MM": 2.8, "INNER_MPA": np.geomspace(0.0265, 0.054, 4), "RATIOS": np.geomspace(2, 8, 4)},
        "grid_length: ",
    ),
    "recorded_outputs": (["record", "answers.json", "--only", "new"], {}, "1 commands recorded"),
    "recovered_modulus": (
        ["--moduli", "3", "--forces", "2", "--draws", "2"],
        {"MESHES": (4,), "FRICTIONS": (0.0, "stick")},
        "dominant: friction",
    ),
    "section_against_presses": (
        ["--forces", "0.3"],
        {"SIZE_MM": 2.8, "GRATINGS": ((9.0, 0.2),), "PLACES": 4, "fingers": lambda: (Finger.default(),)},
        "swing of the section over that in three dimensions",
    ),
    "suggested_presses": (["--fingers", "2", "--size", "2.8"], {}, "suggested presses are better by"),
    "estimator_comparison": (["--short"], {"PROCESSES": 1, "SHORT": START}, "one run per scene is not enough"),
    "peers": ([], {"DEFAULT_SIZE_MM": 2.8}, ""),
    "mutants": (["calibration", "--list", "--count", "3"], {}, "calibration: papilla/calibration/"),
    "size": ([], {}, "in all"),
    "budget": (["--jobs", "update"], {}, "one update of the pipeline"),
    "files_read": (["press"], {}, "press: "),
    "wavelength_estimators": (["--scenes", "start", "--seeds", "1", "--workers", "1"], {}, "in 2 sigma"),
}
"""Script -> arguments, constants to replace, and what it must print. `papilla bench --short` itself is run, with its
numbers looked at, in tests/cli."""


def loaded(name: str, monkeypatch):
    """The script as a module."""
    monkeypatch.syspath_prepend(FOLDER)
    spec = importlib.util.spec_from_file_location(f"benchmark_{name}", FOLDER / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_what_costs_a_third_more_than_in_the_last_release_is_printed_first(monkeypatch):
    budget = loaded("budget", monkeypatch)
    was = {"version": "0.1", "jobs": {"press": {"seconds": 1.0, "units": 10.0, "peak_MiB": 100.0}}, "code_lines": 9}
    rows = list(budget.report({"press": budget.Figure(3.0, 14.0, 120.0), "new": budget.Figure(1, 1, 1)}, was, 7))
    assert rows[0] == "WORSE than in 0.1: press, time 1.40 times"
    assert sum(row.startswith("WORSE") for row in rows) == 1 and rows[-1] == "7 lines of code, 9 in the last release"


def test_lines_of_code_are_neither_blank_nor_comments_nor_docstrings(monkeypatch):
    size = loaded("size", monkeypatch)
    source = '"""Doc\n\nstring."""\n\n# why\na = 3.5  # not counted apart\n"""Of a."""\nb = (\n    -1,\n    7,\n)\n'
    assert (size.code_lines(source), size.literals(source)) == (5, 2)


def test_every_benchmark_has_a_short_form():
    assert set(SHORT) == {path.stem for path in FOLDER.glob("*.py")} - {"__init__"}


@pytest.mark.slow
@pytest.mark.parametrize("name", SHORT)
def test_short_form(name, monkeypatch, capsys, tmp_path):
    arguments, constants, expected = SHORT[name]
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", [f"{name}.py", *arguments])
    module = loaded(name, monkeypatch)
    for constant, value in constants.items():
        assert hasattr(module, constant)
        monkeypatch.setattr(module, constant, value)
    if name == "published_finger":
        module.SHIPPED = module.Physics(0.0, False)
    if inspect.signature(module.main).parameters:
        with pytest.raises(SystemExit) as end:
            typer.run(module.main)
        assert end.value.code == 0
    else:
        module.main()
    assert expected in capsys.readouterr().out
