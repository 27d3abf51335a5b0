"""Memory that is left: from the kernel, from control groups, from the system's pages, or unknown; and refusals."""

import numpy as np
import pytest

from papilla.core import memory, seams
from papilla.core.errors import MemoryEstimateError
from papilla.core.free_memory import free_bytes
from papilla.logs.parquet import ParquetReader

MEMINFO = "MemTotal:       24000000 kB\nMemFree:         1000000 kB\nMemAvailable:   20000000 kB\n"


@pytest.fixture
def machine(tmp_path):
    """A machine of files: `machine(meminfo, cgroup, {path: text})` gives its root."""

    def set_up(meminfo=MEMINFO, cgroup="", files=None):
        for name, text in {"proc/meminfo": meminfo, "proc/self/cgroup": cgroup, **(files or {})}.items():
            if text is not None:
                (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
                (tmp_path / name).write_text(text)
        return tmp_path

    return set_up


@pytest.fixture
def free(monkeypatch):
    """`free(bytes)` : so much memory is left."""
    return lambda number: monkeypatch.setattr(seams, "free_bytes", lambda: number)


def test_the_kernel_tells_what_is_available(machine):
    assert free_bytes(machine()) == 20_000_000 * 1024
    assert seams.free_bytes() is None or seams.free_bytes() > 2**20


def limits(folder, names, allowed, used, cached):
    """The files of a control group."""
    texts = (f"{allowed}\n", f"{used}\n", f"anon 2000\n{names[2]} {cached}\n")
    return {
        f"sys/fs/cgroup/{folder}/{name}": text for name, text in zip((*names[:2], "memory.stat"), texts, strict=True)
    }


V1 = ("memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file")
V2 = ("memory.max", "memory.current", "inactive_file")


@pytest.mark.parametrize(
    "cgroup, files, left",
    [
        # The parent's limit counts, and its cached files are given back
        ("0::/job/step\n", limits("job", V2, 5000, 3000, 700) | limits("job/step", V2, "max", 3000, 0), 2700),
        ("0::/job/step\n", limits("unified/job/step", V2, 5000, 3000, 700), 2700),
        # More used than allowed leaves nothing, not less
        ("3:cpuset:/\n4:cpu,memory:/job\n", limits("memory/job", V1, 9000, 9500, 100), 0),
        # In a container the group is the root
        ("0::/../elsewhere\n", limits(".", V2, 7000, 1000, 0), 6000),
        ("0::/\n", limits(".", V2, 10**15, 1000, 0), 20_000_000 * 1024),
        ("0::/\n", limits(".", V2, "nonsense", 1000, 0), 20_000_000 * 1024),
    ],
)
def test_a_control_group_of_either_version_may_allow_less(machine, cgroup, files, left):
    assert free_bytes(machine(cgroup=cgroup, files=files)) == left


@pytest.mark.parametrize("meminfo", [None, "nonsense", "MemAvailable: many kB\n", "MemAvailable:\n"])
def test_elsewhere_the_system_counts_its_pages(machine, meminfo):
    counts = {"SC_AVPHYS_PAGES": 300, "SC_PHYS_PAGES": 1000, "SC_PAGE_SIZE": 16}

    def without_free_pages(name):
        if name == "SC_AVPHYS_PAGES":
            raise ValueError("unrecognized configuration name")
        return counts[name]

    root = machine(meminfo, cgroup=None)
    assert free_bytes(root, counts.__getitem__) == 4800
    assert free_bytes(root, without_free_pages) == 16000
    assert free_bytes(root, lambda name: -1 if "PAGES" in name else 16) is None
    assert free_bytes(root, None) is None


def test_where_nothing_is_known_nothing_is_refused(free):
    free(None)
    memory.refuse_beyond(1e30, "everything", str)


def test_a_refusal_names_both_figures_and_what_would_do(free):
    free(19 * 2**30)
    memory.refuse_beyond(19 * 2**30, "a job that just fits", str)
    with pytest.raises(MemoryEstimateError) as refused:
        memory.refuse_beyond(31.2 * 2**30, "this job", lambda free: f"{free // 2**30} would do")
    assert str(refused.value) == "this job needs about 31 GiB of memory, 19 GiB are free: 19 would do"
    assert isinstance(refused.value, MemoryError)


@pytest.mark.parametrize(
    "number, text",
    [(2**30, "1 GiB"), (1.26 * 2**30, "1.3 GiB"), (1368 * 2**30, "1368 GiB"), (2**20, "0.00098 GiB"),
     (99.4 * 2**30, "99 GiB"), (105 * 2**30, "105 GiB")],
)  # fmt: skip
def test_bytes_in_words(number, text):
    assert memory.in_gib(number) == text


@pytest.mark.parametrize("seed", range(4))
def test_the_law_grows_with_each_of_its_sizes(seed):
    """Each term alone has the power that the theory gives it: cells 1, fill 4/3, pairs of patch nodes 2."""
    scale = np.random.default_rng(seed).uniform(2, 9)
    none = memory.reduction_bytes(0, 0, 0)

    def growth(law, *sizes):
        return (law(*(scale * size for size in sizes)) - none) / (law(*sizes) - none)

    assert growth(memory.reduction_bytes, 1e5, 0, 0) == pytest.approx(scale)
    assert growth(memory.reduction_bytes, 0, 1e12, 0) == pytest.approx(scale ** (4 / 3), rel=2e-3)
    assert growth(memory.reduction_bytes, 0, 0, 1e4) == pytest.approx(scale**2)
    one, four = (memory.reduction_bytes(0, 1e6, 0, parities=count) - none for count in (1, 4))
    assert four == pytest.approx(4 * one)
    stored = [memory.finite_bytes(0, 1e6, columns) for columns in (0, 100, 100 * scale)]
    assert stored[1] - stored[0] == pytest.approx(8 * 1e8) and (stored[2] - stored[0]) == pytest.approx(8e8 * scale)
    assert memory.finite_bytes(1e6, 0, 0) > memory.reduction_bytes(1e6, 0, 0) > memory.least_bytes(0) == none
    assert memory.least_bytes(1e5) == pytest.approx(memory.reduction_bytes(1e5, 4.8e5, 0.4 * 1e5 ** (2 / 3)))


def test_a_press_on_the_default_mesh_needs_what_was_measured():
    """The row of 7425 tetrahedra of the module's table: 0.62 GB, which the formula meets within its spread."""
    assert 1 / memory.MEASURED_MEMORY_RATIO < memory.least_bytes(7425) / 0.62e9 < memory.MEASURED_MEMORY_RATIO


@pytest.mark.parametrize("parities, job", [(1, "factorising a mesh"), (4, "factorising 4 times a mesh")])
def test_a_reduction_that_does_not_fit_names_a_size_that_does(free, parities, job):
    bytes_left = 4 * 2**30
    free(bytes_left)
    memory.refuse_reduction(10**9, 10**9, 10**5, 0, 0.7)
    cells, unknowns, columns = 300_000, 1_450_000, 1700
    with pytest.raises(MemoryEstimateError) as refused:
        memory.refuse_reduction(cells, unknowns, columns, parities, 0.2)
    start = f"{job} of 300,000 tetrahedra (1,450,000 unknowns, size_mm 0.2) needs about "
    assert str(refused.value).startswith(start)
    ratio = float(str(refused.value).partition("size_mm >= ")[2].split()[0]) / 0.2
    sizes = [(cells / r**3, unknowns / r**3, columns / r**2) for r in (ratio, 0.95 * ratio)]
    fits, not_quite = (memory.reduction_bytes(*size, parities=parities) <= bytes_left for size in sizes)
    assert fits and not not_quite


def test_a_finite_press_that_does_not_fit_is_refused_and_one_that_does_is_not(free):
    free(int(memory.finite_bytes(5000, 25_000, 100)))
    memory.refuse_finite(5000, 24_999, 100, 0.7)
    with pytest.raises(MemoryEstimateError, match="^pressing at finite strain a mesh of 5,000 tetrahedra"):
        memory.refuse_finite(5000, 25_001, 100, 0.7)


def test_where_nothing_would_do_no_size_is_named(free):
    free(1000)
    with pytest.raises(MemoryEstimateError, match="no coarser mesh would fit, free some memory$"):
        memory.refuse_size("a job", 1.0, lambda ratio: 1e6 + 1 / ratio)
    with pytest.raises(MemoryEstimateError, match=r"mesh with size_mm >= 1e\+02 \(--size-mm of "):
        memory.refuse_size("a job", 1.0, lambda ratio: 99_900 / ratio)
    with pytest.raises(MemoryEstimateError, match="no coarser mesh"):
        memory.refuse_size("a job", 1.0, lambda ratio: 100_100 / ratio)


@pytest.mark.parametrize("seed", range(12))
def test_the_size_that_is_named_is_the_least_that_fits_rounded_up_to_two_digits(free, seed):
    """Among sizes that grow by 1.2 %, up to 100 times."""
    rng = np.random.default_rng(seed)
    size_mm, factor = 10 ** rng.uniform(-2, 1), 10 ** rng.uniform(0.1, 1.9)
    free(1000)
    with pytest.raises(MemoryEstimateError) as refused:
        memory.refuse_size("a job", size_mm, lambda ratio: 1000 * (factor / ratio) ** 3)
    named = float(str(refused.value).partition("size_mm >= ")[2].split()[0])
    least = size_mm * 10 ** (np.ceil(200 * np.log10(factor)) / 200)
    digit = 10.0 ** (np.floor(np.log10(least)) - 1)
    assert least * (1 - 1e-9) <= named < least + digit * (1 + 1e-9)


def test_rows_that_do_not_fit_are_refused(free, tmp_path):
    """40 bytes a number: of all rows, and of the wanted columns alone."""
    pyarrow, parquet = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    parquet.write_table(pyarrow.table({name: np.arange(1000.0) for name in "abc"}), tmp_path / "t.parquet")
    for names, needed in (("abc", 120_000), ("b", 40_000)):
        reader = ParquetReader(tmp_path / "t.parquet", lambda name, names=names: name in names)
        free(needed)
        assert len(reader.whole()) == 1000 and reader.ignored == tuple(name for name in "abc" if name not in names)
        free(needed - 1)
        with pytest.raises(MemoryEstimateError, match=rf"1000 rows, {len(names)} columns.*name fewer columns"):
            reader.whole()
