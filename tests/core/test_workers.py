"""Functions in other processes: what they give, raise and say."""

import os
import signal
import sys
import time
from concurrent.futures import BrokenExecutor

import pytest
from killed_client import worker_ends_with

from papilla.core import seams
from papilla.core.errors import WorkerKilledError
from papilla.core.progress import CountedStep, counted
from papilla.core.workers import MOST_TRIES, Processes, one_thread_each, run_program, workers


def doubled(number, say):
    say(f"doubling {number}")
    return 2 * number, os.getpid()


def refused(number, say):
    raise ValueError(f"{number} is refused")


@pytest.mark.parametrize("processes", [1, 2])
def test_results_lines_and_errors_come_back(processes, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", os.path.dirname(__file__))
    said = []
    with workers(processes, said.append) as start:
        begun = [start(doubled, number) for number in (3, 4)]
        error = start(refused, 5)
        found = [one() for one in begun]
        with pytest.raises(ValueError, match="5 is refused"):
            error()
    assert [number for number, _ in found] == [6, 8]
    assert sorted(said) == ["doubling 3", "doubling 4"]
    assert all((process == os.getpid()) == (processes == 1) for _, process in found)


def test_nothing_is_done_here_before_its_result_is_asked_for():
    said = []
    with workers(1, said.append) as start:
        later = start(doubled, 3)
        assert said == []
        assert later()[0] == 6


def test_counts_say_what_is_left_until_nothing_is():
    said = []
    step = counted(said.append, "press")
    step(CountedStep("press 1", 1, 2))
    step(CountedStep("press 2", 2, 2))
    assert said[0].startswith("press: 1 of 2, about ") and said[1] == "press: 2 of 2"


CLIENT = """
import os, sys, time
from papilla.core.workers import workers

def name(say):
    return os.getpid()

if __name__ == "__main__":
    with workers(2) as start:
        print(start(name)(), flush=True)
        time.sleep(600)
"""


def killed_at_first(marker, times):
    """Ends as the system ends a process when memory runs out, the first times."""
    with open(marker, "a+") as file:
        file.write("x")
        file.seek(0)
        began = len(file.read())
    if began <= times:
        os.kill(os.getpid(), signal.SIGKILL)
    return began


@pytest.mark.parametrize("fresh", [False, True])
def test_a_killed_process_is_replaced_and_its_job_begins_again(tmp_path, monkeypatch, fresh):
    monkeypatch.setenv("PYTHONPATH", os.path.dirname(__file__))
    with one_thread_each(), Processes(2, fresh=fresh) as pool:
        killed = pool.submit(killed_at_first, tmp_path / "a", 2)
        others = [pool.submit(divmod, number, 2) for number in range(6)]
        assert killed.result() == 3 and [one.result() for one in others] == [divmod(number, 2) for number in range(6)]
        hopeless = pool.submit(killed_at_first, tmp_path / "b", 99)
        with pytest.raises(WorkerKilledError, match=f"killed {MOST_TRIES} times"):
            hopeless.result()
        assert (tmp_path / "b").read_text() == "x" * MOST_TRIES
        assert pool.submit(divmod, 7, 2).result() == (3, 1)


def test_a_stopped_pool_waits_for_no_job(tmp_path):
    with one_thread_each(), Processes(1) as pool:
        pool.submit(divmod, 7, 2).result()
        long = pool.submit(time.sleep, 600)
        pool.kill()
        with pytest.raises(BrokenExecutor):
            long.result()


def test_workers_end_with_a_program_that_is_killed(tmp_path):
    program = tmp_path / "client.py"
    program.write_text(CLIENT)
    assert worker_ends_with(program)


def test_a_program_ends_with_its_code_or_at_its_time():
    assert [run_program([sys.executable, "-c", f"raise SystemExit({code})"], 60) for code in (0, 3)] == [0, 3]
    beats = []
    assert run_program([sys.executable, "-c", "import time; time.sleep(600)"], 0.7, beats.append) is None
    assert len(beats) == 2 and beats == sorted(beats) and 0.7 < beats[-1] < 60


@pytest.mark.parametrize("done", [0, 1, 3])
def test_what_is_left_takes_as_long_a_step_as_what_is_done(monkeypatch, done):
    clock, lines = [10**9], []
    monkeypatch.setattr(seams, "now_ns", lambda: clock[0])
    step = counted(lines.append, "press")
    clock[0] += 6 * 10**9
    step(CountedStep("press", done, 5))
    assert lines == [f"press: {done} of 5, about {6 * (5 - done) / max(done, 1):.0f} s left"]
    assert (lines[0].done, lines[0].total) == (done, 5)


def test_threads_of_new_processes_are_counted_in_a_block_alone(monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "3")
    monkeypatch.delenv("MKL_NUM_THREADS", raising=False)
    with one_thread_each():
        assert [os.environ[name] for name in ("OMP_NUM_THREADS", "MKL_NUM_THREADS")] == ["1", "1"]
    assert os.environ["OMP_NUM_THREADS"] == "3" and "MKL_NUM_THREADS" not in os.environ
