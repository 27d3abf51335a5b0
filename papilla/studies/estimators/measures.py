"""What an estimator's answers are judged by: error, stated sigma, lag, time to settle, cost."""

import math
import time
from typing import NamedTuple

import numpy as np

from papilla.studies.estimators.scenes import Scene

CLIP = (-1.0, 3.0)
"""Relative errors are clipped to these; a row without an answer counts as the worst."""
OUTLIER = 0.1


class Errors(NamedTuple):
    """Of one run: mean square and median of |relative error|, share beyond 10 %, mean square of error over stated sigma
    (NaN without one), over the judged rows."""

    mean_square: float
    median: float
    outliers: float
    sigma_square: float


def errors_of(scene: Scene, answer) -> Errors:
    """Compare the wavelengths of `answer` (its columns n rows) with the scene's truth."""
    rows = scene.judged()
    truth = scene.wavelength_mm[rows]
    found = np.asarray(answer.wavelength_mm)[rows]
    error = np.clip(np.where(np.isfinite(found), found / truth - 1, CLIP[1]), *CLIP)
    sigma = getattr(answer, "wavelength_sigma_mm", None)
    square = math.nan
    if sigma is not None:
        known = np.isfinite(found) & (np.asarray(sigma)[rows] > 0)
        if known.any():
            square = float(np.mean(((found - truth)[known] / np.asarray(sigma)[rows][known]) ** 2))
    absolute = np.abs(error)
    return Errors(float(np.mean(error**2)), float(np.median(absolute)), float(np.mean(absolute > OUTLIER)), square)


def lag_ms(scene: Scene, frequency_Hz, longest_ms: float = 150.0) -> float:
    """Shift in ms by which the estimated frequency follows |v| / lambda best; NaN where that does not vary."""
    truth = scene.frequency_Hz
    found = np.nan_to_num(np.asarray(frequency_Hz, float), posinf=0.0, neginf=0.0)
    start, most = np.searchsorted(scene.time_s, 1.0), round(longest_ms * scene.sample_rate_Hz / 1000)
    if np.ptp(truth[start:]) < 1e-6 * truth.max() or np.ptp(found[start:]) == 0 or start <= most:
        return math.nan
    later = found[start:]
    scores = [np.corrcoef(truth[start - shift : truth.size - shift], later)[0, 1] for shift in range(most + 1)]
    return 1000 * int(np.argmax(scores)) / scene.sample_rate_Hz


def settling_ms(scene: Scene, wavelength_mm, at_s: float, within: float = 0.05) -> float:
    """Time in ms after a step at `at_s` from which the wavelength stays within a fraction of the truth; inf for
    never."""
    start = int(np.searchsorted(scene.time_s, at_s))
    error = np.abs(np.asarray(wavelength_mm)[start:] / scene.wavelength_mm[start:] - 1)
    bad = np.flatnonzero(~(error <= within))
    if bad.size and bad[-1] == error.size - 1:
        return math.inf
    return 1000 * (float(bad[-1]) + 1 if bad.size else 0.0) / scene.sample_rate_Hz


class Cost(NamedTuple):
    """Microseconds of one row of `process`; median and 99.9 % quantile of one `update`."""

    block_us: float
    update_us: float
    update_p999_us: float


def cost_of(make, scene: Scene) -> Cost:
    """Time a new estimator on the rows of a scene, block by block and sample by sample."""
    block = scene.block()
    make().process(block[:100])
    estimator = make()
    start = time.perf_counter()
    estimator.process(block)
    per_row = (time.perf_counter() - start) / len(block)
    estimator, spent = make(), []
    for row in block.tolist():
        start = time.perf_counter()
        estimator.update(row)
        spent.append(time.perf_counter() - start)
    return Cost(1e6 * per_row, 1e6 * float(np.median(spent)), 1e6 * float(np.quantile(spent, 0.999)))
