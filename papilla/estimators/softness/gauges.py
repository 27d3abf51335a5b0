"""Young's modulus of what the finger presses on, sample by sample, from every gauge against its own surface.

Five gauges and a force are six equations for two unknowns, modulus and force (and the place, if it is unknown). So a
poor force sensor costs little, and a bad channel can be recognised. The misfit of a sample is r' S^-1 r, r its
residuals against the filter of the touch and their covariance S (`fitter`). Without the channels A it falls to

    misfit - r_A' (S^-1)_AA^-1 r_A,   with r_A = (S^-1 r)_A,

so every set of suspects costs one small inverse. A sample whose misfit passes 40 starts a search: does another modulus
explain it, as after a lift that the force did not show? If not, which single channel, or pair, explains it when left
out? Suspects that explain it about equally well are all left out. The search is spread over the next samples, none of
which is answered or learnt, because one sample may cost 0.5 ms. Where nothing explains the readings again and again, as
over a texture, all of them are distrusted for a while instead of blaming one.
"""

import math
from dataclasses import dataclass
from functools import partial
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np

from papilla.calibration import Calibration, SoftnessStatus
from papilla.core import checks
from papilla.core.errors import InputError
from papilla.estimators.health import FAULT_MISSING, FAULT_STUCK, STUCK_SAMPLES, Fault, in_words, numbered, pack
from papilla.estimators.softness import touch
from papilla.estimators.softness.channels import Doubts, GaugeSurfaces
from papilla.estimators.softness.fitter import FilterState, Fitter, NoiseFit, Residuals
from papilla.estimators.stream import Pieces, SpreadTask, completed


@dataclass(frozen=True)
class BlameRules:
    """Tuned numbers for deciding which channels are at fault when channels contradict each other. Misfits are squares
    in standard deviations of a sample of six channels, with at most five degrees of freedom."""

    least_channels: int = 3
    """Smallest number of channels, readings and force: two unknowns, and one channel that can contradict."""
    contradicts: float = 40.0
    """Misfit of a sample above which something is wrong; 1e-7 of good samples exceed it."""
    agrees: float = 20.0
    """Misfit below which the remaining channels agree; 1e-3 of good samples exceed it."""
    margin: float = 10.0
    """Difference of misfit within which two suspects cannot be distinguished from the best: a likelihood ratio of
    e^-5."""
    explained: float = 25.0
    """Squared residual up to which a reversed sign or exchanged gauges explain a reading."""
    fits_again: float = 16.0
    """Squared residual of a sample up to which an excluded channel fits again."""
    back_after: int = 10
    """Number of consecutive samples that an excluded channel must fit before it is used again."""
    unexplained: int = 80
    """Distrust added by a contradiction for which no channel is at fault, as a number of good samples that outweigh
    it."""
    trusted: int = 200
    """Distrust above which there is no answer and no gauge is at fault: over a texture all gauges contradict each
    other."""
    most_patience: int = 1920
    """Largest number of good samples (2 s at 1 kHz) after which the gauges are trusted again, if repeatedly no channel
    explained a contradiction."""


BLAME_RULES = BlameRules()


class FaultSearch(NamedTuple):
    """A search for an explanation of a sample (c + 1,) with these faults, spread over the next samples: its residuals
    against the filter of the touch (known) or, for the first sample of a touch, against the best first fit."""

    y: np.ndarray
    faults: tuple[int, ...]
    residuals: Residuals
    state: FilterState
    known: bool

    def run(self, of: "GaugeSoftness") -> Pieces[tuple]:
        """Returns the status of a force outside the domain; the faults of the channels at fault; and the filter with
        which the sample is learnt, or None if nothing explains it. Nothing of the search is stored before its end."""
        return of._explained(*self)


class GaugeEstimate(NamedTuple):
    """modulus_MPa, modulus_sigma_MPa and force_N (NaN where there is no answer), status: the value of a
    `SoftnessStatus`; left_out: `Fault` of each channel as digits of base 8, g1 the lowest, the force last. position_mm,
    position_sigma_mm: x of this sample's contact, where that is an unknown (else NaN).

    modulus_sigma_MPa holds noise, the error of the calibration and all `Doubts`. Of a block, arrays (n,).
    """

    modulus_MPa: float | np.ndarray
    modulus_sigma_MPa: float | np.ndarray
    force_N: float | np.ndarray
    status: int | np.ndarray
    left_out: int | np.ndarray
    channels: int | np.ndarray
    position_mm: float | np.ndarray = math.nan
    position_sigma_mm: float | np.ndarray = math.nan

    @property
    def sentence(self) -> Any:
        """The status in words, and which channels were left out and why: a string, or a list of them."""
        if isinstance(self.status, np.ndarray):
            columns = (self.status, self.left_out, self.channels)
            return [_words(*map(int, values)) for values in zip(*columns, strict=True)]  # type: ignore[arg-type]
        return _words(self.status, int(self.left_out), int(self.channels))


class GaugeSoftness(touch.TouchEstimator):
    """Online estimate of the modulus from all gauges; one sample is (g1, ..., gg, force_N), readings in microstrain.

    A force or reading that is NaN is left out of its sample. A gauge is left out as long as it is stuck, saturated or
    contradicts the others, and the answer names it. Touches are expected at the apex: elsewhere the readings fit no
    modulus, and there is no answer, unless the position is an unknown too (`position_sigma_mm`).

    Parameters
    ----------
    calibration, gauge_sigma, doubts, contact_force_N, saturation, stuck_samples : as `Softness`.
    force_sigma_N : standard deviation of the force's noise, N, > 0; inf without a force sensor.
    position_sigma_mm : contacts lie anywhere along the finger (x, at y = 0), with this standard deviation about the
        apex, > 0, inf if nothing is known; every sample has its own position. The calibration must know contact
        positions, and one channel more is needed. None: at the apex.

    Raises `InputError` for unusable values, and for gauges whose surfaces have different cells.
    """

    answer = GaugeEstimate

    def __init__(
        self,
        calibration: Calibration,
        *,
        gauge_sigma: float,
        force_sigma_N: float,
        doubts: Doubts | None = None,
        contact_force_N: float | None = None,
        saturation: float = math.inf,
        stuck_samples: int = STUCK_SAMPLES,
        position_sigma_mm: float | None = None,
    ):
        gauge_sigma = checks.positive("gauge_sigma (microstrain)", gauge_sigma)
        if not force_sigma_N > 0:
            raise InputError(
                f"force_sigma_N must be greater than 0, or inf without a force sensor, got {force_sigma_N}"
            )
        self._sensed = force_sigma_N < math.inf
        if position_sigma_mm is not None and not position_sigma_mm > 0:
            raise InputError(f"position_sigma_mm must be greater than 0, or None, got {position_sigma_mm}")
        self._anywhere = position_sigma_mm is not None
        surfaces = GaugeSurfaces(calibration, self._anywhere)
        self._least = BLAME_RULES.least_channels + self._anywhere
        if surfaces.channels < self._least - 1:
            raise InputError(f"at least {self._least - 1} gauges are needed, the calibration has {surfaces.channels}")
        fitter = Fitter(surfaces, gauge_sigma, force_sigma_N, doubts or Doubts(), position_sigma_mm)
        self._used: dict[tuple[int, ...], tuple[np.ndarray, int]] = {}
        contact = touch.contact_N(calibration) if contact_force_N is None else contact_force_N
        super().__init__(fitter, surfaces.channels, contact, saturation, stuck_samples)

    def feel(self, readings: tuple[float, ...], force: float, found: tuple[int, ...]) -> GaugeEstimate:
        """The estimate after one more sample; found : its gauges' faults, as `GaugeHealth.check` finds them."""
        faults, memory = self._watched(found, force), self._memory
        rows = self._of(faults)
        y = np.array(self._moved((*readings, force)))
        if not self._in_contact(y, rows[rows < self._gauges], (*readings, force), len(rows) == self._gauges + 1):
            memory.search = None
            return self._refused(SoftnessStatus.NO_CONTACT, faults)
        if len(rows) < self._least:
            return self._refused(SoftnessStatus.BAD_GAUGE, faults)
        # Until the search ends, samples are neither learnt nor answered; another set of faults makes it pointless.
        if memory.search is not None and memory.search.task.faults == faults:
            return self._search(memory.search)
        memory.search = None
        return self._gather(y, faults)

    def _follow(self, y: np.ndarray, faults: tuple[int, ...], posterior: FilterState, fit: NoiseFit) -> GaugeEstimate:
        rows = self._of(faults)
        # The misfit against the filter costs more than the fit, so it is computed only for samples whose own fit is
        # unusual.
        if fit.here > posterior.usual:
            residuals = self._fitter.residuals(y, rows, posterior)
            if residuals.misfit > BLAME_RULES.contradicts:
                return self._contradict(y, faults, posterior, residuals)
        return self._learn(y, rows, faults, posterior, fit)

    def _begin(self, y: np.ndarray, faults: tuple[int, ...]) -> GaugeEstimate:
        rows = self._of(faults)
        if not self._trusted(1):
            return self._refused(SoftnessStatus.MISFIT, faults)
        residuals, posterior = completed(self._start(y, rows, self._unknown()))
        if residuals.misfit > BLAME_RULES.contradicts:
            self._memory.search = SpreadTask(FaultSearch(y, faults, residuals, posterior, False))
            return self._refused(SoftnessStatus.MISFIT, faults)
        return self._learn(y, rows, faults, posterior, self._fitter.noise_fit(y, rows, posterior))

    def _contradict(self, y: np.ndarray, faults: tuple[int, ...], posterior: FilterState, residuals: Residuals):
        """Handle a sample that the fit so far does not explain: a bad channel, another specimen, or an unknown
        cause."""
        if self._trusted():
            self._memory.search = SpreadTask(FaultSearch(y, faults, residuals, posterior, True))
        else:
            # The earlier samples are not trusted either: after a while the touch begins again.
            self._distrust()
        return self._refused(SoftnessStatus.MISFIT, faults)

    def _search(self, search: SpreadTask) -> GaugeEstimate:
        """Do the next piece of a search, and use its result. Until its end no sample is learnt and none has an
        answer."""
        result = search.advance(self)
        if result is None:
            return self._refused(SoftnessStatus.MISFIT, search.task.faults)
        memory, y, faults, (outside, named, posterior) = self._memory, search.task.y, search.task.faults, result
        memory.search = None
        if outside:
            return self._refused(outside, faults)
        if named:
            memory.faults = tuple([named.get(channel, fault) for channel, fault in enumerate(memory.faults)])
            faults = tuple([named.get(channel, fault) for channel, fault in enumerate(faults)])
        rows = self._of(faults)
        if posterior is None:
            self._distrust()
            return self._refused(SoftnessStatus.MISFIT, faults)
        # Explained by a new modulus, not by a fault: this adds to the distrust, because over a texture it happens again
        # and again.
        if not named:
            memory.distrust += BLAME_RULES.unexplained
        return self._learn(y, rows, faults, posterior, self._fitter.noise_fit(y, rows, posterior))

    def _explained(
        self, y: np.ndarray, faults: tuple[int, ...], residuals: Residuals, posterior, later
    ) -> Pieces[tuple]:
        """The result of `Search.run`; see there."""
        rows, anew, begun = self._of(faults), residuals, posterior
        # First: does any modulus explain the sample? Then the specimen may have changed in a lift that nobody saw.
        if later:
            yield
            anew, begun = yield from self._start(y, rows, self._unknown())
        if outside := self._beyond(y, begun):
            return outside, {}, None
        yield
        # If another modulus explains it, a pair of bad channels is the less likely cause: only single channels (and
        # mirrored pairs) are suspected.
        single = later and anew.misfit < BLAME_RULES.contradicts
        misfits = residuals.misfits_without if later else partial(self._start.misfits_without, y, rows, self._unknown())
        blame = yield from self._to_blame(rows, misfits, single=single)
        if blame is None:
            return None, {}, begun if single else None
        yield
        trusted = np.setdiff1d(rows, blame)
        # The first fit of the touch was made with the bad channel: make it again without.
        if not later:
            _, posterior = yield from self._start(y, trusted, self._unknown())
        named = self._named(y, blame, posterior)
        if later:
            yield
            fit = self._fitter.noise_fit(y, trusted, posterior)
            yield
            # The channel explains the misfit only if the others agree with the touch after a fit of their own.
            if self._fitter.residuals(y, trusted, posterior, fit).misfit >= BLAME_RULES.contradicts:
                return None, named, None
        yield
        return None, named, posterior

    def _trusted(self, samples: int = 0) -> bool:
        """Whether the gauges are trusted, after `samples` more samples without a contradiction."""
        memory = self._memory
        if samples and memory.distrust:
            memory.distrust = max(memory.distrust - samples, 0)
            memory.patience = memory.patience if memory.distrust else touch.TOUCH_RULES.patience
        return memory.distrust <= BLAME_RULES.trusted

    def _distrust(self) -> None:
        """Forget the touch and wait; the wait grows by half each time until there are good samples in between."""
        memory = self._memory
        memory.filter, memory.distrust = None, memory.patience
        memory.patience = min(memory.patience + memory.patience // 2, BLAME_RULES.most_patience)

    def _to_blame(self, rows: np.ndarray, misfits, single: bool = False) -> Pieces[tuple[int, ...] | None]:
        """Channels without which the others agree. None if there are none, or if too few channels would be left to
        detect a contradiction.

        misfits : a function of sets of channels: misfits of the others when each set is left out. One channel is tried
        before two, and gauges that mirror each other (one amplifier, one batch of foil) count as one.
        """
        channels = rows.tolist()
        # With so few channels no contradiction can be assigned to one of them.
        if len(channels) <= self._least:
            return None
        groups = (*self._fitter.surfaces.groups, -1)
        pairs = list(combinations(channels, 2))
        alike = [pair for pair in pairs if groups[pair[0]] == groups[pair[1]] and not self._anywhere]
        stages: list[list[tuple[int, ...]]] = [[*((channel,) for channel in channels), *alike]]
        if not single:
            stages.append([pair for pair in pairs if pair not in alike])
        for stage in stages:
            able = [suspect for suspect in stage if len(channels) - len(suspect) >= self._least]
            without = yield from misfits(able)
            agreeing = sorted(pair for pair in zip(without, able, strict=True) if pair[0] < BLAME_RULES.agrees)
            # A pair is not suspected if one of its channels alone explains as much.
            suspects = [
                suspect
                for misfit, suspect in agreeing
                if misfit < agreeing[0][0] + BLAME_RULES.margin
                and not any(set(few) < set(suspect) and less < misfit + BLAME_RULES.margin for less, few in agreeing)
            ]
            # Suspects that explain the misfit equally well cannot be told apart: leave out all of them, if enough
            # remain.
            if suspects:
                blamed = tuple(sorted(set().union(*suspects)))
                return blamed if len(channels) - len(blamed) >= self._least else None
        return None

    def _named(self, y: np.ndarray, blamed: tuple[int, ...], posterior: FilterState) -> dict[int, int]:
        """The fault of each channel at fault: a reversed sign, two exchanged gauges, or else a contradiction."""
        rows = np.flatnonzero(np.isfinite(y[: self._gauges + self._sensed]))
        rest, variance = self._fitter.residuals(y, rows, posterior).expected(*blamed)
        # What the other channels predict for the blamed ones, and within which error: does -y, or the other's y, fit
        # it?
        scale = self._fitter.noise[list(blamed)]
        expected, limit = y[list(blamed)] - rest * scale, BLAME_RULES.explained * variance * scale**2

        def fits(value: float, place: int) -> bool:
            return bool((value - expected[place]) ** 2 < limit[place])

        faults = {channel: int(Fault.OFF_SURFACE) for channel in blamed}
        for place, channel in enumerate(blamed):
            if channel < self._gauges and fits(-y[channel], place):
                faults[channel] = int(Fault.SIGN_FLIPPED)
        for (first, a), (second, b) in combinations(enumerate(blamed), 2):
            if b < self._gauges and fits(y[a], second) and fits(y[b], first):
                faults[a] = faults[b] = int(Fault.SWAPPED)
        return faults

    def _learn(self, y, rows, faults: tuple[int, ...], posterior: FilterState, fit: NoiseFit) -> GaugeEstimate:
        """Take one sample, and answer."""
        if any(self._memory.faults):
            self._watch_returning(y, rows, posterior, fit)
        if outside := self._outside(fit):
            return self._refused(outside, faults)
        # The first sample has been judged by its start; there is nothing else to contradict.
        limit = BLAME_RULES.contradicts if posterior.samples else math.inf
        residuals, self._memory.filter = self._fitter.learn(y, rows, posterior, fit, limit=limit)
        if residuals.misfit > limit:
            return self._contradict(y, faults, posterior, residuals)
        self._trusted(fit.samples)
        return self._answer(fit.ln_force, fit.place_mm, faults)

    def _answer(self, ln_force: float, place: float, faults: tuple[int, ...]) -> GaugeEstimate:
        if not self._trusted():
            return self._refused(SoftnessStatus.MISFIT, faults)
        (modulus, sigma, status), (further, aside) = self._modulus()
        code, posterior = self._used[faults][1], self._memory.filter
        if code and status == SoftnessStatus.OK:
            status = int(SoftnessStatus.LEFT_OUT)
        answer = GaugeEstimate(modulus, sigma, math.exp(ln_force + further), status, code, self._gauges + 1)
        if self._anywhere and posterior and math.isfinite(modulus):
            return answer._replace(position_mm=place + aside, position_sigma_mm=posterior.place_sigma_mm)
        return answer

    def _watch_returning(self, y: np.ndarray, rows: np.ndarray, posterior: FilterState, fit: NoiseFit) -> None:
        """Use a channel again that has fitted for long enough."""
        faults, returning = list(self._memory.faults), list(self._memory.returning)
        for channel, fault in enumerate(faults):
            if fault and math.isfinite(y[channel]):
                every = np.sort(np.append(rows, channel))
                (rest,), (variance,) = self._fitter.residuals(y, every, posterior, fit).expected(channel)
                fits = rest**2 < BLAME_RULES.fits_again * variance
                returning[channel] = returning[channel] + fit.samples if fits else 0
                if returning[channel] >= BLAME_RULES.back_after:
                    faults[channel] = returning[channel] = 0
        self._memory.faults, self._memory.returning = tuple(faults), tuple(returning)

    def _beyond(self, y: np.ndarray, posterior: FilterState) -> SoftnessStatus | None:
        """The status for a force that all sensors place outside the domain, where readings are not calibrated."""
        low, high = self._fitter.surfaces.force_N
        force = float(y[-1]) if self._sensed else math.nan
        if posterior.ln_force <= self._fitter.low and not force >= low:
            return SoftnessStatus.FORCE_BELOW
        return SoftnessStatus.FORCE_ABOVE if posterior.ln_force >= self._fitter.high and not force <= high else None

    def _watched(self, gauge_faults: tuple[int, ...], force: float) -> tuple[int, ...]:
        """Faults of this sample: those that persist, and those that the readings show by themselves."""
        memory, before = self._memory, self._memory.found
        if gauge_faults != before:
            memory.found = gauge_faults
            changes = zip(gauge_faults, before or self._clean, strict=False)
            if any(new == FAULT_STUCK != old for new, old in changes):
                # A gauge has just been recognised as stuck: samples learnt with it, and faults found with it, are void.
                memory.filter, memory.faults, memory.distrust = None, self._clean, 0
        if not gauge_faults and force - force == 0.0:
            return memory.faults
        missing = FAULT_MISSING if self._sensed and force - force != 0.0 else 0
        now = (*(gauge_faults or self._clean[1:]), missing)
        return tuple([new or old for new, old in zip(now, memory.faults, strict=True)])

    def _of(self, faults: tuple[int, ...]) -> np.ndarray:
        """The channels that are used with these faults; kept by the code of the faults."""
        cached = self._used.get(faults)
        if cached is None:
            used = [not fault for fault in faults[:-1]] + [self._sensed and not faults[-1]]
            self._used[faults] = cached = np.flatnonzero(used), pack(faults)
        return cached[0]

    def _refused(self, status: SoftnessStatus, faults: tuple[int, ...]) -> GaugeEstimate:
        """An estimate without a modulus, with the reason as its status."""
        return GaugeEstimate(math.nan, math.nan, math.nan, int(status), self._used[faults][1], self._gauges + 1)


def _words(status: int, left_out: int, channels: int) -> str:
    faults = in_words(left_out, numbered(channels - 1))
    sentence = SoftnessStatus(status).sentence
    return f"{sentence}; {faults}" if faults else sentence
