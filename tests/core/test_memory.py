"""Memory that is left: from the kernel, from control groups, from the system's pages, or unknown; and refusals."""

import pytest

from papilla.core import memory
from papilla.core.errors import MemoryEstimateError, PapillaError

MEMINFO = "MemTotal:       24000000 kB\nMemFree:         1000000 kB\nMemAvailable:   20000000 kB\n"


@pytest.fixture
def machine(tmp_path, monkeypatch):
    """A machine of files: `machine(meminfo, cgroup, {path: text})`."""
    monkeypatch.setattr(memory, "MEMINFO", tmp_path / "meminfo")
    monkeypatch.setattr(memory, "CGROUPS_OF_SELF", tmp_path / "cgroup")
    monkeypatch.setattr(memory, "CGROUP_ROOTS", {"v1": (tmp_path / "memory",), "v2": (tmp_path / "unified",)})

    def set_up(meminfo=MEMINFO, cgroup="", files=None):
        for name, text in {"meminfo": meminfo, "cgroup": cgroup, **(files or {})}.items():
            if text is not None:
                (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
                (tmp_path / name).write_text(text)

    return set_up


def test_the_kernel_tells_what_is_available(machine):
    machine()
    assert memory.available_bytes() == 20_000_000 * 1024


def test_a_control_group_of_either_version_may_allow_less(machine):
    machine(
        cgroup="0::/job/step\n",
        files={
            "unified/job/memory.max": "5000\n",
            "unified/job/memory.current": "3000\n",
            "unified/job/memory.stat": "anon 2000\ninactive_file 700\n",
            "unified/job/step/memory.max": "max\n",
            "unified/job/step/memory.current": "3000\n",
            "unified/job/step/memory.stat": "anon 2000\n",
        },
    )
    assert memory.available_bytes() == 2700, "the parent's limit, and its cached files are given back"
    machine(
        cgroup="3:cpuset:/\n4:cpu,memory:/job\n",
        files={
            "memory/job/memory.limit_in_bytes": "9000",
            "memory/job/memory.usage_in_bytes": "9500",
            "memory/job/memory.stat": "total_inactive_file 100\n",
        },
    )
    assert memory.available_bytes() == 0, "more used than allowed leaves nothing, not less"


def test_in_a_container_the_group_is_the_root(machine):
    limits = {"memory.max": "7000", "memory.current": "1000", "memory.stat": "inactive_file 0"}
    machine(cgroup="0::/../elsewhere\n", files={f"unified/{name}": text for name, text in limits.items()})
    assert memory.available_bytes() == 6000


@pytest.mark.parametrize("meminfo", [None, "nonsense", "MemAvailable: many kB\n", "MemAvailable:\n"])
def test_elsewhere_the_system_counts_its_pages(machine, monkeypatch, meminfo):
    machine(meminfo, cgroup=None)
    pages = {"SC_AVPHYS_PAGES": 300, "SC_PHYS_PAGES": 1000, "SC_PAGE_SIZE": 16}
    monkeypatch.setattr(memory.os, "sysconf", pages.__getitem__, raising=False)
    assert memory.available_bytes() == 4800

    def without_free_pages(name):
        if name == "SC_AVPHYS_PAGES":
            raise ValueError("unrecognized configuration name")
        return pages[name]

    monkeypatch.setattr(memory.os, "sysconf", without_free_pages)
    assert memory.available_bytes() == 16000


def test_where_nothing_is_known_nothing_is_refused(machine, monkeypatch):
    machine(meminfo=None, cgroup=None)
    monkeypatch.delattr(memory.os, "sysconf", raising=False)
    assert memory.available_bytes() is None
    memory.refuse_beyond(1e30, "everything", str)


def test_a_refusal_names_both_figures_and_what_would_do(monkeypatch):
    monkeypatch.setattr(memory, "available_bytes", lambda: 19 * 2**30)
    memory.refuse_beyond(19 * 2**30, "a job that just fits", str)
    with pytest.raises(MemoryEstimateError) as refused:
        memory.refuse_beyond(31.2 * 2**30, "this job", lambda free: f"{free // 2**30} would do")
    assert str(refused.value) == "this job needs about 31 GiB of memory, 19 GiB are free: 19 would do"
    assert isinstance(refused.value, PapillaError) and isinstance(refused.value, MemoryError)


@pytest.mark.parametrize(
    "number, text", [(2**30, "1 GiB"), (1.26 * 2**30, "1.3 GiB"), (1368 * 2**30, "1368 GiB"), (2**20, "0.00098 GiB")]
)
def test_bytes_in_words(number, text):
    assert memory.in_gib(number) == text


def test_this_machine_has_memory():
    assert memory.available_bytes() is None or memory.available_bytes() > 2**20


def test_the_law_in_bytes():
    """Its terms one by one: assembly, factor, scratch and pairs of patch nodes."""
    assert memory.reduction_bytes(0, 0, 0) == 60e6
    assert memory.reduction_bytes(1000, 0, 0) == 60e6 + 25e6
    assert memory.reduction_bytes(0, 1000, 0) == pytest.approx(60e6 + 190e4 + 2300e3)
    assert memory.reduction_bytes(0, 1000, 0, parities=4) == pytest.approx(60e6 + 4 * (190e4 + 2300e3))
    assert memory.reduction_bytes(0, 0, 1000) == 60e6 + 800e6
    assert memory.finite_bytes(1000, 1000, 10) == pytest.approx(60e6 + 30e6 + 190e4 + 2300e3 + 8 * 1e4)
    assert memory.least_bytes(1000) == pytest.approx(memory.reduction_bytes(1000, 4800, 40))


@pytest.mark.parametrize("parities, job", [(1, "factorising a mesh"), (4, "factorising 4 times a mesh")])
def test_a_reduction_that_does_not_fit_names_a_size_that_does(monkeypatch, parities, job):
    memory.refuse_reduction(10**9, 10**9, 10**5, 0, 0.7)
    free = 4 * 2**30
    monkeypatch.setattr(memory, "available_bytes", lambda: free)
    cells, unknowns, columns = 300_000, 1_450_000, 1700
    with pytest.raises(MemoryEstimateError) as refused:
        memory.refuse_reduction(cells, unknowns, columns, parities, 0.2)
    start = f"{job} of 300,000 tetrahedra (1,450,000 unknowns, size_mm 0.2) needs about "
    assert str(refused.value).startswith(start)
    ratio = float(str(refused.value).partition("size_mm >= ")[2].split()[0]) / 0.2
    sizes = [(cells / r**3, unknowns / r**3, columns / r**2) for r in (ratio, 0.95 * ratio)]
    fits, not_quite = (memory.reduction_bytes(*size, parities=parities) <= free for size in sizes)
    assert fits and not not_quite


def test_a_finite_press_that_does_not_fit_is_refused_and_one_that_does_is_not(monkeypatch):
    monkeypatch.setattr(memory, "available_bytes", lambda: int(memory.finite_bytes(5000, 25_000, 100)))
    memory.refuse_finite(5000, 24_999, 100, 0.7)
    with pytest.raises(MemoryEstimateError, match="^pressing at finite strain a mesh of 5,000 tetrahedra"):
        memory.refuse_finite(5000, 25_001, 100, 0.7)


def test_where_nothing_would_do_no_size_is_named(monkeypatch):
    monkeypatch.setattr(memory, "available_bytes", lambda: 1000)
    with pytest.raises(MemoryEstimateError, match="no coarser mesh would fit, free some memory$"):
        memory.refuse_size("a job", 1.0, lambda ratio: 1e6 + 1 / ratio)
    with pytest.raises(MemoryEstimateError, match=r"mesh with size_mm >= 99 \(--size-mm of "):
        memory.refuse_size("a job", 1.0, lambda ratio: 98_000 / ratio)
