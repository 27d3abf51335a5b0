"""The papers' telepresence experiments, simulated up to the finger of the participant: the displayed signals.

Okamoto et al. 2011, section 5: experiments 1 and 3 are direct feedback without and with a simulated delay, 2 and 4 the
local model. Okamoto et al. 2007, figure 5: two gratings side by side, and the time that each display needs to change
from one to the other. What people answered is printed; no person is simulated.
"""

import itertools
import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from papilla.core.progress import CountedStep, Progress, silent
from papilla.telepresence.amplitude import FromWavelength, Measured, PowerCurve, read_curve
from papilla.telepresence.link import LinkModel
from papilla.telepresence.local_model import LocalModel
from papilla.telepresence.loop import Set, run
from papilla.telepresence.motion import HandMotion
from papilla.telepresence.record import LoopRecord
from papilla.telepresence.touch import GratingTexture, SideBySide

TESTS_MM = (0.8, 1.0, 1.2, 1.4, 1.6, 1.8, 2.0)
LOUDEST_MICROSTRAIN, NOISE_MICROSTRAIN = 50.0, 1.0
"""Amplitude of the texture that the sensor reads best, and standard deviation of a reading."""
FEEDBACK_DELAY = LinkModel(one_way_ms=120.0, one_way_sd_ms=40.0, redraw_Hz=5.0)
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
    records: Sequence[LoopRecord]


def experiments_2011(
    seed: int = 0, *, curve: PowerCurve | None = None, seconds: float = 4.0, progress: Progress = silent
) -> Mapping[int, Condition]:
    """Simulate what the four experiments displayed, by their number.

    Parameters
    ----------
    curve : g_A, which gives both the amplitude that the sensor reads of a texture and that of the local model; the
        shipped one by default. seconds : of each exploration (20 in the paper, of which all are alike).
    """
    curve = read_curve() if curve is None else curve
    rule = FromWavelength(curve, largest_um=Measured()(math.nan, LOUDEST_MICROSTRAIN))
    records: dict[bool, list[LoopRecord]] = {False: [], True: []}
    for delayed, place in itertools.product((False, True), range(len(TESTS_MM))):
        progress(CountedStep("experiments of 2011", delayed * len(TESTS_MM) + place, 2 * len(TESTS_MM)))
        amplitude = LOUDEST_MICROSTRAIN * math.sqrt(curve(TESTS_MM[place]) / curve.greatest)
        scene = Set(
            GratingTexture(TESTS_MM[place], amplitude),
            seconds=seconds,
            downlink=FEEDBACK_DELAY if delayed else LinkModel(),
            noise_microstrain=NOISE_MICROSTRAIN,
            seed=seed + 10 * place,
        )
        records[delayed].append(run(scene, LocalModel(rule=rule)))
    numbered = enumerate(itertools.product((False, True), ("direct", "local")), start=1)
    return {number: _condition(display, delayed, records[delayed]) for number, (delayed, display) in numbered}


def _condition(display: str, delayed: bool, records: Sequence[LoopRecord]) -> Condition:
    """The output of a display for each texture."""
    felt, amplitudes = [], []
    for record in records:
        wavelengths = record.felt(display).wavelength_mm
        finite = wavelengths[np.isfinite(wavelengths)]
        felt.append(float(np.median(finite)) if finite.size else math.nan)
        displacement = record.local_um if display == "local" else record.direct_um
        amplitudes.append(math.sqrt(2) * float(displacement[record.judged].std()))
    lags = [record.lag_ms(display) for record in records]
    return Condition(display, delayed, np.array(lags), np.array(felt), np.array(amplitudes), records)


class BesideEachOther(NamedTuple):
    """Two gratings side by side: ms until each display has the one that the hand came onto within 10 %, and for how
    many ms it still had the other; the same of the local model without any delay, which is what estimating takes.
    Medians over the crossings; never : share of them after which the local model had it not until the next."""

    change_ms: dict[str, float]
    stale_ms: dict[str, float]
    without_link_ms: float
    stale_without_link_ms: float
    never: float


def beside_each_other(
    first_mm: float = 1.0,
    second_mm: float = 4.0,
    *,
    speed_mm_s: float = 87.0,
    strokes_Hz: float = 0.0,
    seconds: float = 3.5,
    round_trip_ms: float = 120.0,
    seed: int = 0,
) -> BesideEachOther:
    """The border between two gratings as in Okamoto et al. 2007, figure 5, felt through each display.

    By default it is crossed once, at a constant speed; with strokes to and fro, in the middle of each. The speed is not
    100 mm/s: at that a wavelength of 1 mm gives 100 Hz, which the estimators take for the mains.
    """
    way, motion = LinkModel(one_way_ms=round_trip_ms / 2), HandMotion(speed_mm_s, strokes_Hz)
    border = 0.5 * motion.length_mm if strokes_Hz else 1.5 * speed_mm_s
    texture = SideBySide(GratingTexture(first_mm), GratingTexture(second_mm), border)
    delayed, at_once = (run(Set(texture, motion, seconds, link, link, seed=seed)) for link in (way, LinkModel()))
    both = ("local", "direct")
    return BesideEachOther(
        {name: delayed.change_ms(name) for name in both},
        {name: delayed.stale_ms(name) for name in both},
        at_once.change_ms("local"),
        at_once.stale_ms("local"),
        float(np.isnan(delayed.crossings("local")[:, 1]).mean()),
    )
