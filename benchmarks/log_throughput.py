"""Rows a second and peak memory of `papilla estimate` on one core: five gauges with a velocity at 1 kHz.

Run with `python benchmarks/log_throughput.py [--rows 200000]`. Two logs: one with a strong line, one whose line is
weak, so that it is searched for all the time. The whole command is counted, imports included; the stages are run again
alone, in processor time.
"""

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from papilla.cli.estimate_summary import Summary
from papilla.core.tables import table_writer, write_table
from papilla.estimators import Pipeline
from papilla.estimators.pipeline import PipelineEstimate
from papilla.logs import TimeLogFile

ONE_CORE = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "RAYON_NUM_THREADS": "1"}
NOISE = {"strong line": 1.0, "weak line": 12.0}
"""Of a gauge, in microstrain, under a line of 10."""


def write_log(path: Path, rows: int, noise: float) -> None:
    """A log of sliding over 1.2 mm at a changing speed."""
    rng, time_s = np.random.default_rng(1), np.arange(rows) / 1000
    velocity = 60 + 20 * np.sin(np.pi * time_s)
    phase = 2 * np.pi * (np.cumsum(velocity)[:, None] / 1000 - np.arange(5)) / 1.2
    readings = 100 + 10 * np.sin(phase) + rng.normal(0, noise, (rows, 5))
    gauges = {f"g{number + 1}": readings[:, number].round(4) for number in range(5)}
    write_table(path, {"t_s": time_s, **gauges, "velocity_mm_s": velocity.round(4)})


def stages(log: Path, out: Path) -> dict[str, float]:
    """Processor time (s) of reading, estimating and writing, and of the lines of the whole log."""
    spent: dict[str, float] = {}

    def timed(name: str, job: Callable):
        begun = time.process_time()
        found = job()
        spent[name] = spent.get(name, 0.0) + time.process_time() - begun
        return found

    with (
        timed("scan", lambda: TimeLogFile(log)) as recorded,
        table_writer(out, ("t_s", *PipelineEstimate._fields)) as write,
    ):
        pipeline = Pipeline(gauges=5, columns=recorded.optional)
        summary, blocks = Summary(recorded, pipeline), recorded.blocks()
        while (block := timed("read", lambda: next(blocks, None))) is not None:
            answer = timed("estimate", lambda block=block: pipeline.process(block))
            worst = timed("count", lambda block=block, answer=answer: summary.add(block, answer))
            timed("write", lambda block=block, answer=answer, worst=worst: write([block[:, 0], *answer[:-1], worst]))
        timed("lines", lambda: summary.finish(None))
    return spent


def main() -> None:
    """Measure both logs and print a line each."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rows", type=int, default=200_000)
    parser.add_argument("--logs", nargs="*", default=list(NOISE), choices=list(NOISE))
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        for name in chosen.logs:
            log, out = Path(folder) / "log.csv", Path(folder) / "out.csv"
            write_log(log, chosen.rows, NOISE[name])
            command = [sys.executable, "-m", "papilla", "estimate", str(log), "--out", str(out)]
            before = resource.getrusage(resource.RUSAGE_CHILDREN)
            subprocess.run(command, check=True, capture_output=True, env=os.environ | ONE_CORE)
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
            print(f"{name}: {chosen.rows / seconds:,.0f} rows/s, {after.ru_maxrss / 1024:.0f} MB, ", end="")
            print(f"output {out.stat().st_size / log.stat().st_size:.2f} of the input")
            for stage, spent in stages(log, out).items():
                print(f"  {stage:9s}{1e6 * spent / chosen.rows:8.2f} us a row")


if __name__ == "__main__":
    main()
