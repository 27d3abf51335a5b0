"""Where a velocity-blind tracker may lock: lines in spectra of warped time, and fits from the best of them.

A chirp of relative rate a warps time: tau = t + a t^2 / 2 counts the periods of every frequency and its harmonics
alike. A look takes many samples, one part each.
"""

import math
from dataclasses import dataclass, field

import numpy as np

from papilla.estimators.spectrum import spectrum_of, strokes_of, whole
from papilla.estimators.tracking.stroke import (
    BAND,
    HARMONICS,
    KNOTS,
    MOTION,
    SHAPE,
    TREND,
    Stroke,
    improved,
    phase_at,
)  # fmt: skip

CHIRPS = (0.0, 2.0, -2.0, 5.0, -5.0, 9.0, -9.0)
"""Relative chirp rates in 1/s, in the middle of the window: those of a stroke of 1 Hz over 83 % of its time."""
NOMINEES, MULTIPLES = 4, (2, 3, 1 / 2, 1 / 3)
"""Places of the spectra that a fit is begun from, and the multiples of the best fit's frequency that are tried then."""
REACHES = 0.5, 0.5, 0.75, 1.01, 1.01, 1.01
"""Part of the window, about its middle, that each step from a nominee is fitted to."""
OCTAVE = 15.0
"""Nats by which a fit must be better than one of twice its frequency, whose every reading it can explain as well."""
STIFFNESS = 60.0
"""Standard deviation of the stiffness (1/s^2) where nothing is known of it."""


@dataclass(eq=False)
class ChirpLook:
    """A look at readings (n,) at times (n,) about 0; `advance` does one part and says whether it was the last.

    low, high : frequencies in Hz; rate_Hz : of the samples. best, price : the best fit so far, which tells of time 0.
    places : what is to be tried: (score, motion) while spectra are taken, then motions (4,). trial, centre, trend,
    step, noise : the fit that is tried, where it began (motion and trend), its steps done, and the power of the
    readings. multiplied : price of the fit whose multiples were tried.
    """

    readings: np.ndarray
    time: np.ndarray
    low: float
    high: float
    rate_Hz: float
    done: int = 0
    places: list = field(default_factory=list)
    trial: Stroke | None = None
    centre: np.ndarray = field(default_factory=lambda: np.zeros(MOTION))
    trend: np.ndarray = field(default_factory=lambda: np.zeros(TREND))
    step: int = 0
    noise: float = 0.0
    best: Stroke | None = None
    price: float = math.inf
    multiplied: float = math.inf

    def advance(self) -> bool:
        """Do the next part; True when there is none left."""
        self.done += 1
        if self.done <= len(CHIRPS):
            self._spectrum(CHIRPS[self.done - 1])
            return False
        if self.done == len(CHIRPS) + 1:
            self._nominate()
        if self.trial is not None:
            self._improve(self.trial)
        elif self.places:
            self._try(self.places.pop(0))
        elif self.best is not None and self.price < self.multiplied:
            # A wrong multiple is fitted more easily than the right one, and leads there.
            self.multiplied = self.price
            self.places = [self.best.motion * (n, n, n, 1) for n in MULTIPLES]
        else:
            return True
        return False

    def _spectrum(self, chirp: float) -> None:
        """Lines of the readings over the time that a chirp warps."""
        rows = np.isfinite(self.readings) & (1 + chirp * self.time > 0.1)
        if rows.sum() < 32:
            return
        time = self.time[rows]
        warped = time + 0.5 * chirp * time**2
        strokes = whole(strokes_of(warped, self.readings[rows, None], np.array([0, len(warped)]), 1))
        step = 0.5 / self.rate_Hz
        spectrum = whole(spectrum_of(strokes, step, 1 << math.ceil(math.log2(1.2 * strokes.extent / step))))
        if np.isfinite(spectrum.own).any():
            for line in whole(spectrum.lines(self.low, self.high, 3)):
                motion = np.array([0.0, line.wavenumber, line.wavenumber * chirp, 0.0])
                self.places.append((line.ratio * strokes.extent, motion))

    def _nominate(self) -> None:
        """The best places of all spectra."""
        chosen: list[np.ndarray] = []
        for _, motion in sorted(self.places, key=lambda place: -place[0]):
            if all(abs(motion[1] / other[1] - 1) > 0.05 for other in chosen):
                chosen.append(motion)
        self.places = chosen[:NOMINEES]

    def _try(self, motion: np.ndarray) -> None:
        """Begin a fit from a motion, whose phase is that of the readings near the middle."""
        seen = np.isfinite(self.readings)
        offset = float(self.readings[seen].mean())
        values = np.where(seen, self.readings - offset, 0.0)
        self.noise = float(values @ values) / int(seen.sum())
        if self.noise == 0 or not self.low / 1.1 < motion[1] < BAND * self.rate_Hz:
            return
        self.trend = np.array([offset, *[0.0] * (TREND - 1)])
        nothing = self.trend, np.zeros(SHAPE), np.zeros((1, 1)), self.noise, values, 0.0
        still = Stroke(np.array([0.0, *motion[1:]]), np.zeros(KNOTS), 0.0, 1.0, *nothing)
        wave = np.exp(-2j * np.pi * phase_at(still, self.time)[0])
        near = np.abs(self.time) < REACHES[0] * self.time[-1]
        self.centre = np.array([np.angle((values * wave)[near].sum()) / (2 * np.pi), *motion[1:]])
        self.trial, self.step = still._replace(motion=self.centre), 0

    def _improve(self, trial: Stroke) -> None:
        """A step of the fit that is tried: to the middle of the window first, where a chirp is near to any motion."""
        size = 2 * self.noise**0.5
        motion, still = [0.5, 1 / self.time[-1], 3 * self.centre[1], STIFFNESS], [1e-3] * KNOTS
        loose = np.array([*motion, *still, size, size, *[1e-3 * size] * KNOTS, *[size] * SHAPE])
        about = np.array([*self.centre, *[0.0] * KNOTS, *self.trend, *[0.0] * SHAPE])
        near = np.where(np.abs(self.time) / self.time[-1] < REACHES[self.step], self.readings, math.nan)
        stroke = improved(trial, near, self.time, self.rate_Hz, np.diag(1 / loose**2), about)
        count = max(int(np.isfinite(near).sum()) - MOTION - 2 - SHAPE, 1)
        noise = max(float(stroke.residual @ stroke.residual) / count, 1e-6 * self.noise)
        self.trial, self.step = stroke._replace(noise=noise), self.step + 1
        if self.step == len(REACHES):
            price = price_of(self.trial, noise, count, self.rate_Hz)
            if price < self.price and stroke.proved:
                self.best, self.price = self.trial, price
            self.trial = None


def price_of(stroke: Stroke, noise: float, count: int, rate_Hz: float) -> float:
    """Bayes's price (Schwarz 1978, doi:10.1214/aos/1176344136) of a fit that leaves this noise in so many readings, for
    the harmonics that there could be."""
    rate = max(abs(float(stroke.motion[1])), 1.0)
    present = min(HARMONICS, int(BAND * rate_Hz / rate))
    return count * math.log(noise) + 2 * present * math.log(count) - OCTAVE * math.log2(rate)
