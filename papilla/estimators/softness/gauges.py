"""Young's modulus of what the finger presses on, sample by sample, from every gauge against its own surface.

A single gauge needs the force; five of them measure it as well, so a poor force sensor costs little, and one gauge
that contradicts the others is found and left out, where nothing else explains it.
"""

import math
from collections.abc import Callable
from itertools import combinations
from typing import NamedTuple

import numpy as np

from papilla import checks
from papilla.calibration import Calibration, SoftnessStatus
from papilla.errors import InputError
from papilla.estimators.health import MISSING, STUCK, STUCK_SAMPLES, Fault, in_words, numbered, pack
from papilla.estimators.softness.belief import Alone, Belief, Contrast
from papilla.estimators.softness.doubts import Doubts
from papilla.estimators.softness.fitter import Fitter
from papilla.estimators.softness.surfaces import GaugeSurfaces
from papilla.estimators.softness.touch import PATIENCE, Search, Touch, TouchState
from papilla.estimators.spread import Pieces, completed

LEAST_CHANNELS = 3
"""Readings and force: two unknowns, and one that can contradict."""
LIMIT = 40.0
"""Squared misfit of a sample (at most 5 degrees of freedom) from which something is wrong: 1e-7 of good samples."""
AGREES = 20.0
"""Squared misfit below which the remaining channels agree."""
MARGIN = 10.0
"""Suspects whose absence leaves as good a fit as this, compared with the best, cannot be told apart."""
FITS = 25.0
"""Squared residual of a reading that is explained by a flipped sign or by another gauge's place."""
DOUBTED, TRUSTED, MOST = 80, 200, 1920
"""Distrust, in good samples that make up for it: what a contradiction adds that no gauge is to blame for; beyond which
there is no answer, and nobody is blamed, for over a texture all gauges contradict each other; and the most of it."""
BACK_AFTER = 10
"""Samples in a row that a channel must fit again to be used again."""
FITS_AGAIN = 16.0
"""Squared residual of such a sample."""


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
    def sentence(self):
        """The status in words, and which channels were left out why: a string, or a list of them."""
        if isinstance(self.status, np.ndarray):
            columns = (self.status, self.left_out, self.channels)
            return [_words(*map(int, row)) for row in zip(*columns, strict=True)]  # type: ignore[arg-type]
        return _words(self.status, int(self.left_out), int(self.channels))


def at_once(misfits) -> Callable[[list[tuple[int, ...]]], Pieces[list[float]]]:
    """The same function, as a computation of one part."""

    def parts(some: list[tuple[int, ...]]) -> Pieces[list[float]]:
        yield
        return misfits(some)

    return parts


class GaugeSoftness(Touch):
    """Streaming modulus from all gauges; one sample is (g1, ..., gg, force_N), readings in microstrain.

    A force or a reading that is NaN is left out of its sample; a gauge that is stuck, saturated or contradicts the
    others is left out as long as it is, and the answer says which. Touches are expected at the apex: elsewhere the
    readings fit no modulus, and there is no answer, unless the position is an unknown too (`position_sigma_mm`).

    Parameters
    ----------
    calibration, gauge_sigma, doubts, contact_force_N, saturation, stuck_samples : as `Softness`.
    force_sigma_N : standard deviation of the force's noise, N, > 0; inf where there is no force sensor.
    position_sigma_mm : contacts lie anywhere along the finger (x, at y = 0), with this standard deviation about the
        apex, > 0, inf where nothing is known; every sample has its own position. The calibration must know contact
        positions, and one channel more is needed. None: at the apex.

    Raises `InputError` for unusable values, and for gauges whose surfaces are cut differently.
    """

    answer = GaugeEstimate

    def __init__(
        self,
        calibration: Calibration,
        *,
        gauge_sigma: float,
        force_sigma_N: float,
        doubts: Doubts | None = None,
        contact_force_N: float = 0.02,
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
        self._least = LEAST_CHANNELS + self._anywhere
        if surfaces.channels < self._least - 1:
            raise InputError(f"at least {self._least - 1} gauges are needed, the calibration has {surfaces.channels}")
        fitter = Fitter(surfaces, gauge_sigma, force_sigma_N, doubts or Doubts(), position_sigma_mm)
        self._found: Search | None = None
        self._used: dict[tuple[int, ...], tuple[np.ndarray, int]] = {}
        super().__init__(fitter, surfaces.channels, contact_force_N, saturation, stuck_samples)

    def feel(self, readings: tuple[float, ...], force: float, found: tuple[int, ...]) -> GaugeEstimate:
        """The estimate after one more sample, of which somebody has looked at the gauges' health (`GaugeHealth`)."""
        faults = self._watched(found, force)
        rows = self._of(faults)
        y = np.array(self._moved((*readings, force)))
        # A light force alone does not end a touch, nor does the zero of the force begin one: the gauges have to agree.
        if y[-1] >= self._low:
            self._light = 0
        else:
            gauges = rows[rows < self._gauges]
            if not len(gauges) or self._is_away(y[gauges], self._lowest[gauges], y[-1]):
                self._found = None
                self._lift((*readings, force), len(rows) == self._gauges + 1)
                return self._refused(SoftnessStatus.NO_CONTACT, faults)
        self._land()
        if len(rows) < self._least:
            return self._refused(SoftnessStatus.BAD_GAUGE, faults)
        if self._found is not None and self._found.faults == faults:
            return self._searched(self._found)
        self._found = None
        return self._listen(y, faults)

    def _follow(self, y: np.ndarray, faults: tuple[int, ...], belief: Belief, alone: Alone) -> GaugeEstimate:
        """A mean of samples of a touch that is known already."""
        rows = self._of(faults)
        if alone.here > belief.usual:
            contrast = self._fitter.contrast(y, rows, belief)
            if contrast.misfit > LIMIT:
                return self._contradict(y, faults, belief, contrast)
        return self._learn(y, rows, faults, belief, alone)

    def _begin(self, y: np.ndarray, faults: tuple[int, ...]) -> GaugeEstimate:
        """The first sample of a touch, or the first that fits."""
        rows = self._of(faults)
        if not self._trusted(1):
            return self._refused(SoftnessStatus.MISFIT, faults)
        contrast, belief = completed(self._start(y, rows, self._unknown()))
        if contrast.misfit > LIMIT:
            self._search(Search(y, faults, contrast, belief, False))
            return self._refused(SoftnessStatus.MISFIT, faults)
        return self._learn(y, rows, faults, belief, self._fitter.alone(y, rows, belief))

    def _contradict(self, y: np.ndarray, faults: tuple[int, ...], belief: Belief, contrast: Contrast) -> GaugeEstimate:
        """A sample that what was learnt does not explain: a bad channel, another specimen, or nothing that is known."""
        if self._trusted():
            self._search(Search(y, faults, contrast, belief, True))
        else:
            # What was learnt is not to be believed either: after a while, from the beginning.
            self._distrust()
        return self._refused(SoftnessStatus.MISFIT, faults)

    def _search(self, search: Search | None) -> None:
        """Look from the next sample on for what explains one that nothing does."""
        self._found = search
        self._going = self._explained(search) if search else None

    def _searched(self, search: Search) -> GaugeEstimate:
        """Do the next part of a search; no sample is learnt, and none has an answer, before its end."""
        self._found = search._replace(parts=search.parts + 1)
        try:
            next(self._going)  # type: ignore[arg-type]
        except StopIteration as told:
            self._found = None
            return self._conclude(search.y, search.faults, *told.value)
        return self._refused(SoftnessStatus.MISFIT, search.faults)

    def _explained(self, search: Search) -> Pieces[tuple]:
        """The status of a force that is out of the domain; what is said of the channels to blame; and the belief with
        which the sample is to be learnt: None where nothing explains it. Nothing is remembered of it before its end."""
        y, faults, contrast, belief, known, _ = search
        rows, misfits, anew, begun = self._of(faults), self._start.without, contrast, belief
        if known:
            yield
            anew, begun = yield from self._start(y, rows, self._unknown())
        if outside := self._beyond(y, begun):
            return outside, {}, None
        yield
        single = known and anew.misfit < LIMIT
        looked = at_once(contrast.without) if known else misfits(y, rows, self._unknown())
        blame = yield from self._blamed(rows, looked, single=single)
        if blame is None:
            return None, {}, begun if single else None
        yield
        left = np.setdiff1d(rows, blame)
        if not known:
            _, belief = yield from self._start(y, left, self._unknown())
        named = self._named(y, blame, belief)
        if known:
            yield
            alone = self._fitter.alone(y, left, belief)
            yield
            if self._fitter.contrast(y, left, belief, alone).misfit >= LIMIT:
                return None, named, None
        yield
        return None, named, belief

    def _conclude(self, y, faults: tuple[int, ...], outside, named: dict[int, int], belief) -> GaugeEstimate:
        """Take what a search found."""
        if outside:
            return self._refused(outside, faults)
        if named:
            self._note(faults=tuple([named.get(channel, fault) for channel, fault in enumerate(self._state.faults)]))
            faults = tuple([named.get(channel, fault) for channel, fault in enumerate(faults)])
        rows = self._of(faults)
        if belief is None:
            self._distrust()
            return self._refused(SoftnessStatus.MISFIT, faults)
        if not named:
            self._note(contradicted=self._state.contradicted + DOUBTED)
        return self._learn(y, rows, faults, belief, self._fitter.alone(y, rows, belief))

    def _snapshot(self) -> TouchState:
        return super()._snapshot()._replace(search=self._found)

    def _remember(self, memory: TouchState) -> None:
        super()._remember(memory)
        self._search(memory.search)
        for _ in range(memory.search.parts if memory.search else 0):
            next(self._going)  # type: ignore[arg-type]

    def _trusted(self, samples: int = 0) -> bool:
        """Whether the gauges may be believed, after so many more samples that nothing contradicts."""
        if samples and self._state.contradicted:
            left = max(self._state.contradicted - samples, 0)
            self._note(contradicted=left, patience=self._state.patience if left else PATIENCE)
        return self._state.contradicted <= TRUSTED

    def _distrust(self) -> None:
        """Wait, and longer the next time if nothing good comes in between."""
        patience = self._state.patience
        self._note(belief=None, contradicted=patience, patience=min(patience + patience // 2, MOST))

    def _blamed(self, rows: np.ndarray, misfits, single: bool = False) -> Pieces[tuple[int, ...] | None]:
        """Channels without which the others agree; None where there are none, or too few are left to contradict.

        misfits : those of the others when each of some sets of channels is left out. One channel comes before two, and
        gauges that mirror each other (one amplifier, one batch of foil) count as one.
        """
        channels = rows.tolist()
        if len(channels) <= self._least:
            return None
        groups = (*self._fitter.surfaces.groups, -1)
        pairs = list(combinations(channels, 2))
        alike = [pair for pair in pairs if groups[pair[0]] == groups[pair[1]] and not self._anywhere]
        stages: list[list[tuple[int, ...]]] = [[*((channel,) for channel in channels), *alike]]
        if not single:
            stages.append([pair for pair in pairs if pair not in alike])
        for stage in stages:
            able = [own for own in stage if len(channels) - len(own) >= self._least]
            left = yield from misfits(able)
            found = sorted(pair for pair in zip(left, able, strict=True) if pair[0] < AGREES)
            # A pair with a channel that explains as much on its own is no rival to it.
            rivals = [
                own
                for left, own in found
                if left < found[0][0] + MARGIN
                and not any(set(other) < set(own) and less < left + MARGIN for less, other in found)
            ]
            if rivals:
                blamed = tuple(sorted(set().union(*rivals)))
                return blamed if len(channels) - len(blamed) >= self._least else None
        return None

    def _named(self, y: np.ndarray, blamed: tuple[int, ...], belief: Belief) -> dict[int, int]:
        """What can be said of a fault: a flipped sign, two gauges in each other's place, or that it contradicts."""
        rows = np.flatnonzero(np.isfinite(y[: self._gauges + self._sensed]))
        rest, variance = self._fitter.contrast(y, rows, belief).expected(*blamed)
        scale = self._fitter.noise[list(blamed)]
        expected, limit = y[list(blamed)] - rest * scale, FITS * variance * scale**2

        def fits(value: float, place: int) -> bool:
            return bool((value - expected[place]) ** 2 < limit[place])

        found = {channel: int(Fault.OFF_SURFACE) for channel in blamed}
        for place, channel in enumerate(blamed):
            if channel < self._gauges and fits(-y[channel], place):
                found[channel] = int(Fault.SIGN_FLIPPED)
        for (one, a), (other, b) in combinations(enumerate(blamed), 2):
            if b < self._gauges and fits(y[a], other) and fits(y[b], one):
                found[a] = found[b] = int(Fault.SWAPPED)
        return found

    def _learn(self, y, rows, faults: tuple[int, ...], belief: Belief, alone: Alone) -> GaugeEstimate:
        """Take one sample, and answer."""
        if any(self._state.faults):
            self._watch_returning(y, rows, belief, alone)
        if outside := self._outside(alone):
            return self._refused(outside, faults)
        limit = LIMIT if belief.samples else math.inf
        contrast = self._learnt(y, rows, belief, alone, limit=limit)
        if contrast.misfit > limit:
            return self._contradict(y, faults, belief, contrast)
        self._trusted(alone.samples)
        return self._answer(alone.ln_force, alone.place_mm, faults)

    def _answer(self, ln_force: float, place: float, faults: tuple[int, ...]) -> GaugeEstimate:
        if not self._trusted():
            return self._refused(SoftnessStatus.MISFIT, faults)
        told, code = self._modulus(), self._used[faults][1]
        status = int(SoftnessStatus.LEFT_OUT) if code and told.status == SoftnessStatus.OK else told.status
        force, channels = math.exp(ln_force + told.ln_force), self._gauges + 1
        if not self._anywhere or told.modulus != told.modulus:
            return GaugeEstimate(told.modulus, told.sigma, force, status, code, channels)
        place += told.place_mm
        return GaugeEstimate(told.modulus, told.sigma, force, status, code, channels, place, told.place_sigma_mm)

    def _watch_returning(self, y: np.ndarray, rows: np.ndarray, belief: Belief, alone: Alone) -> None:
        """Use a channel again that has fitted `BACK_AFTER` samples in a row."""
        faults, returning = list(self._state.faults), list(self._state.returning)
        for channel, fault in enumerate(faults):
            if fault and math.isfinite(y[channel]):
                whole = np.sort(np.append(rows, channel))
                rest, variance = self._fitter.contrast(y, whole, belief, alone).expected(channel)
                returning[channel] = (
                    returning[channel] + alone.samples if rest[0] ** 2 < FITS_AGAIN * variance[0] else 0
                )
                if returning[channel] >= BACK_AFTER:
                    faults[channel] = returning[channel] = 0
        self._note(faults=tuple(faults), returning=tuple(returning))

    def _beyond(self, y: np.ndarray, belief: Belief) -> SoftnessStatus | None:
        """The status of a force that all sensors place outside the domain, where nothing is known of the readings."""
        low, high = self._fitter.surfaces.force_N
        force = float(y[-1]) if self._sensed else math.nan
        if belief.ln_force <= self._fitter.low and not force >= low:
            return SoftnessStatus.FORCE_BELOW
        return SoftnessStatus.FORCE_ABOVE if belief.ln_force >= self._fitter.high and not force <= high else None

    def _watched(self, found: tuple[int, ...], force: float) -> tuple[int, ...]:
        """Faults of this sample: those that stand, and what the readings alone show."""
        before = self._state.found
        if found != before:
            self._note(found=found)
            if any(new == STUCK and old != STUCK for new, old in zip(found, before or self._clean, strict=False)):
                # A gauge has just turned out to be stuck: what was learnt with it, and whom it had blamed, is void.
                self._note(belief=None, faults=self._clean, contradicted=0)
        standing = self._state.faults
        if not found and force - force == 0.0:
            return standing
        missing = MISSING if self._sensed and force - force != 0.0 else 0
        now = (*(found or self._clean[1:]), missing)
        return tuple([new or old for new, old in zip(now, standing, strict=True)])

    def _of(self, faults: tuple[int, ...]) -> np.ndarray:
        """The channels that are used with such faults, looked up the next time."""
        known = self._used.get(faults)
        if known is None:
            used = [not fault for fault in faults[:-1]] + [self._sensed and not faults[-1]]
            self._used[faults] = known = np.flatnonzero(used), pack(faults)
        return known[0]

    def _refused(self, status: SoftnessStatus, faults: tuple[int, ...]) -> GaugeEstimate:
        """No modulus, and why."""
        return GaugeEstimate(math.nan, math.nan, math.nan, int(status), self._used[faults][1], self._gauges + 1)


def _words(status: int, left_out: int, channels: int) -> str:
    faults = in_words(left_out, numbered(channels - 1))
    sentence = SoftnessStatus(status).sentence
    return f"{sentence}; {faults}" if faults else sentence
