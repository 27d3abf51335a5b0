"""The four experiments of Okamoto et al. 2011, section 5: textures felt through the system, and their match answered.

Experiments 1 and 3 are direct feedback without and with a simulated delay, 2 and 4 the local model. Observers stand for
the participants, so only what the paper judges is judged: whether the errors of two conditions differ (Welch's t-test),
and whether the delay is noticed; beside it stands what eight observers could have seen.
"""

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq
from scipy.stats import nct, t, ttest_ind

from papilla.studies.telepresence.observers import NOTICED_MS, Observer
from papilla.telepresence.amplitude import FromWavelength, Measured, PowerCurve, read_curve
from papilla.telepresence.link import LinkModel
from papilla.telepresence.local_model import LocalModel
from papilla.telepresence.loop import Set, run
from papilla.telepresence.record import Record
from papilla.telepresence.texture import GratingTexture

TESTS_MM = (0.8, 1.0, 1.2, 1.4, 1.6, 1.8, 2.0)
SCALES_MM = (0.4, 2.6)
"""Shortest and longest of the comparison scales; answers between two of them were allowed, to 0.05 mm."""
OBSERVERS, COUNTED = 8, 2
LOUDEST_MICROSTRAIN, NOISE_MICROSTRAIN = 50.0, 1.0
"""Amplitude of the texture that the sensor reads best, and standard deviation of a reading."""
THRESHOLD_SD = 0.2
"""Of the ln threshold of delay among observers (assumed)."""
DELAY = LinkModel(one_way_ms=120.0, one_way_sd_ms=40.0, redraw_Hz=5.0)
"""N(120, 40) ms drawn every 200 ms, all of it on the feedback: section 5.2."""


class Condition(NamedTuple):
    """One of the four experiments, for each texture (m,): lag_ms of the display; felt_mm, the wavelength that it has
    for the hand's own motion; by_intensity_mm, the wavelength whose bare intensity would be as great.

    answers_mm : (observers, m, trials); noticed : how many observers notice the delay.
    """

    display: str
    delayed: bool
    lag_ms: np.ndarray
    felt_mm: np.ndarray
    by_intensity_mm: np.ndarray
    answers_mm: np.ndarray
    noticed: int

    @property
    def errors_mm(self) -> np.ndarray:
        """(observers, m, trials) of |answered - explored|."""
        return _errors(self.answers_mm)

    @property
    def means_mm(self) -> np.ndarray:
        """(m,) mean answers."""
        return self.answers_mm.mean(axis=(0, 2))


@dataclass(frozen=True, eq=False)
class Experiments:
    """The four conditions by number, and what tells them apart."""

    conditions: dict[int, Condition]
    observer: Observer

    def welch(self, one: int, other: int) -> tuple[float, float]:
        """(t, p) of the mean errors of two conditions."""
        found = ttest_ind(*(self.conditions[n].errors_mm.ravel() for n in (one, other)), equal_var=False)
        return float(found.statistic), float(found.pvalue)

    def significant(self, one: int, other: int, repeats: int = 200, seed: int = 1) -> float:
        """Share of experiments with other observers of the same noise in which these two differ (p < 0.05)."""
        rng = np.random.default_rng(seed)
        both = [self.conditions[n] for n in (one, other)]
        groups = [
            [
                _errors(_answers(own.felt_mm, own.by_intensity_mm, own.lag_ms, self.observer, rng)).ravel()
                for own in both
            ]
            for _ in range(repeats)
        ]
        return float(np.mean([ttest_ind(*pair, equal_var=False).pvalue < 0.05 for pair in groups]))

    def detectable_mm(self, one: int, other: int, power: float = 0.8, level: float = 0.05) -> float:
        """The smallest difference of mean errors that 8 x 14 answers find with this power (noncentral t), by the
        spread of the answers here."""
        groups = [self.conditions[n].errors_mm.ravel() for n in (one, other)]
        parts = [group.var(ddof=1) / group.size for group in groups]
        freedom = sum(parts) ** 2 / sum(part**2 / (group.size - 1) for part, group in zip(parts, groups, strict=True))
        limit = t.ppf(1 - level / 2, freedom)
        shift = brentq(lambda delta: nct.sf(limit, freedom, delta) - power, 0.0, 20.0)
        return float(shift * math.sqrt(sum(parts)))


def experiments_2011(
    seed: int = 0,
    *,
    observer: Observer | None = None,
    curve: PowerCurve | None = None,
    seconds: float = 4.0,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> Experiments:
    """Simulate the four experiments.

    Parameters
    ----------
    observer : its noise. curve : g_A, which gives both the amplitude that the sensor reads of a texture and that of
        the local model; the shipped one by default.
    seconds : of each exploration that is simulated (20 in the paper, of which all are alike).
    """
    observer, rng = Observer() if observer is None else observer, np.random.default_rng(seed)
    curve = read_curve() if curve is None else curve
    rule = FromWavelength(curve, largest_um=Measured()(math.nan, LOUDEST_MICROSTRAIN))
    records: dict[bool, list[Record]] = {False: [], True: []}
    for delayed, place in itertools.product((False, True), range(len(TESTS_MM))):
        progress(delayed * len(TESTS_MM) + place, 2 * len(TESTS_MM))
        amplitude = LOUDEST_MICROSTRAIN * math.sqrt(curve(TESTS_MM[place]) / curve.greatest)
        scene = Set(
            GratingTexture(TESTS_MM[place], amplitude),
            seconds=seconds,
            downlink=DELAY if delayed else LinkModel(),
            noise_microstrain=NOISE_MICROSTRAIN,
            seed=seed + 10 * place,
        )
        records[delayed].append(run(scene, LocalModel(rule=rule)))
    numbered = enumerate(itertools.product((False, True), ("direct", "local")), start=1)
    conditions = {
        n: _condition(display, delayed, records[delayed], observer, rng) for n, (delayed, display) in numbered
    }
    return Experiments(conditions, observer)


def _condition(display: str, delayed: bool, records: list[Record], observer: Observer, rng) -> Condition:
    """What is displayed in one experiment, and what eight observers answer to it, twice each."""
    lags = np.array([record.lag_ms(display) for record in records])
    felt = np.array([_typical(record.felt(display).wavelength_mm) for record in records])
    loud = np.array([_loudness(record, display) for record in records])
    # The gain was tuned until textures felt as with bare fingers, where roughness grows with the wavelength: an
    # intensity stands for the wavelength whose bare intensity, taken as proportional, is the same on the whole.
    by_intensity = loud * math.exp(float(np.mean(np.log(np.array(TESTS_MM) / loud))))
    answers = _answers(felt, by_intensity, lags, observer, rng)
    thresholds = NOTICED_MS * np.exp(THRESHOLD_SD * rng.standard_normal(OBSERVERS))
    noticed = int((np.median(lags) > thresholds).sum())
    return Condition(display, delayed, lags, felt, by_intensity, answers, noticed)


def _answers(felt, by_intensity, lags, observer: Observer, rng) -> np.ndarray:
    """(observers, m, trials) in mm, to 0.05 mm between the shortest and the longest comparison scale."""
    answers = np.empty((OBSERVERS, len(TESTS_MM), COUNTED))
    for place, lag in enumerate(lags):
        temporal, intensity = (np.full((OBSERVERS, COUNTED), own[place]) for own in (felt, by_intensity))
        answers[:, place] = observer.answer(temporal, intensity, lag, rng)
    return np.clip(np.round(answers / 0.05) * 0.05, *SCALES_MM)


def _errors(answers: np.ndarray) -> np.ndarray:
    return np.abs(answers - np.array(TESTS_MM)[:, None])


def _typical(wavelengths: np.ndarray) -> float:
    known = wavelengths[np.isfinite(wavelengths)]
    return float(np.exp(np.median(np.log(known)))) if known.size else math.nan


def _loudness(record: Record, display: str) -> float:
    shown = record.local_um if display == "local" else record.direct_um
    return float(shown[record.judged].std())
