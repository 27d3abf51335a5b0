"""What the tests of finite strain share: the coarse meshes of the tests of fem."""

import importlib.util
from pathlib import Path

import pytest

from papilla.finger import Finger


def _meshes():
    path = Path(__file__).parents[1] / "fem" / "conftest.py"
    spec = importlib.util.spec_from_file_location("meshes_of_fem_tests", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="session")
def box():
    """Function that makes a box mesh."""
    return _meshes().make_box


@pytest.fixture(scope="session")
def dome():
    """Function that makes a coarse dome mesh of a finger."""
    return _meshes().make_dome


@pytest.fixture(scope="session")
def coarse(dome):
    """The default finger and a coarse structured mesh of it."""
    return Finger.default(), dome(Finger.default())
