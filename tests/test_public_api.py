"""The curated names of `papilla`: complete, documented, and free until they are used."""

import ast
import importlib
import subprocess
import sys
from pathlib import Path

import pytest

import papilla

HEAVY = ("numpy", "scipy", "skfem", "pyvista", "vtkmodules", "matplotlib", "pydantic", "meshio", "pytetwild", "rslab")
DOCUMENTED = ("Finger", "HalfSpace", "Block", "Sphere", "Grating", "Calibration", "PapillaError")


def loaded_after(code: str) -> list[str]:
    """The heavy modules that a fresh interpreter has loaded after `code`."""
    report = f"import sys; print(*[name for name in {HEAVY!r} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", f"{code}\n{report}"], capture_output=True, text=True, check=True)
    return done.stdout.splitlines()[-1].split()


def test_importing_papilla_loads_nothing_heavy():
    assert loaded_after("import papilla") == []


def test_help_loads_nothing_heavy():
    code = "from papilla.cli.main import run\ntry:\n    run(['--help'])\nexcept SystemExit as end:\n    print(end.code)"
    assert loaded_after(code) == []


@pytest.mark.slow
def test_the_probe_sees_a_heavy_module():
    assert "numpy" in loaded_after("import papilla; papilla.read_presses")


@pytest.mark.parametrize("name", papilla.__all__)
def test_every_curated_name_is_there_and_documented(name):
    value = getattr(papilla, name)
    assert value.__doc__
    assert name in dir(papilla)
    assert value is getattr(papilla, name), "asked for twice, it is the same object"


def test_the_documented_names_are_curated():
    assert set(DOCUMENTED) <= set(papilla.__all__)
    assert {"Layer", "Dome", "Slab", "Surfaces", "Ogden"} <= set(papilla.__all__)
    assert len(papilla.__all__) <= 40


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="module 'papilla' has no attribute 'Fingre'"):
        papilla.Fingre  # noqa: B018


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
