"""Finds the frequency without a velocity: lines in spectra of warped time, and fits that start from the best of them.

A chirp of relative rate a warps time: in tau = t + a t^2 / 2 every frequency and its harmonics are constant. So a line
that the swinging finger smears becomes sharp for the right a. Gauss-Newton steps (`tracking.motion_fit`) fit motion and
profile from the best lines of seven spectra, then from multiples of the best fit's frequency, because a wrong multiple
is found more easily than the right one. The fit with the lowest cost wins: Schwarz's criterion with a bonus for high
frequencies, because a fit of half the frequency explains every reading as well,

  cost = n ln(noise) + 2 (harmonics) ln(n) - OCTAVE_BONUS_NATS log2(frequency).

A search has some 130 pieces of a tenth of a millisecond.
"""

import math
from typing import NamedTuple

import numpy as np

from papilla.core.units import TINY_DIVISOR
from papilla.estimators.stream import Pieces, completed
from papilla.estimators.wavelength import motion_fit
from papilla.estimators.wavelength.fundamental import (
    CONFIRMED_CHANCE,
    FAINTEST_HARMONIC,
    HARMONIC_SLACK_RESOLUTIONS,
    MOST_SUBHARMONICS,
    fundamental_of,
    hints,
)
from papilla.estimators.wavelength.motion_fit import MOTION_KNOTS, SHAPE_PARAMETERS, TREND_PARAMETERS, MotionFit
from papilla.estimators.wavelength.spectrum import (
    CYCLE_EXPONENT,
    highest_shown,
    longest_strokes,
    middle,
    size_of,
    spectrum_of,
    strokes_of,
)

RELATIVE_CHIRP_RATES = (0.0, *(sign * rate for rate in (2.0, 5.0, 9.0) for sign in (1, -1)))
"""Relative chirp rates in 1/s in the middle of the window: those of a 1 Hz stroke during 83 % of its time."""
SPECTRUM_NOMINEES, FREQUENCY_MULTIPLES = 4, (2, 3, 1 / 2, 1 / 3)
"""Number of peaks of the spectra from which a fit starts, and the multiples of the best fit's frequency that are tried
next."""
FITTED_WINDOW_PARTS = 0.5, 0.5, 0.75, *[math.inf] * 3
"""Part of the window, about its middle, to which each step of a candidate is fitted."""
OCTAVE_BONUS_NATS = 15.0
"""Bonus in the cost (nats) for each octave of the frequency: a fit of half the frequency can explain every reading as
well."""
WHITE_NOISE_LIMITS = 0.6, 1.5
"""Limits of the ratio of the readings' variance to that of white noise with the same third differences. Between them
nothing moves (four standard deviations of noise in 133 readings), and there is no search, which is the most expensive
part."""
HELD_PRIOR_SIGMA = 1e-3
"""Prior standard deviation of what a search holds at 0."""
FEWEST_TESTED_PERIODS = 4.0
"""Smallest number of periods in the longest stroke for a test for a harmonic."""
SMALLEST_STEP_CYCLES, MOST_TESTED_LINES = 1 / 16, 10
"""Smallest step, in cycles, of the grid of this test; it divides a cycle, so that aliases fall on harmonics; and the
largest number of lines that are tested."""


class FrequencySearch(NamedTuple):
    """A search in readings (n,) at times (n,) about 0: low, high : frequencies in Hz; rate_Hz : of the samples."""

    readings: np.ndarray
    time: np.ndarray
    low: float
    high: float
    rate_Hz: float

    def moves(self) -> bool:
        """Whether the readings hold more than drift and white noise, whose variance follows from their differences."""
        seen = np.flatnonzero(np.isfinite(self.readings))
        if len(seen) < motion_fit.FEWEST_READINGS:
            return False
        basis = np.vander(self.time / self.time[-1], 3)[seen]
        values = self.readings[seen] - self.readings[seen].mean()
        residual = values - basis @ np.linalg.lstsq(basis, values, rcond=None)[0]
        # Third differences of white noise of variance s^2 have the variance 20 s^2 and remove slow movements.
        noise = np.diff(residual, 3)
        ratio = float(residual @ residual) / max(float(noise @ noise) / 20, TINY_DIVISOR)
        return not WHITE_NOISE_LIMITS[0] < ratio < WHITE_NOISE_LIMITS[1]

    def run(self) -> Pieces[tuple[MotionFit | None, float]]:
        """The best fit, with its motion at time 0, or None if no fit is significant; and its cost."""
        places: list[tuple[float, np.ndarray]] = []
        for chirp in RELATIVE_CHIRP_RATES:
            places += yield from self._spectrum(chirp)
        best, price, trials = None, math.inf, nominated(places)
        while trials:
            before = price
            for motion in trials:
                yield
                fit, cost = yield from self._fitted(motion)
                if fit is not None and cost < price:
                    best, price = fit, cost
            # A wrong multiple is found more easily than the right one, and leads to it.
            # All multiples once more from the new best fit, until none is better.
            trials = [best.motion * (n, n, n, 1) for n in FREQUENCY_MULTIPLES] if best and price < before else []
        return best, price

    def _spectrum(self, chirp: float) -> Pieces[list[tuple[float, np.ndarray]]]:
        """Lines of the readings over time warped by a chirp: their scores, and motions (4,)."""
        # Times at which the warped time would nearly stand still, or run backwards, are left out.
        rows = np.isfinite(self.readings) & (1 + chirp * self.time > 0.1)
        if rows.sum() < motion_fit.FEWEST_READINGS:
            return []
        time = self.time[rows]
        warped = time + 0.5 * chirp * time**2
        strokes = completed(strokes_of(warped, self.readings[rows, None], np.array([0, len(warped)]), 1))
        yield
        step = 0.5 / self.rate_Hz
        spectrum = completed(spectrum_of(strokes, step, 1 << math.ceil(math.log2(1.2 * strokes.extent / step))))
        yield
        if not np.isfinite(spectrum.own).any():
            return []
        lines = yield from spectrum.lines(self.low, self.high, 3)
        yield
        rates = [line.wavenumber for line in lines]
        scores = [line.ratio * strokes.extent for line in lines]
        # In warped time t + a t^2 / 2 a line at f is the motion f (1 + a t): frequency f and chirp f a at time 0.
        return [(score, np.array([0.0, rate, rate * chirp, 0.0])) for score, rate in zip(scores, rates, strict=True)]

    def _begun(self, motion: np.ndarray) -> MotionFit | None:
        """A first fit for a motion, whose phase is that of the readings near the middle of the window; None outside of
        the range. Its noise is the power of the readings."""
        seen = np.isfinite(self.readings)
        offset = float(self.readings[seen].mean())
        values = np.where(seen, self.readings - offset, 0.0)
        noise = float(values @ values) / int(seen.sum())
        if noise == 0 or not self.low / 1.1 < motion[1] < motion_fit.CHIRP_BAND_LIMIT * self.rate_Hz:
            return None
        begin, jumps, shape = np.array([0.0, *motion[1:]]), np.zeros(MOTION_KNOTS), np.zeros(SHAPE_PARAMETERS)
        trend = np.append(offset, np.zeros(TREND_PARAMETERS - 1))
        still = MotionFit(begin, jumps, 0.0, 1.0, trend, shape, np.zeros((1, 1)), noise, values, 0.0)
        wave = np.exp(-CYCLE_EXPONENT * motion_fit.phase_at(still, self.time)[0])
        # The phase of the strongest component near the middle, where the motion matters least.
        near = np.abs(self.time) < FITTED_WINDOW_PARTS[0] * self.time[-1]
        return still._replace(motion=np.array([np.angle((values * wave)[near].sum()) / (2 * np.pi), *motion[1:]]))

    def _fitted(self, motion: np.ndarray) -> Pieces[tuple[MotionFit | None, float]]:
        """A fit that starts from a motion, and its cost; None if it is not significant. The middle of the window is
        fitted first, because there a chirp is near to any motion."""
        trial = begun = self._begun(motion)
        if trial is None or begun is None:
            return None, math.inf
        # The short window of a search cannot distinguish jumps from a chirp: jumps, and kinks of the offset, are held
        # at 0.
        size, still = 2 * begun.noise**0.5, [HELD_PRIOR_SIGMA] * MOTION_KNOTS
        free = [0.5, 1 / self.time[-1], 3 * float(motion[1]), motion_fit.PRIOR_STIFFNESS_SIGMA]
        trend = [size, size, *[HELD_PRIOR_SIGMA * size] * MOTION_KNOTS]
        prior = np.diag(np.array([*free, *still, *trend, *[size] * SHAPE_PARAMETERS]) ** -2.0)
        about, distance = begun.values, np.abs(self.time) / self.time[-1]
        for reach in FITTED_WINDOW_PARTS:
            near = np.where(distance < reach, self.readings, math.nan)
            yield
            design = motion_fit.designed(trial, near, self.time, self.rate_Hz)
            yield
            trial = motion_fit.solved(design, prior, about)
            count = max(int(design.seen.sum()) - motion_fit.MOTION_PARAMETERS - 2 - SHAPE_PARAMETERS, 1)
            # The noise falls as the fit improves, and with it the weight of the prior: renewed at each step.
            noise = max(float(trial.residual @ trial.residual) / count, 1e-6 * begun.noise)
            trial = trial._replace(noise=noise)
        return (trial if trial.proved else None), price_of(trial, noise, count, self.rate_Hz)


class SubharmonicTest(NamedTuple):
    """A test on readings (n,) at phases (n,) in cycles of the followed frequency: is it a harmonic of a lower one?

    lowest : of the range of frequencies, relative to the followed one.
    """

    phase: np.ndarray
    readings: np.ndarray
    lowest: float

    def run(self) -> Pieces[float]:
        """The other possible frequency, relative to the followed one; 0 for none, NaN if there are too few periods. The
        test is that over the path (`papilla.estimators.wavelength.fundamental`)."""
        turns = np.flatnonzero(np.diff(np.sign(np.diff(self.phase))) != 0) + 1
        window = longest_strokes(self.phase, [0, *turns.tolist(), len(self.phase)], FEWEST_TESTED_PERIODS)
        if window is None:
            return math.nan
        rows, begin = window
        strokes = yield from strokes_of(self.phase[rows], self.readings[rows, None], begin)
        yield
        # On a grid finer than the samples there would be images of the lines (`tracking.memory.Task`).
        step = max(SMALLEST_STEP_CYCLES, middle(np.abs(np.diff(strokes.place))))
        highest = highest_shown(strokes.place, SMALLEST_STEP_CYCLES)
        longest = max(float(np.ptp(strokes.place[stroke])) for stroke in strokes.rows)
        spectrum = yield from spectrum_of(strokes, step, size_of(longest, step))
        lines = yield from spectrum.lines(1 / MOST_SUBHARMONICS, highest, MOST_TESTED_LINES)
        near = 2 / strokes.extent
        # Lines at whole cycles are the followed wave itself; the rest may belong to a lower fundamental.
        whole_cycles = [line for line in lines if abs(line.wavenumber - max(round(line.wavenumber), 1)) < near]
        if not whole_cycles:
            return math.nan
        chosen = whole_cycles[0]._replace(wavenumber=1.0)
        reach = HARMONIC_SLACK_RESOLUTIONS / strokes.extent
        rest = [line for line in lines if line not in whole_cycles and line.chance < CONFIRMED_CHANCE]
        others = [line for line in rest if line.amplitude > FAINTEST_HARMONIC * chosen.amplitude]
        period = fundamental_of(chosen, others, reach, set(others), False)
        if period.wavenumber < 1 or period.other:
            return period.other if period.wavenumber == 1 else period.wavenumber
        for divisor in range(2, MOST_SUBHARMONICS + 1):
            yield
            if hints(spectrum, lines, chosen, divisor, near, self.lowest):
                return 1 / divisor
        return 0.0


def nominated(places: list[tuple[float, np.ndarray]]) -> list[np.ndarray]:
    """The best peaks of all spectra, without repetitions."""
    chosen: list[np.ndarray] = []
    for _, motion in sorted(places, key=lambda place: -place[0]):
        if all(abs(motion[1] / stronger[1] - 1) > 0.05 for stronger in chosen):
            chosen.append(motion)
    return chosen[:SPECTRUM_NOMINEES]


def price_of(stroke: MotionFit, noise: float, count: int, rate_Hz: float) -> float:
    """Cost of a fit that leaves this noise in `count` readings: Schwarz's criterion (1978, doi:10.1214/aos/1176344136)
    with the number of harmonics that the rate shows, minus `OCTAVE_BONUS_NATS` for each octave of its frequency."""
    rate = max(abs(float(stroke.motion[1])), 1.0)
    present = min(motion_fit.FITTED_HARMONICS, int(motion_fit.CHIRP_BAND_LIMIT * rate_Hz / rate))
    return count * math.log(noise) + 2 * present * math.log(count) - OCTAVE_BONUS_NATS * math.log2(rate)
