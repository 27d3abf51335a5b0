"""What a sample costs: microseconds of a row of a block, and of one update in a loop."""

import time
from dataclasses import dataclass
from functools import partial

import numpy as np

from papilla.estimators.tracking.compiled import numba_available
from papilla.studies.estimator_bench.competitors import Competitor
from papilla.studies.estimator_bench.scenes import scene

BLOCK, REPEATS = 500, 3


@dataclass(frozen=True)
class Cost:
    """Microseconds that a row costs.

    kernel : "NumPy" (and plain Python), or "compiled" by numba. block_us : a row of `process`, median over blocks of
    500 rows. update_us, update_p999_us : median and 99.9 % quantile of one `update`. These are of each block's or
    sample's best of three runs: what the estimator does there comes back, what the machine does by chance does not.
    loop_p999_us : the 99.9 % quantile of the first run alone, which a loop on this machine would have seen.
    """

    estimator: str
    kernel: str
    block_us: float
    update_us: float
    update_p999_us: float
    loop_p999_us: float

    @property
    def place(self) -> str:
        """Where the figures hold: on the kernel."""
        return self.kernel


def costs_of(competitor: Competitor, *, wavelength_mm: float, seed: int, seconds: float) -> list[Cost]:
    """Time a competitor on act1 at 20 dB: as NumPy, and compiled where it can be and numba is installed."""
    made = scene("act1", wavelength_mm, seed=seed, seconds=seconds, gauge_positions_mm=competitor.gauges_mm)
    block = made.block()
    if not competitor.compiles:
        return [timed(competitor.name, "NumPy", competitor.make, block)]
    # Plain kernels are slow: the first half of the rows says enough of them.
    costs = [timed(competitor.name, "NumPy", partial(competitor.make, compiled=False), block[: len(block) // 2])]
    if numba_available():
        costs.append(timed(competitor.name, "compiled", partial(competitor.make, compiled=True), block))
    return costs


def timed(name: str, kernel: str, make, block: np.ndarray) -> Cost:
    """Time new estimators that `make` gives on the rows of `block`, in blocks and one by one."""
    make().process(block[:100])
    blocks = np.array([_blocks(make(), block) for _ in range(REPEATS)]).min(axis=0)
    runs = 1e6 * np.array([_updates(make(), block.tolist()) for _ in range(REPEATS)])
    best = runs.min(axis=0)
    median, high = np.quantile(best, [0.5, 0.999])
    return Cost(
        name, kernel, 1e6 * float(np.median(blocks)), float(median), float(high), float(np.quantile(runs[0], 0.999))
    )


def _blocks(estimator, rows: np.ndarray) -> list[float]:
    """Seconds a row of each block of `BLOCK` rows."""
    spent = []
    for start in range(0, len(rows), BLOCK):
        part = rows[start : start + BLOCK]
        began = time.perf_counter()
        estimator.process(part)
        spent.append((time.perf_counter() - began) / len(part))
    return spent


def _updates(estimator, rows: list) -> list[float]:
    """Seconds of each update."""
    spent = []
    for row in rows:
        began = time.perf_counter()
        estimator.update(row)
        spent.append(time.perf_counter() - began)
    return spent
