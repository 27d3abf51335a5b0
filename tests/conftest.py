"""What all tests share: a cache of their own, so that nothing is read from or written to the user's."""

import ctypes
import gc
import os
import sys

import pytest


@pytest.fixture(scope="session", autouse=True)
def cache_folder(tmp_path_factory):
    """The cache of this session, shared by its processes; meshes and reduced fingers are made once for all tests."""
    # The processes of pytest-xdist have folders of their own side by side in that of the session
    base = tmp_path_factory.getbasetemp()
    base = base.parent if "PYTEST_XDIST_WORKER" in os.environ else base
    folder = base / "papilla-cache"
    folder.mkdir(exist_ok=True)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PAPILLA_CACHE", str(folder))
        patch.setenv("MPLBACKEND", "Agg")
        yield folder


@pytest.fixture(scope="module", autouse=True)
def memory_given_back():
    """What a module's tests no longer need goes back to the machine, not only to the allocator."""
    yield
    gc.collect()
    if sys.platform == "linux":
        ctypes.CDLL(None).malloc_trim(0)
