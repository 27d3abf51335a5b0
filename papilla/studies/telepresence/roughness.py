"""The four experiments of Okamoto et al. 2011, section 5, up to the finger of the participant: the displayed signals.

Experiments 1 and 3 are direct feedback without and with a simulated delay, 2 and 4 the local model. What people
answered is printed; no person is simulated.
"""

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from papilla.telepresence.amplitude import FromWavelength, Measured, PowerCurve, read_curve
from papilla.telepresence.link import LinkModel
from papilla.telepresence.local_model import LocalModel
from papilla.telepresence.loop import Set, run
from papilla.telepresence.record import Record
from papilla.telepresence.touch import GratingTexture

TESTS_MM = (0.8, 1.0, 1.2, 1.4, 1.6, 1.8, 2.0)
LOUDEST_MICROSTRAIN, NOISE_MICROSTRAIN = 50.0, 1.0
"""Amplitude of the texture that the sensor reads best, and standard deviation of a reading."""
DELAY = LinkModel(one_way_ms=120.0, one_way_sd_ms=40.0, redraw_Hz=5.0)
"""N(120, 40) ms drawn every 200 ms, all of it on the feedback: section 5.2."""
NOTICED_MS = 60.0
"""Delay above which users notice it, which section 1 cites from an earlier study."""


class Condition(NamedTuple):
    """One of the four experiments, for each texture (m,): lag_ms of the display; felt_mm, the wavelength that it has
    for the hand's own motion; amplitude_um of its displacement (root 2 times its standard deviation); and the records.
    """

    display: str
    delayed: bool
    lag_ms: np.ndarray
    felt_mm: np.ndarray
    amplitude_um: np.ndarray
    records: Sequence[Record]


def experiments_2011(
    seed: int = 0,
    *,
    curve: PowerCurve | None = None,
    seconds: float = 4.0,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> Mapping[int, Condition]:
    """Simulate what the four experiments displayed, by their number.

    Parameters
    ----------
    curve : g_A, which gives both the amplitude that the sensor reads of a texture and that of the local model; the
        shipped one by default. seconds : of each exploration (20 in the paper, of which all are alike).
    """
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
    return {number: _condition(display, delayed, records[delayed]) for number, (delayed, display) in numbered}


def _condition(display: str, delayed: bool, records: Sequence[Record]) -> Condition:
    """The output of a display for each texture."""
    felt, amplitudes = [], []
    for record in records:
        wavelengths = record.felt(display).wavelength_mm
        known = wavelengths[np.isfinite(wavelengths)]
        felt.append(float(np.median(known)) if known.size else math.nan)
        shown = record.local_um if display == "local" else record.direct_um
        amplitudes.append(math.sqrt(2) * float(shown[record.judged].std()))
    lags = [record.lag_ms(display) for record in records]
    return Condition(display, delayed, np.array(lags), np.array(felt), np.array(amplitudes), records)
