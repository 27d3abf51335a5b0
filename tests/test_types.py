"""Type checkers and editors see what the lazy packages offer."""

import importlib
import inspect
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
RIGHT = [
    "finger: papilla.model.finger.Finger = papilla.Finger.default()",
    "skin: float = papilla.Layer(0.1).modulus + papilla.Ogden(1.0, 2.0).mu",
    "pipeline = papilla.estimators.Pipeline(gauges=2)",
    "picture = papilla.view.strain_figure",
]
WRONG = ["papilla.Fingre", "papilla.Finger.default().outre", "papilla.estimators.Pipline", "papilla.view.stain"]


@pytest.mark.slow
def test_right_code_passes_and_each_misspelt_name_is_an_error(tmp_path):
    snippet = tmp_path / "snippet.py"
    snippet.write_text("\n".join(["import papilla", "import papilla.model.finger", *RIGHT, *WRONG]))
    # In the project's folder, so with its options and with what `make lint` has cached
    command = [sys.executable, "-m", "mypy", str(snippet)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    found = [line.split("snippet.py:")[1] for line in done.stdout.splitlines() if "snippet.py:" in line]
    assert [int(line.split(":")[0]) for line in found] == [7, 8, 9, 10], done.stdout
    assert all("has no attribute" in line for line in found)


@pytest.mark.slow
def test_users_see_the_types_from_outside_in_strict_mode(tmp_path):
    snippet = tmp_path / "user.py"
    snippet.write_text(
        "import papilla\n"
        "def modulus(path: str) -> float:\n"
        "    reduced = papilla.fem.prepare(papilla.Finger.default())\n"
        "    press = papilla.fem.press(reduced, papilla.Block(0.1, thickness=10), force=0.4)\n"
        "    answer = papilla.Calibration.load(path).invert(press.sd, force_N=press.force)\n"
        "    wrong: str = press.sd\n"
        "    return float(answer.modulus_MPa)\n"
    )
    command = [sys.executable, "-m", "mypy", "--strict", "--cache-dir", str(tmp_path), str(snippet)]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert [line for line in done.stdout.splitlines() if "error" in line and "user.py:6" not in line][:-1] == []
    assert "user.py:6: error: Incompatible types in assignment" in done.stdout


def public() -> dict[str, object]:
    """Functions and classes of the public packages, and the public methods of these classes."""
    rooms = "calibration estimators fem identification logs mesh model references scenes telepresence verify view"
    names = ("", *(f".{room}" for room in rooms.split()))
    found: dict[str, object] = {}
    for module in (importlib.import_module(f"papilla{name}") for name in names):
        for name in getattr(module, "__all__", dir(module)):
            item = getattr(module, name)
            if not getattr(item, "__module__", "").startswith("papilla.") or name.startswith("_"):
                continue
            found[f"{module.__name__}.{name}"] = item
            for method, value in vars(item).items() if inspect.isclass(item) else ():
                value = value.fget if isinstance(value, property) else getattr(value, "__func__", value)
                if inspect.isfunction(value) and (not method.startswith("_") or method in ("__init__", "__call__")):
                    found[f"{module.__name__}.{name}.{method}"] = value
    return {name: item for name, item in found.items() if inspect.isfunction(item)}


def test_every_public_function_says_the_types_of_what_it_takes_and_returns():
    functions = public()
    assert len(functions) > 200
    lacking = {
        name: [one for one in inspect.signature(item).parameters if one not in (*item.__annotations__, "self", "cls")]
        + (["return"] if "return" not in item.__annotations__ and not name.endswith("__init__") else [])
        for name, item in functions.items()
        if item.__code__.co_filename.startswith(str(ROOT))
    }
    assert {name: missing for name, missing in lacking.items() if missing} == {}
