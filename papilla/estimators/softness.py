"""Young's modulus of what the finger presses on, sample by sample, from S_d and force.

Averaging E is wrong: near its saturation S_d turns symmetric noise into skewed E. What is averaged instead is h(E) =
ln S_d(E) at one reference force, in which all forces are nearly straight lines; it is inverted once, at the end. Every
sample is linearised at the estimate before it, which its own noise cannot have moved (a Kalman filter of one constant).
"""

import math
from dataclasses import dataclass
from operator import mul
from typing import NamedTuple

import numpy as np

from papilla import checks
from papilla.calibration import IDENTIFIABLE, Calibration, SoftnessStatus
from papilla.errors import InputError

# As plain integers: looking a member up in its enumeration costs as much as evaluating the surface.
_OK, _NOT_IDENTIFIABLE, _SOFTER, _HARDER, _BELOW, _ABOVE, _NO_CONTACT, _BAD_GAUGE, _BAD_INPUT = map(int, SoftnessStatus)
_NONE = math.nan


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
        if isinstance(self.status, np.ndarray):
            return [SoftnessStatus(code).sentence for code in self.status.tolist()]
        return SoftnessStatus(self.status).sentence


@dataclass(frozen=True)
class SoftnessState:
    """All that the estimator remembers.

    level : weighted mean of h; information : sum of the weights, squares : the same with squared forgetting factors, so
    that the variance of `level` is squares / information^2. last, repeats : the readings of the last sample, and how
    often each gauge has repeated itself while another moved.
    """

    level: float = 0.0
    information: float = 0.0
    squares: float = 0.0
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
    contact_force_N : below it there is no contact, and what was learnt of the last specimen is dropped.
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
        self._point = calibration.surface.point
        self._low_force, self._high_force = calibration.domain["force_N"]
        self._prepare()
        self.reset()

    def _prepare(self) -> None:
        surface, known = self._surface.surface, self._surface.uncertainty
        reference = 0.5 * (math.log(self._low_force) + math.log(self._high_force))
        self._curve = self._point.curve(reference)
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
        return SoftnessState(self._level, self._information, self._squares, self._last, tuple(self._repeats))

    @state.setter
    def state(self, state: SoftnessState) -> None:
        if len(state.last) not in (0, self._gauges) or len(state.repeats) not in (0, self._gauges):
            raise InputError(f"the state is of {len(state.last)} gauges, the calibration has {self._gauges}")
        self._level, self._information, self._squares = state.level, state.information, state.squares
        self._last = state.last or (_NONE,) * self._gauges
        self._repeats = list(state.repeats) or [0] * self._gauges
        self._ln_modulus = self._inverted(state.level)[0]

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
        if force < self._contact:
            self._level = self._information = self._squares = 0.0
            return SoftnessEstimate(_NONE, _NONE, _NO_CONTACT)
        if not self._low_force <= force <= self._high_force:
            return SoftnessEstimate(_NONE, _NONE, _BELOW if force < self._low_force else _ABOVE)
        if not healthy:
            return SoftnessEstimate(_NONE, _NONE, _BAD_GAUGE)
        mean = total / self._gauges
        deviations = [value - mean for value in readings]
        return self._learn(math.sqrt(sum(map(mul, deviations, deviations)) / self._gauges), force)

    def _watch(self, readings: list[float]) -> bool:
        """Whether no gauge is saturated or stuck; counts the repeats of each."""
        last, repeats, healthy = self._last, self._repeats, True
        same = [a == b for a, b in zip(readings, last, strict=True)]
        if True in same and False in same:
            for number, repeated in enumerate(same):
                repeats[number] = repeats[number] + 1 if repeated else 0
                if repeats[number] >= self._stuck:
                    healthy = False
        elif False in same:
            self._repeats = [0] * self._gauges
        else:
            healthy = max(repeats) < self._stuck
        self._last = tuple(readings)
        return healthy and max(readings) < self._saturation and -self._saturation < min(readings)

    def _learn(self, sd: float, force: float) -> SoftnessEstimate:
        """Take one S_d into the mean of h, and invert it."""
        ln_force = math.log(force)
        softest, hardest, systematic = self._cells[self._point.force_cell(ln_force)]
        at = self._ln_modulus if self._information else self._start(ln_force, sd)
        if not softest <= at <= hardest:
            return SoftnessEstimate(_NONE, _NONE, _NOT_IDENTIFIABLE)
        ln_sd, along_force, along_modulus = self._point.evaluate(ln_force, at)
        level, slope = self._curve.evaluate(at)
        if not (along_modulus > 0 and slope > 0):
            return SoftnessEstimate(_NONE, _NONE, _NOT_IDENTIFIABLE)
        expected = math.exp(ln_sd)
        of_force = self._force_variance / (force * force)
        of_gauges = self._sd_variance / (expected * expected)
        by_force = along_force * along_force * of_force
        variance = of_gauges + by_force
        residual = sd / expected - 1.0 + self._bias(along_force, of_force, of_gauges, by_force)
        gain = along_modulus / slope
        weight = gain * gain / variance
        self._information = information = self._keep * self._information + weight
        self._squares = self._keep * self._keep * self._squares + weight
        self._level += weight / information * (level - self._level + residual / gain)
        self._ln_modulus, slope, status = self._inverted(self._level)
        if status:
            return SoftnessEstimate(_NONE, _NONE, status)
        random = self._squares / (information * information * slope * slope)
        relative = math.sqrt(random + systematic / (along_modulus * along_modulus))
        modulus = math.exp(self._ln_modulus)
        return SoftnessEstimate(modulus, relative * modulus, _NOT_IDENTIFIABLE if relative > IDENTIFIABLE else _OK)

    def _bias(self, along_force: float, of_force: float, of_gauges: float, by_force: float) -> float:
        """What is added to a relative residual to take off its second-order bias.

        A standard deviation of g noisy readings is too large by (g - 2) / 2 of its own variance. A force read too high
        makes the expected S_d too large and the weight of the sample too, so their product has a mean: with x = ln f,
        s = d ln S_d / dx and weights w, as if the residual were (s + s^2) / 2 - s d ln w / dx, times (sigma_f / f)^2.
        """
        per_force = 2 * (along_force * of_gauges + by_force) / (of_gauges + by_force)
        by_weight = along_force * of_force * (per_force - 0.5 - 0.5 * along_force)
        return by_weight - 0.5 * (self._gauges - 2) * of_gauges

    def _start(self, ln_force: float, sd: float) -> float:
        """Where to linearise the first sample: its own inverse, or the nearest end of the calibrated moduli."""
        low, high = self._surface.usable_nodes(ln_force)
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
