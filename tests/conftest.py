"""What all tests share: a cache of their own, so that nothing is read from or written to the user's."""

import ctypes
import gc
import os
import sys
from pathlib import Path

import pytest

SHARED_CACHE = "PAPILLA_TEST_CACHE"
"""Environment variable with the folder of a cache that several sessions share, such as quick and slow tests."""

MESH_TESTS = Path(__file__).parent / "mesh"


@pytest.fixture(scope="session", autouse=True)
def cache_folder(tmp_path_factory):
    """The cache of this session, shared by its processes; meshes and reduced fingers are made once for all tests."""
    # The processes of pytest-xdist have folders of their own side by side in that of the session
    base = tmp_path_factory.getbasetemp()
    base = base.parent if "PYTEST_XDIST_WORKER" in os.environ else base
    folder = Path(os.environ.get(SHARED_CACHE) or base / "papilla-cache")
    folder.mkdir(mode=0o700, exist_ok=True)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PAPILLA_CACHE", str(folder))
        patch.setenv("MPLBACKEND", "Agg")
        # Two processes of the tests may want the same entry: one waits, without the warning, which would be an error
        patch.setattr("papilla.cache.PATIENCE_S", 600.0)
        yield folder


def pytest_collection_finish():
    """Take all that collection has made out of the garbage collector's sight: it stays, and to visit it takes a quarter
    of a second each time."""
    gc.collect()
    gc.freeze()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item):
    """Outside tests/mesh nothing hangs on a draw of the mesher, which cannot be seeded: it is refused there, but for
    tests of a shape that no reference can be moved to, which are marked `mesher`."""
    if MESH_TESTS in item.path.parents or item.get_closest_marker("mesher"):
        return (yield)
    from papilla.mesh import drawing

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(drawing, "tetrahedralise", _refuse)
        return (yield)


def _refuse(*_, **__):
    raise AssertionError("a test outside tests/mesh called the mesher")


@pytest.fixture(scope="module", autouse=True)
def memory_given_back():
    """What a module's tests no longer need goes back to the machine, not only to the allocator."""
    yield
    gc.collect()
    if sys.platform == "linux":
        ctypes.CDLL(None).malloc_trim(0)
