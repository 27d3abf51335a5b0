"""Type checkers and editors see what the lazy packages offer."""

import importlib
import inspect
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
SNIPPET = """import papilla
import papilla.model.finger
finger: papilla.model.finger.Finger = papilla.Finger.default()
skin: float = papilla.Layer(0.1).modulus + papilla.Ogden(1.0, 2.0).mu
def modulus(path: str) -> float:
    press = papilla.fem.press(papilla.fem.prepare(finger), papilla.Block(0.1, thickness=10), force=0.4)
    return float(papilla.Calibration.load(path).invert(press.sd, force_N=press.force).modulus_MPa)
pipeline, picture = papilla.estimators.Pipeline(gauges=2), papilla.view.strain_figure
papilla.Fingre
papilla.Finger.default().outre
papilla.estimators.Pipline
papilla.view.stain
wrong: str = papilla.Layer(0.1).modulus
"""


@pytest.mark.slow
def test_users_see_the_types_in_strict_mode_and_each_mistake_is_an_error(tmp_path):
    (tmp_path / "user.py").write_text(SNIPPET)
    command = [sys.executable, "-m", "mypy", "--strict", "--cache-dir", str(tmp_path), "user.py"]
    said = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True).stdout
    errors = [line.split(":", 2)[1:] for line in said.splitlines() if line.startswith("user.py:")]
    assert [int(line) for line, _ in errors] == [9, 10, 11, 12, 13], said
    assert all("has no attribute" in what for _, what in errors[:4]) and "Incompatible types" in errors[4][1]


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
