"""Memory that is left: from the kernel, from control groups, from the system's pages, or unknown; and refusals."""

import pytest

from papilla import memory
from papilla.errors import MemoryEstimateError, PapillaError

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
