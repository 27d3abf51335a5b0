"""Young's modulus of what the finger presses on, sample by sample, from every gauge against its own surface.

A single gauge needs the force; five of them measure it as well, so a poor force sensor costs little, and one gauge
that contradicts the others is found and left out. What is averaged is h, the distance along the curve that the readings
run through as the modulus changes, in units of their noise: samples move along it in straight lines, nearly.
"""

import math
from operator import eq, mul
from typing import Any, NamedTuple

import numpy as np

from papilla import checks
from papilla.calibration import IDENTIFIABLE, Calibration, SoftnessStatus
from papilla.errors import InputError
from papilla.estimators.softness.faults import Fault, in_words, numbered, pack
from papilla.estimators.softness.gauge_state import GaugeState
from papilla.estimators.softness.position_fit import PositionFitter
from papilla.estimators.softness.position_surfaces import PositionSurfaces
from papilla.estimators.softness.sample_fit import SampleFit, SampleFitter
from papilla.estimators.softness.surfaces import GaugeSurfaces, Section, distance_curve
from papilla.estimators.softness.suspects import LIMIT, Known, Search, misfit, search_on

_CODES = tuple(map(int, SoftnessStatus))
_OK, _NOT_IDENTIFIABLE, _SOFTER, _HARDER, _BELOW, _ABOVE, _NO_CONTACT, _BAD_GAUGE, _, _LEFT_OUT, _MISFIT, _OFF_REACH = (
    _CODES
)
_NONE = math.nan
_MISSING, _SATURATED, _STUCK = int(Fault.MISSING), int(Fault.SATURATED), int(Fault.STUCK)
BACK_AFTER = 10
"""Samples in a row that a channel must fit again to be used again."""
FITS_AGAIN = 16.0
"""Squared residual of such a sample."""
LEAST_SLOPE = 1e-3
"""Of the steepest dh / d ln E: h is a mere scale, and must rise where readings hardly do."""


class GaugeEstimate(NamedTuple):
    """modulus_MPa, modulus_sigma_MPa and force_N (NaN where there is no answer), status: the value of a
    `SoftnessStatus`; left_out: `Fault` of each channel as digits of base 8, g1 the lowest, the force last. position_mm,
    position_sigma_mm: x of this sample's contact, where that is an unknown (else NaN).

    modulus_sigma_MPa holds noise and the error of the calibration. Of a block, arrays (n,).
    """

    modulus_MPa: float | np.ndarray
    modulus_sigma_MPa: float | np.ndarray
    force_N: float | np.ndarray
    status: int | np.ndarray
    left_out: int | np.ndarray
    channels: int
    position_mm: float | np.ndarray = math.nan
    position_sigma_mm: float | np.ndarray = math.nan

    @property
    def sentence(self):
        """The status in words, and which channels were left out why: a string, or a list of them."""
        if isinstance(self.status, np.ndarray):
            return list(map(self._words, self.status.tolist(), np.asarray(self.left_out).tolist()))
        return self._words(self.status, int(self.left_out))

    def _words(self, status: int, left_out: int) -> str:
        faults = in_words(left_out, numbered(self.channels - 1))
        sentence = SoftnessStatus(status).sentence
        return f"{sentence}; {faults}" if faults else sentence


class GaugeSoftness:
    """Streaming modulus from all gauges; one sample is (g1, ..., gg, force_N), readings in microstrain.

    A force or a reading that is NaN is left out of its sample; a gauge that is stuck, saturated or contradicts the
    others is left out as long as it is, and the answer says which. Touches are expected at the apex: elsewhere the
    readings fit no modulus, and there is no answer, unless the position is an unknown too (`position_sigma_mm`).

    Parameters
    ----------
    calibration : of the same gauges in the same order.
    gauge_sigma : standard deviation of a gauge's noise, microstrain, > 0.
    force_sigma_N : standard deviation of the force's noise, N, > 0; inf where there is no force sensor.
    contact_force_N : with force and readings below it there is no contact, and what was learnt is dropped.
    saturation : |reading| in microstrain from which a gauge is saturated.
    stuck_samples : a gauge that repeats itself so often while another moves is stuck.
    position_sigma_mm : contacts lie anywhere along the finger (x, at y = 0), with this standard deviation about the
        apex, > 0, inf where nothing is known; every sample has its own position. The calibration must know contact
        positions, and one channel more is needed. None: at the apex.

    Raises `InputError` for unusable values, and for gauges whose surfaces are cut differently.
    """

    def __init__(
        self,
        calibration: Calibration,
        *,
        gauge_sigma: float,
        force_sigma_N: float,
        contact_force_N: float = 0.02,
        saturation: float = math.inf,
        stuck_samples: int = 50,
        position_sigma_mm: float | None = None,
    ):
        gauge_sigma = checks.positive("gauge_sigma (microstrain)", gauge_sigma)
        if not force_sigma_N > 0:
            raise InputError(
                f"force_sigma_N must be greater than 0, or inf without a force sensor, got {force_sigma_N}"
            )
        self._precision = 1.0 / force_sigma_N**2
        self._contact = checks.positive("contact_force_N", contact_force_N)
        if not saturation > 0:
            raise InputError(f"saturation (microstrain) must be greater than 0, got {saturation}")
        if stuck_samples < 2:
            raise InputError(f"stuck_samples must be at least 2, got {stuck_samples}")
        self._saturation, self._stuck = float(saturation), int(stuck_samples)
        if position_sigma_mm is not None and not position_sigma_mm > 0:
            raise InputError(f"position_sigma_mm must be greater than 0, or None, got {position_sigma_mm}")
        self._fitter: Any
        if position_sigma_mm is None:
            self._fitter = SampleFitter(GaugeSurfaces(calibration), gauge_sigma)
        else:
            self._fitter = PositionFitter(PositionSurfaces(calibration), gauge_sigma, position_sigma_mm)
        self._anywhere = position_sigma_mm is not None
        self._surfaces = surfaces = self._fitter.surfaces
        self._gauges, self._least = surfaces.gauges, self._fitter.rules.least
        if self._gauges < self._least - 1:
            raise InputError(f"at least {self._least - 1} gauges are needed, the calibration has {self._gauges}")
        self._all, self._none = (True,) * self._gauges, (0,) * (self._gauges + 1)
        self._uses: dict[tuple[int, ...], _Use] = {}
        self._curve = self._distances()
        self.reset()

    def _distances(self):
        """h over ln E at the middle force: the noise-free information of one sample is its squared slope."""
        surfaces = self._surfaces
        middle = math.sqrt(surfaces.low_force * surfaces.high_force)
        slopes = [self._slope(middle, node) for node in surfaces.nodes]
        least = LEAST_SLOPE * max(slopes)
        if not least > 0:
            raise InputError("no gauge of this calibration tells the modulus from the force")
        start, step = surfaces.nodes[0], surfaces.nodes[1] - surfaces.nodes[0]
        return distance_curve(np.maximum(slopes, least), start, 1 / step)

    def _slope(self, force: float, ln_modulus: float) -> float:
        expected, section = self._surfaces.readings(force, ln_modulus), self._surfaces.section(ln_modulus)
        fit = self._fitter.fit(expected, self._all, force, self._precision, section, 1.0)
        return 0.0 if fit is None else math.sqrt(fit.information)

    @property
    def state(self) -> GaugeState:
        """All that the estimator remembers, to be kept or to be set again."""
        return GaugeState(
            self._level,
            self._information,
            self._squares,
            tuple(self._systematic),
            self._samples,
            math.nan if self._section is None else self._section.ln_modulus,
            tuple(self._last),
            tuple(self._repeats),
            self._faults,
            tuple(self._returning),
            self._search,
            self._fitter.near if self._anywhere else (),
        )

    @state.setter
    def state(self, state: GaugeState) -> None:
        g = self._gauges
        if len(state.last) not in (0, g):
            raise InputError(f"the state is of {len(state.last)} gauges, the calibration has {g}")
        self._level, self._information, self._squares = state.level, state.information, state.squares
        self._systematic = list(state.systematic) or [0.0] * self._fitter.error_count
        self._samples = state.samples
        self._last = list(state.last) or [_NONE] * g
        self._repeats = list(state.repeats) or [0] * g
        self._repeating = any(self._repeats)
        self._faults = state.faults or self._none
        self._returning = list(state.returning) or [0] * (g + 1)
        self._search = state.search
        if self._anywhere:
            self._fitter.near = state.near
        self._section: Section | None = None
        if not math.isnan(state.linearised):
            self._linearise(self._surfaces.section(state.linearised))
        self._recall()

    def reset(self) -> None:
        """Forget everything."""
        self.state = GaugeState()

    def process(self, block) -> GaugeEstimate:
        """Estimates after each row of a block (n, g + 1); bit for bit what `update` gives row by row.

        Raises `InputError` for a block of another shape.
        """
        rows = np.asarray(block, float)
        if rows.ndim != 2 or rows.shape[1] != self._gauges + 1:
            shape = " x ".join(map(str, rows.shape))
            raise InputError(f"a block must be n x {self._gauges + 1} (gauges, then force_N), got {shape}")
        answers = [self.update(row) for row in rows.tolist()]
        modulus, sigma, force, status, left_out, _, position, spread = (
            zip(*answers, strict=True) if answers else ((),) * 8
        )
        return GaugeEstimate(
            np.array(modulus, float),
            np.array(sigma, float),
            np.array(force, float),
            np.array(status, int),
            np.array(left_out, int),
            self._gauges + 1,
            np.array(position, float),
            np.array(spread, float),
        )

    def update(self, sample) -> GaugeEstimate:
        """The estimate after one more sample (g1, ..., gg, force_N).

        A sample without an answer (status says why) leaves what was learnt untouched, except that lost contact ends it.
        Raises `InputError` for a sample of another length.
        """
        *readings, force = map(float, sample)
        if len(readings) != self._gauges:
            raise InputError(f"a sample must be {self._gauges} readings and force_N, got {len(readings) + 1} values")
        faults = self._watched(readings, force)
        use = self._uses.get(faults) or self._use(faults)
        # A noisy force alone does not end a touch: the gauges have to agree.
        if not force >= self._contact and self._is_away(readings, use.gauges):
            self._forget()
            return self._answer(_NO_CONTACT, use)
        if use.channels < self._least:
            return self._answer(_BAD_GAUGE, use)
        section = self._section
        if section is None:
            return self._begin(readings, force, faults, use)
        fit = self._fitter.fit(readings, use.gauges, force, use.precision, section, self._samples + 1.0)
        if fit is None:
            return self._answer(_NOT_IDENTIFIABLE, use)
        if fit.most > LIMIT:
            if outside := self._outside(fit.force, force, use):
                return self._answer(outside, use)
            if self._contradicts(readings, force, use, section):
                return self._search_on(readings, force, faults, use)
        if self._search.channels:
            self._search = Search()
        return self._learn(fit, readings, force, use, section)

    def _begin(self, readings, force: float, faults: tuple[int, ...], use: "_Use") -> GaugeEstimate:
        """The first sample of a touch, or the first that fits."""
        if self._search.due:
            return self._search_on(readings, force, faults, use)
        section, own = self._fitter.start(readings, use.gauges, force, use.precision)
        if own is None:
            return self._answer(_NOT_IDENTIFIABLE, use)
        if self._anywhere:
            self._fitter.near = own.force, own.position
        if own.chi2 > LIMIT:
            if outside := self._outside(own.force, force, use):
                return self._answer(outside, use)
            return self._search_on(readings, force, faults, use)
        fit = self._fitter.fit(readings, use.gauges, force, use.precision, section, 1.0)
        if fit is None:
            return self._answer(_NOT_IDENTIFIABLE, use)
        self._search = Search()
        self._linearise(section)
        return self._learn(fit, readings, force, use, section)

    def _search_on(self, readings, force: float, faults: tuple[int, ...], use: "_Use") -> GaugeEstimate:
        """A sample that does not fit: go on to find out who is to blame, and learn from the others."""
        verdict, self._search = search_on(
            self._search, self._fitter, readings, use.gauges, force, use.precision, self._known(), self._section
        )
        if verdict is None:
            return self._answer(_MISFIT, use)
        if verdict.anew:
            self._forget()
        self._faults = _merged(verdict.faults, self._faults)
        use, section = self._use(_merged(verdict.faults, faults)), self._section
        # What it takes to begin anew is left to the next sample: an update shall not take long.
        if section is None or self._contradicts(readings, force, use, section):
            return self._answer(_MISFIT, use)
        fit = self._fitter.fit(readings, use.gauges, force, use.precision, section, self._samples + 1.0)
        if fit is None:
            return self._answer(_NOT_IDENTIFIABLE, use)
        return self._learn(fit, readings, force, use, section)

    def _outside(self, fitted: float, measured: float, use: "_Use") -> int:
        """The status of a force that all sensors place outside the domain, where nothing is known of the readings."""
        low, high = self._surfaces.low_force, self._surfaces.high_force
        least, most = (min(fitted, measured), max(fitted, measured)) if use.precision else (fitted, fitted)
        return _BELOW if most < low else _ABOVE if least > high else _OK

    def _contradicts(self, readings, force: float, use: "_Use", section: Section) -> bool:
        own = self._fitter.alone(readings, use.gauges, force, use.precision, section)
        return misfit(own, self._known()) > LIMIT

    def _known(self) -> Known:
        return Known(self._ln_modulus, self._variance)

    def _learn(self, fit: SampleFit, readings, force: float, use: "_Use", section: Section) -> GaugeEstimate:
        """Take one sample into the mean of h, and invert that."""
        if self._faults != self._none:
            self._watch_returning(readings, force, use, section)
        surfaces = self._surfaces
        if not surfaces.low_force <= fit.force <= surfaces.high_force:
            return self._answer(_BELOW if fit.force < surfaces.low_force else _ABOVE, use)
        if self._anywhere:
            if abs(fit.position) > surfaces.reach:
                return self._answer(_OFF_REACH, use)
            self._fitter.near = fit.force, fit.position
        slope = self._slope_there
        weight = fit.information / (slope * slope)
        self._information = information = self._information + weight
        self._squares += weight
        self._level += weight / information * (self._level_there - self._level + fit.step * slope)
        gain = weight * slope
        self._systematic = [old + gain * new for old, new in zip(self._systematic, fit.systematic, strict=True)]
        self._samples += 1.0
        status = self._recall()
        if section.is_far(self._ln_modulus, self._variance):
            self._linearise(surfaces.section(self._ln_modulus))
        if status:
            return self._answer(status, use, fit.force)
        relative, modulus = math.sqrt(self._variance), math.exp(self._ln_modulus)
        status = _NOT_IDENTIFIABLE if relative > IDENTIFIABLE else use.status
        if not self._anywhere:
            return GaugeEstimate(modulus, relative * modulus, fit.force, status, use.code, self._gauges + 1)
        spread = math.sqrt(fit.position_variance + fit.position_slope**2 * self._variance)
        place = fit.position, spread
        return GaugeEstimate(modulus, relative * modulus, fit.force, status, use.code, self._gauges + 1, *place)

    def _linearise(self, section: Section) -> None:
        """Linearise the samples to come at a section."""
        self._section = section
        self._level_there, self._slope_there = self._curve.evaluate(section.ln_modulus)

    def _recall(self) -> int:
        """Renew what is known of ln E: its variance is of noise, and of the calibration errors of each group."""
        self._ln_modulus, slope, status = self._inverted()
        self._variance = math.inf
        if self._information:
            errors = sum(map(mul, self._systematic, self._systematic))
            self._variance = (self._squares + errors) / (self._information * slope) ** 2
        return status

    def _inverted(self) -> tuple[float, float, int]:
        """ln E of the mean of h, the slope of h there, and the status; beyond the curve, its end."""
        values = self._curve.values
        if values[0] <= self._level <= values[-1]:
            return *self._curve.solve(self._level, 0, len(values) - 1), _OK
        end, status = (0, _SOFTER) if self._level < 0 else (-1, _HARDER)
        node = self._surfaces.nodes[end]
        return node, self._curve.evaluate(node)[1], status

    def _watched(self, readings: list[float], force: float) -> tuple[int, ...]:
        """Faults of this sample: those that stand, and what the readings alone show."""
        limit = self._saturation
        same = list(map(eq, readings, self._last))
        self._last = readings
        if True in same:
            self._count_repeats(same)
        elif self._repeating:
            self._repeats, self._repeating = [0] * self._gauges, False
        total = sum(readings) + force
        # An infinite or NaN value makes the difference NaN.
        healthy = total - total == 0.0 and max(readings) < limit and -limit < min(readings)
        if healthy and not (self._repeating and max(self._repeats) >= self._stuck):
            return self._faults
        found = list(self._faults)
        for number, reading in enumerate(readings):
            if reading - reading != 0.0:
                found[number] = _MISSING
            elif not -limit < reading < limit:
                found[number] = _SATURATED
            elif self._repeats[number] >= self._stuck:
                found[number] = _STUCK
        if force - force != 0.0 and self._precision:
            found[-1] = _MISSING
        return tuple(found)

    def _count_repeats(self, same: list[bool]) -> None:
        """Count how often each gauge has repeated itself while another moved."""
        if False not in same:
            return
        self._repeats = [count + 1 if again else 0 for count, again in zip(self._repeats, same, strict=True)]
        self._repeating = True
        if self._stuck in self._repeats:
            # A gauge has just turned out to be stuck: what was learnt with it, and whom it had blamed, is void.
            self._forget()
            self._faults = self._none

    def _use(self, faults: tuple[int, ...]) -> "_Use":
        """What to use with such faults, looked up the next time."""
        *gauges, force = faults
        used, precision = tuple([not fault for fault in gauges]), 0.0 if force else self._precision
        status = _LEFT_OUT if any(faults) else _OK
        self._uses[faults] = use = _Use(used, precision, sum(used) + (precision > 0), pack(faults), status)
        return use

    def _is_away(self, readings: list[float], used: tuple[bool, ...]) -> bool:
        """Whether the used readings are below those of the contact force (True where they are no measure of it)."""
        table = self._surfaces.force_table(used) if any(used) else None
        lowest = math.inf if table is None else table.lowest * self._contact / self._surfaces.low_force
        return sum([y * y for y, use in zip(readings, used, strict=True) if use]) < lowest * lowest

    def _watch_returning(self, readings, force: float, use: "_Use", section: Section) -> None:
        """Use a channel again that has fitted `BACK_AFTER` samples in a row."""
        own = self._fitter.alone(readings, use.gauges, force, use.precision, section)
        if own is None:
            return
        expected = self._fitter.expected(own, section, min(own.variance, self._variance))
        for number, fault in enumerate(self._faults):
            if not fault:
                continue
            if number < self._gauges:
                value, sigma = expected[number]
                rest = ((readings[number] - value) / sigma) ** 2
            else:
                rest = (force - own.force) ** 2 / (1.0 / self._precision + own.force_variance)
            self._returning[number] = self._returning[number] + 1 if rest < FITS_AGAIN else 0
            if self._returning[number] >= BACK_AFTER:
                self._faults = tuple([0 if other == number else kept for other, kept in enumerate(self._faults)])
                self._returning[number] = 0

    def _forget(self) -> None:
        self._level = self._information = self._squares = self._samples = 0.0
        self._systematic = [0.0] * self._fitter.error_count
        self._section, self._search = None, Search()
        self._recall()

    def _answer(self, status: int, use: "_Use", force=_NONE) -> GaugeEstimate:
        """No modulus, and why."""
        return GaugeEstimate(_NONE, _NONE, force, status, use.code, self._gauges + 1)


class _Use(NamedTuple):
    """What a combination of faults leaves: gauges to use, precision of the force, number of channels; the faults as
    one integer, and the status of an answer."""

    gauges: tuple[bool, ...]
    precision: float
    channels: int
    code: int
    status: int


def _merged(new: tuple[int, ...], old: tuple[int, ...]) -> tuple[int, ...]:
    """Faults of both, the new ones first."""
    return tuple([one or other for one, other in zip(new, old, strict=True)])
