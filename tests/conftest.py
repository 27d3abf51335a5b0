"""What all tests share: a cache of their own, so that nothing is read from or written to the user's."""

import ctypes
import gc
import os
import sys
from collections import defaultdict
from pathlib import Path

import pytest

SHARED_CACHE = "PAPILLA_TEST_CACHE"
"""Environment variable with the folder of a cache that several sessions share, such as quick and slow tests."""

MESH_TESTS = Path(__file__).parent / "mesh"

TOOK, LONG_S = "papilla/took_s", 0.08
"""Entry of pytest's cache with the seconds of setup and of the rest of each test, when all ran last; and the seconds
above which `--short` leaves a test out."""


@pytest.fixture(scope="session", autouse=True)
def cache_folder(tmp_path_factory):
    """The cache of this session, shared by its processes; meshes and reduced fingers are made once for all tests."""
    # The processes of pytest-xdist have folders of their own side by side in that of the session
    base = tmp_path_factory.getbasetemp()
    base = base.parent if "PYTEST_XDIST_WORKER" in os.environ else base
    folder = Path(os.environ.get(SHARED_CACHE) or base / "papilla-cache")
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PAPILLA_CACHE", str(folder))
        patch.setenv("XDG_DATA_HOME", str(folder / "data"))  # Of the secret that seals its entries
        patch.setenv("MPLBACKEND", "Agg")
        # Two processes of the tests may want the same entry: one waits, without the warning, which would be an error
        patch.setenv("PAPILLA_CACHE_PATIENCE_S", "600")
        yield folder


def pytest_addoption(parser):
    """`--short` : a first answer within a minute."""
    parser.addoption("--short", action="store_true", help=f"leave out tests that took more than {LONG_S} s last time")


def pytest_collection_modifyitems(config, items):
    """Leave out the long tests if `--short` asks for it; a test that never ran is not left out. Each test of a module
    has an equal share of the module's setup, whichever of them pays for a fixture."""
    if not config.getoption("short") or not hasattr(config, "cache"):
        return
    took, setups = config.cache.get(TOOK, {}), defaultdict(list)
    for name, (setup, _) in took.items():
        setups[name.split("::")[0]].append(setup)
    share = {module: sum(seconds) / len(seconds) for module, seconds in setups.items()}
    long = {name for name, (_, rest) in took.items() if share[name.split("::")[0]] + rest > LONG_S}
    items[:] = [item for item in items if item.nodeid not in long]


class Times:
    """Keeps the seconds of each test of this session for the next one with `--short`."""

    def __init__(self, config):
        self.config, self.took = config, defaultdict(lambda: [0.0, 0.0])

    def pytest_runtest_logreport(self, report):
        self.took[report.nodeid][report.when != "setup"] += report.duration

    def pytest_sessionfinish(self):
        if not self.config.getoption("short"):
            self.config.cache.set(TOOK, self.config.cache.get(TOOK, {}) | self.took)


def pytest_configure(config):
    """The process that collects the reports of all keeps the times, if there is pytest's cache."""
    if not hasattr(config, "workerinput") and hasattr(config, "cache"):
        config.pluginmanager.register(Times(config))


def pytest_collection_finish():
    """What collection has made stays; to visit it takes the garbage collector a quarter of a second each time."""
    gc.collect()
    gc.freeze()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item):
    """The mesher cannot be seeded: outside tests/mesh it is refused, but for tests that are marked `mesher`."""
    if MESH_TESTS in item.path.parents or item.get_closest_marker("mesher"):
        return (yield)
    from papilla.core import seams

    start = seams.start

    def without_mesher(command, **options):
        assert "tetrahedralise" not in command, "a test outside tests/mesh called the mesher"
        return start(command, **options)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(seams, "start", without_mesher)
        return (yield)


@pytest.fixture(scope="module", autouse=True)
def memory_given_back():
    """What a module's tests no longer need goes back to the machine, not only to the allocator."""
    yield
    gc.collect()
    gc.freeze()
    if sys.platform == "linux":
        ctypes.CDLL(None).malloc_trim(0)
