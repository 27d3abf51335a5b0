"""Young's modulus of what the finger presses on, sample by sample, from S_d and force.

Averaging E is wrong: near its saturation S_d turns symmetric noise into skewed E. What is averaged instead is h(E) =
ln S_d(E) at one reference force, in which all forces are nearly straight lines; it is inverted once, at the end. Every
sample is linearised at an estimate before it, which its own noise cannot have moved (a Kalman filter of one constant),
and at the force that S_d and the force sensor together make likeliest: S_d bends over the noise of a force sensor, but
hardly over what is left of it when S_d itself measures the force.
"""

import math
from dataclasses import dataclass
from operator import eq, mul
from typing import NamedTuple

import numpy as np

from papilla import checks
from papilla.calibration import IDENTIFIABLE, Calibration, SoftnessStatus
from papilla.errors import InputError
from papilla.estimators.softness.surfaces import Section, Sections, sd_force_table
from papilla.estimators.status_words import status_in_words

# As plain integers: looking a member up in its enumeration costs as much as evaluating the surface.
_CODES = tuple(map(int, SoftnessStatus))
_OK, _NOT_IDENTIFIABLE, _SOFTER, _HARDER, _BELOW, _ABOVE, _NO_CONTACT, _BAD_GAUGE, _BAD_INPUT, *_ = _CODES
_NONE = math.nan
NOISE_REACH = 4.0
"""Sigmas of the force by which a measured force may lie outside the domain, when S_d says that it is inside."""


class SoftnessEstimate(NamedTuple):
    """modulus_MPa, modulus_sigma_MPa (NaN where there is no answer) and status: the value of a `SoftnessStatus`.

    NOT_IDENTIFIABLE may come with a modulus: its sigma is then more than half of it. Of a block, arrays (n,).
    """

    modulus_MPa: float | np.ndarray
    modulus_sigma_MPa: float | np.ndarray
    status: int | np.ndarray

    @property
    def sentence(self):
        """The status in words: a string, or a list of them."""
        return status_in_words(SoftnessStatus, self.status)


@dataclass(frozen=True)
class SoftnessState:
    """All that the estimator remembers.

    level : weighted mean of h; information : sum of the weights, squares : the same with squared forgetting factors, so
    that the variance of `level` is squares / information^2; linearised : ln E where samples are linearised, NaN before
    the first. last, repeats : the readings of the last sample, and how
    often each gauge has repeated itself while another moved.
    """

    level: float = 0.0
    information: float = 0.0
    squares: float = 0.0
    linearised: float = math.nan
    last: tuple[float, ...] = ()
    repeats: tuple[int, ...] = ()


class Softness:
    """Streaming modulus; one sample is (g1, ..., gg, force_N), readings in microstrain.

    Parameters
    ----------
    calibration : of the same gauges in the same order.
    gauge_sigma : standard deviation of a gauge's noise, microstrain, > 0.
    force_sigma_N : standard deviation of the force's noise, N.
    memory_s : time constant of forgetting; inf remembers until contact is lost.
    sample_rate_Hz : what a sample is in time; matters for a finite memory only.
    contact_force_N : with force and S_d below it there is no contact, and what was learnt is dropped.
    saturation : |reading| in microstrain from which a gauge is saturated.
    stuck_samples : a gauge that repeats itself so often while another moves is stuck.

    Raises `InputError` for unusable values, and for a calibration whose S_d nowhere rises with the modulus.
    """

    def __init__(
        self,
        calibration: Calibration,
        *,
        gauge_sigma: float,
        force_sigma_N: float,
        memory_s: float = math.inf,
        sample_rate_Hz: float = 1000.0,
        contact_force_N: float = 0.02,
        saturation: float = math.inf,
        stuck_samples: int = 50,
    ):
        self._gauge_sigma = checks.positive("gauge_sigma (microstrain)", gauge_sigma)
        self._force_variance = checks.within("force_sigma_N", force_sigma_N, 0, math.inf) ** 2
        self._contact = checks.positive("contact_force_N", contact_force_N)
        if not saturation > 0:
            raise InputError(f"saturation (microstrain) must be greater than 0, got {saturation}")
        if not memory_s > 0:
            raise InputError(f"memory_s must be greater than 0, got {memory_s}")
        if stuck_samples < 2:
            raise InputError(f"stuck_samples must be at least 2, got {stuck_samples}")
        self._saturation, self._stuck = float(saturation), int(stuck_samples)
        self._keep = math.exp(-1 / (memory_s * checks.positive("sample_rate_Hz", sample_rate_Hz)))
        self._gauges = count = len(calibration.gauges)
        self._sd_variance = self._gauge_sigma**2 / count
        self._surface = calibration.surface
        self._low_force, self._high_force = calibration.domain["force_N"]
        # Noise may carry a force out of the domain; to drop such samples would pick those with the noise inwards.
        slack = NOISE_REACH * force_sigma_N
        self._least_force, self._most_force = self._low_force - slack, self._high_force + slack
        self._prepare()
        self._least_sd = self._forces.lowest * self._contact / self._low_force
        self.reset()

    def _prepare(self) -> None:
        surface, known = self._surface.surface, self._surface.uncertainty
        reference = 0.5 * (math.log(self._low_force) + math.log(self._high_force))
        self._sections, self._forces = Sections([surface]), sd_force_table(surface)
        self._curve = self._surface.point.curve(reference)
        self._bottom, self._top = self._surface.usable_nodes(reference)
        if self._bottom >= self._top:
            raise InputError("S_d of this calibration does not rise with the modulus: no softness can be estimated")
        self._least, self._most = self._curve.values[self._bottom], self._curve.values[self._top]
        axis, force_axis = surface.modulus_axis, surface.force_axis
        self._nodes = [axis.start + axis.step * node for node in range(axis.cells + 1)]
        self._cells = []
        for cell in range(force_axis.cells):
            middle = force_axis.start + force_axis.step * (cell + 0.5)
            low, high = self._surface.usable_nodes(middle)
            limits = (self._nodes[low], self._nodes[high]) if low < high else (math.inf, -math.inf)
            self._cells.append((*limits, known.fit_rms**2 + known.scatter_at(math.exp(middle)) ** 2))

    @property
    def state(self) -> SoftnessState:
        """All that the estimator remembers, to be kept or to be set again."""
        at = math.nan if self._section is None else self._section.ln_modulus
        return SoftnessState(self._level, self._information, self._squares, at, tuple(self._last), tuple(self._repeats))

    @state.setter
    def state(self, state: SoftnessState) -> None:
        if len(state.last) not in (0, self._gauges) or len(state.repeats) not in (0, self._gauges):
            raise InputError(f"the state is of {len(state.last)} gauges, the calibration has {self._gauges}")
        self._level, self._information, self._squares = state.level, state.information, state.squares
        self._last = list(state.last) or [_NONE] * self._gauges
        self._repeats = list(state.repeats) or [0] * self._gauges
        self._repeating = any(self._repeats)
        self._section: Section | None = None
        if not math.isnan(state.linearised):
            self._linearise(state.linearised)

    def reset(self) -> None:
        """Forget everything."""
        self.state = SoftnessState()

    @property
    def stuck_gauges(self) -> tuple[int, ...]:
        """Numbers (from 0) of the gauges that are stuck now."""
        return tuple(number for number, count in enumerate(self._repeats) if count >= self._stuck)

    def process(self, block) -> SoftnessEstimate:
        """Estimates after each row of a block (n, g + 1); bit for bit what `update` gives row by row.

        Raises `InputError` for a block of another shape.
        """
        rows = np.asarray(block, float)
        if rows.ndim != 2 or rows.shape[1] != self._gauges + 1:
            shape = " x ".join(map(str, rows.shape))
            raise InputError(f"a block must be n x {self._gauges + 1} (gauges, then force_N), got {shape}")
        answers = [self.update(row) for row in rows.tolist()]
        modulus, sigma, status = zip(*answers, strict=True) if answers else ((), (), ())
        return SoftnessEstimate(np.array(modulus, float), np.array(sigma, float), np.array(status, int))

    def update(self, sample) -> SoftnessEstimate:
        """The estimate after one more sample (g1, ..., gg, force_N).

        A sample without an answer (status says why) leaves what was learnt untouched, except that lost contact ends it.
        Raises `InputError` for a sample of another length.
        """
        *readings, force = map(float, sample)
        if len(readings) != self._gauges:
            raise InputError(f"a sample must be {self._gauges} readings and force_N, got {len(readings) + 1} values")
        total = sum(readings)
        # An infinite or NaN reading makes the difference NaN.
        healthy = self._watch(readings) and total - total == 0.0
        if force - force != 0.0:
            return SoftnessEstimate(_NONE, _NONE, _BAD_INPUT)
        mean = total / self._gauges
        deviations = [value - mean for value in readings]
        sd = math.sqrt(sum(map(mul, deviations, deviations)) / self._gauges)
        # A noisy force alone does not end a touch: S_d has to agree, where it is to be trusted.
        if force < self._contact and not (healthy and sd > self._least_sd):
            self._level = self._information = self._squares = 0.0
            self._section = None
            return SoftnessEstimate(_NONE, _NONE, _NO_CONTACT)
        if not self._least_force <= force <= self._most_force:
            return SoftnessEstimate(_NONE, _NONE, _BELOW if force < self._low_force else _ABOVE)
        if not healthy:
            return SoftnessEstimate(_NONE, _NONE, _BAD_GAUGE)
        return self._learn(sd, force)

    def _watch(self, readings: list[float]) -> bool:
        """Whether no gauge is saturated or stuck; counts how often each has repeated itself while another moved."""
        same = list(map(eq, readings, self._last))
        self._last = readings
        if True in same:
            if False in same:
                self._repeats = [count + 1 if again else 0 for count, again in zip(self._repeats, same, strict=True)]
                self._repeating = True
        elif self._repeating:
            self._repeats, self._repeating = [0] * self._gauges, False
        if self._repeating and max(self._repeats) >= self._stuck:
            return False
        return max(readings) < self._saturation and -self._saturation < min(readings)

    def _learn(self, sd: float, force: float) -> SoftnessEstimate:
        """Take one S_d into the mean of h, and invert it.

        At force f0 and modulus E0, R = S_d - S - S_f (f_m - f0) has variance v = sigma_sd^2 + S_f^2 sigma_f^2 and slope
        S_E in ln E; the likeliest f0 is off by the variance p = sigma_sd^2 sigma_f^2 / v, and not correlated with R.
        Two biases of R are of second order: -S_ff p / 2, because f0 is likelier on the side where S_d bends away from
        its noise, and that of a standard deviation of g noisy readings, (g - 2) / 2 sigma_sd^2 / S.
        """
        section = self._section
        if section is None:
            start = self._start(math.log(min(max(force, self._low_force), self._high_force)), sd)
            if start is None:
                return SoftnessEstimate(_NONE, _NONE, _NOT_IDENTIFIABLE)
            section = self._linearise(start)
        gauges, noise = self._sd_variance, self._force_variance
        at = force
        if noise and sd > 0:
            ln_force, along = self._forces.ln_force(math.log(sd), section.ln_modulus)
            by_sd = math.exp(ln_force)
            own = gauges * (along * by_sd / sd) ** 2
            at = by_sd + (force - by_sd) * own / (own + noise)
        if not self._low_force <= at <= self._high_force:
            return self._nothing_told(_BELOW if at < self._low_force else _ABOVE)
        cell, ((ln_sd, along_modulus, along_force, bend),) = section.evaluate(math.log(at))
        softest, hardest, systematic = self._cells[cell]
        if not (softest <= section.ln_modulus <= hardest and along_modulus > 0 and self._slope_there > 0):
            return self._nothing_told(_NOT_IDENTIFIABLE)
        expected = math.exp(ln_sd)
        slope = expected * along_force / at
        variance = gauges + slope * slope * noise
        curved = expected * (bend + along_force * (along_force - 1.0)) / (at * at) * gauges * noise / variance
        residual = sd - expected - slope * (force - at) + 0.5 * (curved - (self._gauges - 2) * gauges / expected)
        gain = expected * along_modulus / self._slope_there
        weight = gain * gain / variance
        self._information = information = self._keep * self._information + weight
        self._squares = self._keep * self._keep * self._squares + weight
        self._level += weight / information * (self._level_there - self._level + residual / gain)
        ln_modulus, slope, status = self._inverted(self._level)
        random = self._squares / (information * information * slope * slope)
        whole = random + systematic / (along_modulus * along_modulus)
        if section.is_far(ln_modulus, whole):
            self._linearise(ln_modulus)
        if status:
            return SoftnessEstimate(_NONE, _NONE, status)
        relative, modulus = math.sqrt(whole), math.exp(ln_modulus)
        return SoftnessEstimate(modulus, relative * modulus, _NOT_IDENTIFIABLE if relative > IDENTIFIABLE else _OK)

    def _nothing_told(self, status: int) -> SoftnessEstimate:
        if not self._information:
            self._section = None
        return SoftnessEstimate(_NONE, _NONE, status)

    def _linearise(self, ln_modulus: float) -> Section:
        """Linearise the samples to come at a modulus."""
        self._section = section = self._sections.at(ln_modulus)
        self._level_there, self._slope_there = self._curve.evaluate(ln_modulus)
        return section

    def _start(self, ln_force: float, sd: float) -> float | None:
        """Where to linearise the first sample: its own inverse, or the nearest end of the calibrated moduli; None where
        S_d does not rise with the modulus."""
        low, high = self._surface.usable_nodes(ln_force)
        if low >= high:
            return None
        ln_modulus, status = self._surface.ln_modulus(ln_force, math.log(sd) if sd > 0 else -math.inf)
        if status is SoftnessStatus.OK:
            return ln_modulus
        if status is SoftnessStatus.NOT_IDENTIFIABLE:
            return 0.5 * (self._nodes[low] + self._nodes[high])
        return self._nodes[low if status is SoftnessStatus.SOFTER else high]

    def _inverted(self, level: float) -> tuple[float, float, int]:
        """ln E of a mean of h, the slope of h there, and the status; beyond the curve, its end."""
        if self._least <= level <= self._most:
            ln_modulus, slope = self._curve.solve(level, self._bottom, self._top)
            return ln_modulus, slope, _OK
        end, status = (self._bottom, _SOFTER) if level < self._least else (self._top, _HARDER)
        return self._nodes[end], self._curve.evaluate(self._nodes[end])[1], status
