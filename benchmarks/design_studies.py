"""What a study costs: `python benchmarks/design_studies.py [--designs 400] [--check 4]`.

Efficiency with one and two workers, milliseconds a design, bytes moved and stored, writes a second, memory of a worker.
With --check N also the expected sigma of N random pairs of moduli against full calibrations (minutes each).
"""

import argparse
import pickle
import sqlite3
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from papilla.core.progress import CountedStep
from papilla.design.batch import Batch, evaluate, version
from papilla.design.confirming import confirm
from papilla.design.running import run
from papilla.design.store import Store
from papilla.design.study import read_study

STUDY = """
name = "scaling"
objectives = ["sigma_gauges", "sigma_sd", "signal_over_noise"]
[free]
"outer.modulus_MPa" = [0.2, 1.2]
"gauges.lever_mm" = [-1.0, 0.0]
[couplings]
"inner.modulus_MPa" = "outer.modulus_MPa / 4"
"""


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--designs", type=int, default=400)
    parser.add_argument("--check", type=int, default=0)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "study.toml"
        path.write_text(STUDY)
        study = read_study(path)
        study = replace(study, sampler=replace(study.sampler, designs=asked.designs))
        moved(study)
        rates = {workers: rate(study, Path(folder), workers) for workers in (1, 2)}
        print(f"efficiency of two workers: {rates[2] / rates[1] / 2:.2f}")
        if asked.check:
            against_calibrations(study, asked.check)


def moved(study) -> None:
    """Bytes of a batch on its way there and back, and a design in this process."""
    fingers = tuple(study.finger_of({"outer.modulus_MPa": 0.3 + 0.01 * k, "gauges.lever_mm": 0.0}) for k in range(50))
    batch = Batch(fingers, study.finger, study.places, study.scene, study.asked, version())
    evaluate(batch)
    began = time.perf_counter()
    done = evaluate(batch)
    took = time.perf_counter() - began
    there, back = (len(pickle.dumps(one)) / 50 for one in (batch, done))
    print(f"a design in this process: {1000 * took / 50:.1f} ms; bytes a design: {there:.0f} there, {back:.0f} back")


def rate(study, folder: Path, workers: int) -> float:
    """Designs a second with so many workers, from a cache that has the geometry."""
    path = folder / f"store_{workers}.sqlite"
    store = Store(path)
    ends: list[tuple[float, int]] = []

    def ended(step: str) -> None:
        if isinstance(step, CountedStep):
            ends.append((time.perf_counter(), step.done))

    tally = run(study, store, workers=workers, progress=ended)
    store.close()
    # From the first batch on: processes have begun then
    found = (ends[-1][1] - ends[0][1]) / (ends[-1][0] - ends[0][0])
    with sqlite3.connect(path) as connection:
        connection.execute("VACUUM")
    size = path.stat().st_size / tally.designs
    print(
        f"{workers} workers: {found:.1f} designs/s after the first batch ({tally.seconds:.1f} s in all), "
        f"{store.writes} writes, {size:.0f} bytes a design in the store, largest worker {tally.memory_MB:.0f} MB"
    )
    began = time.perf_counter()
    rows = list(Store(path).rows(study))
    again = Store(folder / f"copy_{workers}.sqlite")
    for start in range(0, len(rows), 50):
        again.add("copy", [(n, free, str(n), record) for n, free, record in rows[start : start + 50]])
    took = time.perf_counter() - began
    print(f"the store alone: {again.writes / took:.0f} batches a second, {len(rows) / took:.0f} designs a second")
    return found


def against_calibrations(study, count: int) -> None:
    """Expected sigma against full calibrations, on random moduli of the default geometry."""
    draw = np.random.default_rng(7)
    off: dict[str, list[float]] = {}
    for number in range(count):
        values = {"outer.modulus_MPa": float(0.15 * 8 ** draw.random()), "gauges.lever_mm": -float(draw.random())}
        found = confirm(f"design {number}", study.in_scene(study.finger_of(values)), 1, lambda line: None)
        print(found.sentence, flush=True)
        for channel in found.predicted:
            ratio = found.predicted[channel] / found.calibrated[channel]
            off.setdefault(channel, []).extend(np.abs(ratio - 1).ravel().tolist())
    for channel, values in off.items():
        share = np.mean(np.array(values) <= 0.1)
        print(f"{channel}: median {100 * np.median(values):.1f} %, {100 * share:.0f} % of points within 10 %")


if __name__ == "__main__":
    main()
