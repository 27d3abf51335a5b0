"""The curated names of `papilla`: complete, documented, and free until they are used."""

import ast
import importlib
import inspect
import subprocess
import sys
from pathlib import Path

import pytest

import papilla
from papilla.verbs import OLD_NAMES

HEAVY = ("numpy", "scipy", "skfem", "pyvista", "vtkmodules", "matplotlib", "pydantic", "meshio", "pytetwild", "rslab")
ROOMS = {path.parent.name for path in Path(papilla.__file__).parent.glob("*/__init__.py")} - {"cli"}
MOVED = {"errors": "core.errors", "units": "core.units", "specimen": "model.specimen"}


def loaded_after(code: str) -> list[str]:
    """The heavy modules that a fresh interpreter has loaded after `code`."""
    report = f"import sys; print(*[name for name in {HEAVY!r} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", f"{code}\n{report}"], capture_output=True, text=True, check=True)
    return done.stdout.splitlines()[-1].split()


HELP = "from papilla.cli.main import run\ntry:\n    run(['--help'])\nexcept SystemExit as end:\n    print(end.code)"
RECORD = "import papilla; papilla.Calibration; papilla.calibration.SoftnessStatus"


@pytest.mark.parametrize("code, unwanted", [("import papilla", HEAVY), (HELP, HEAVY), (RECORD, ("pydantic", "skfem"))])
def test_what_is_not_used_is_not_loaded(code, unwanted):
    loaded = loaded_after(code)
    assert not {*unwanted} & {*loaded} and ("numpy" in loaded) == (code == RECORD)


def test_every_room_is_an_attribute_and_a_misspelt_one_an_error():
    assert {*papilla.__all__} >= ROOMS and len(papilla.__all__) <= 40
    for name, place in ({room: room for room in ROOMS} | MOVED).items():
        code = f"import papilla; print(papilla.{name}.__name__)"
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
        assert done.stdout.strip() == f"papilla.{place}"
    for module, name in ((papilla, "papilla"), (papilla.calibrate, "papilla.calibrate")):
        with pytest.raises(AttributeError, match=f"{name}'? has no attribute 'sewep'"):
            module.sewep  # noqa: B018
    assert "quick" in inspect.signature(papilla.calibrate).parameters


@pytest.mark.parametrize("name", papilla.__all__)
def test_every_curated_name_is_there_and_documented(name):
    value = getattr(papilla, name)
    assert value.__doc__
    assert name in dir(papilla)
    assert value is getattr(papilla, name), "asked for twice, it is the same object"


LAZY = sorted(
    f".{path.parent.name}".removesuffix(".papilla") for path in Path(papilla.__file__).parent.rglob("__init__.pyi")
)


@pytest.mark.parametrize("package", [f"papilla{part}" for part in LAZY])
def test_a_lazy_package_offers_what_its_stub_names(package):
    module = importlib.import_module(package)
    stub = Path(module.__file__).with_suffix(".pyi").read_text()
    named = {alias.asname for node in ast.parse(stub).body if isinstance(node, ast.ImportFrom) for alias in node.names}
    assert named == set(module.__all__) - {"__version__"}
    assert all(getattr(module, name) is not None for name in named)


def test_every_error_is_a_papilla_error_and_a_builtin():
    from papilla.core import errors

    found = [value for value in vars(errors).values() if isinstance(value, type) and issubclass(value, Exception)]
    assert len(found) >= 5
    for error in found:
        assert issubclass(error, errors.PapillaError)
        builtin = [base for base in error.__mro__ if base.__module__ == "builtins" and base not in (Exception, object)]
        assert error is errors.PapillaError or len(builtin) > 1


def test_a_design_and_its_condensed_model_press_alike():
    finger, block = papilla.Finger.default(), papilla.Block(0.2, thickness=10)
    whole = papilla.press(finger, block, force=0.3)
    assert whole.sd == papilla.press(papilla.fem.prepare(finger), block, force=0.3).sd
    assert whole.sd == papilla.fem.press(papilla.fem.prepare(finger), block, force=0.3).sd
    for old in ("force_N", "indentation_mm", "start"):
        with pytest.raises(TypeError, match=old):
            papilla.fem.press(papilla.fem.prepare(finger), block, **{old: 0.3})


@pytest.mark.parametrize("place, name", [(place, name) for place, names in OLD_NAMES.items() for name in names])
def test_names_of_the_old_package_calibrate_warn_once_and_are_those_of_the_new_place(place, name):
    with pytest.warns(DeprecationWarning, match=rf"^papilla\.calibrate\.{name} is {place}\.{name} now") as warned:
        value = getattr(papilla.calibrate, name)
    assert len(warned) == 1 and value is getattr(importlib.import_module(place), name)
