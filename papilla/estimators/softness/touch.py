"""What both estimators of softness share: the gauges' health, contact, zeros in the air, and the answer of a fit."""

import math
from abc import abstractmethod
from typing import NamedTuple

import numpy as np

from papilla import checks
from papilla.calibration import IDENTIFIABLE, SoftnessStatus
from papilla.errors import InputError
from papilla.estimators.health import GaugeHealth, HealthState, numbered
from papilla.estimators.softness.belief import Alone, Belief, Contrast, Tangent
from papilla.estimators.softness.fitter import Fitter
from papilla.estimators.softness.start import Start
from papilla.estimators.stream import Stream

DOUBT_LIMIT = 60.0
"""Squared length of the nuisances from which none of them, and no modulus, is believed."""
AIR_SHARE = 0.5
"""What is left of the standard deviation of a zero once it was seen in the air: it drifts in the touch too."""
REST_SAMPLES, REST_SHARE, REST_LIMIT = 20, 0.05, 4.0
"""Means of so many samples (a period of 50 Hz at 1 kHz) are of the air where two in a row agree: their squared
difference over that of noise and of this share of the doubts is at most so much a channel. A press of 10 mN/s moves the
middle gauge by 10 microstrain from one to the next, a twentieth of what its zero is doubted by."""
LONG, FAR = 50, 8.0
"""Samples in a row without a force after which readings below so many standard deviations of a zero are those of the
air."""
PATIENCE = 480
"""Distrust of the gauges when for the first time nothing explains them, in good samples that make up for it."""
AIR_SAMPLES = 100.0
"""Time constant, in samples, of the zeros in the air."""


class Rest(NamedTuple):
    """Samples in the air that are not yet learnt: their sum (g + 1,) and number, and the mean of those before, if any.

    They are learnt only when those after them agree, so that no begin of a press is ever taken for a zero.
    """

    total: np.ndarray | float = 0.0
    samples: int = 0
    before: np.ndarray | None = None


class Slot(NamedTuple):
    """Samples that are learnt together: their sum (c + 1,), their number, the (lowest, highest) steps from the tangent
    that they may have, the faults that all of them have, and once there are enough what noise alone makes of them."""

    total: np.ndarray
    samples: int
    reach: tuple[tuple[float, float], ...]
    faults: tuple[int, ...]
    alone: Alone | None = None


class Search(NamedTuple):
    """For what explains a sample (c + 1,) with these faults that nothing does: what it says against a belief, which is
    known or, in the first sample of a touch, begun with it; and how many parts of the search are done."""

    y: np.ndarray
    faults: tuple[int, ...]
    contrast: Contrast
    belief: Belief
    known: bool
    parts: int = 0


class Told(NamedTuple):
    """What is known of a touch, in words of the answer: modulus and sigma in MPa (NaN where there is none), status; by
    how much ln force and place differ from those of noise alone, and the latter's standard deviation."""

    modulus: float
    sigma: float
    status: int
    ln_force: float
    place_mm: float
    place_sigma_mm: float


class TouchState(NamedTuple):
    """All that an estimator of softness remembers: the gauges' health; the zeros of the channels (microstrain, and N),
    for how many samples they were seen in the air, and what of the air is not yet learnt; what is known of this touch
    (None in the air), and the samples of it that are not yet learnt.

    faults, returning : per channel (g gauges and the force) the standing `Fault`, and good samples in a row since.
    found : what the last sample's readings showed by themselves. contradicted : distrust of the gauges, from how often
    what was learnt did not explain them; patience : how much of it there will be when nothing explains them. dominant :
    which doubt made most of sigma in the last touch. light : samples in a row with a force below that of contact.
    search : the one under way, if any.
    """

    health: HealthState
    zeros: tuple[float, ...]
    airborne: float = 0.0
    rest: Rest = Rest()
    belief: Belief | None = None
    slot: Slot | None = None
    faults: tuple[int, ...] = ()
    returning: tuple[int, ...] = ()
    found: tuple[int, ...] = ()
    contradicted: int = 0
    patience: int = PATIENCE
    dominant: str = ""
    light: int = 0
    search: Search | None = None

    @property
    def information(self) -> float:
        """What noise alone tells of the modulus in this touch; 0 where there is none."""
        return self.belief.information if self.belief else 0.0


class Touch(Stream):
    """Base of the estimators; `gauges` readings and a force make a sample.

    A sample without an answer (status says why) leaves what was learnt untouched, except that lost contact ends it.
    """

    def __init__(self, fitter: Fitter, gauges: int, contact_force_N: float, saturation: float, stuck_samples: int):
        self._fitter, self._start, self._gauges = fitter, Start(fitter), gauges
        self.columns = (*numbered(gauges), "force_N")
        self._contact = checks.positive("contact_force_N", contact_force_N)
        self._health = GaugeHealth(gauges, saturation, stuck_samples)
        self._low = max(self._contact, fitter.surfaces.force_N[0])
        self._lowest = fitter.least_reading() * (self._contact / fitter.surfaces.force_N[0])
        # S_d has the noise and the zero of a gauge over the root of their number.
        each = np.append(np.full(gauges, math.sqrt(gauges / fitter.channels)), 1.0)
        self._zero_noise = each * fitter.noise[[0] * gauges + [-1]]
        self._zero_sigma = each * ([fitter.doubts.zero_microstrain] * gauges + [fitter.doubts.force_offset_N])
        self._clean = (0,) * (gauges + 1)
        self._new = TouchState(self._health.state, (0.0,) * (gauges + 1), faults=self._clean, returning=self._clean)
        self.reset()

    def _take(self, sample: tuple[float, ...]):
        *readings, force = sample
        return self.feel(tuple(readings), force, self._health.look(tuple(readings)))

    @abstractmethod
    def feel(self, readings: tuple[float, ...], force: float, found: tuple[int, ...]):
        """The estimate after one more sample, of which somebody has looked at the gauges' health (`GaugeHealth`)."""

    def _fresh(self) -> TouchState:
        return self._new

    def _snapshot(self) -> TouchState:
        return self._state._replace(health=self._health.state, light=self._light, slot=self._slot)

    def _remember(self, memory: TouchState) -> None:
        if len(memory.zeros) != self._gauges + 1:
            raise InputError(f"the state is of {len(memory.zeros) - 1} gauges, the calibration has {self._gauges}")
        self._health.state, self._state, self._light = memory.health, memory, memory.light
        self._slot = memory.slot
        self._told: Told | None = None
        self._tangent: Tangent | None = None

    def _note(self, **changes) -> None:
        """Remember what has changed."""
        self._state, self._told = self._state._replace(**changes), None

    @property
    def dominant(self) -> str:
        """Which doubt makes most of the modulus' sigma in the last touch, in words; empty before it."""
        return self._fitter.dominant(self._state.belief) if self._state.belief else self._state.dominant

    def _is_away(self, moved: np.ndarray, least: np.ndarray, force: float) -> bool:
        """Whether a finger is in the air whose force (less its zero) is below those that are calibrated: readings (less
        their zeros) are below those of contact, so that the force is a zero; or, below the force of contact, they have
        been for long what zeros may have moved by."""
        self._light = 0 if force >= self._contact else self._light + 1
        square = float(moved @ moved)
        drifted = FAR * self._fitter.doubts.zero_microstrain
        return square < float(least @ least) or (
            self._light > LONG and force == force and square < len(moved) * drifted * drifted
        )

    def _lift(self, sample: tuple[float, ...], good: bool) -> None:
        """Contact is lost: what was learnt of the touch is dropped, and in the air the zeros are learnt."""
        self._slot = None
        if self._state.belief is not None:
            self._note(belief=None, contradicted=0, patience=PATIENCE, dominant=self.dominant)
        if good:
            total, samples, before = self._state.rest
            total, samples = total + np.array(sample), samples + 1
            full = samples == REST_SAMPLES
            self._note(rest=self._rested(total / samples, before) if full else Rest(total, samples, before))

    def _rested(self, mean: np.ndarray, before: np.ndarray | None) -> Rest:
        """Learn the zeros (g + 1,) of the means before, if those after them agree; what is then not yet learnt."""
        if before is not None:
            noise = self._zero_noise**2 / REST_SAMPLES
            apart = (mean - before) ** 2 / (2 * noise + (REST_SHARE * self._zero_sigma) ** 2)
            if apart.mean() <= REST_LIMIT:
                # Kalman gain of one more mean: zeros that are in no doubt are not learnt from noise.
                zeros, airborne = np.array(self._state.zeros), self._state.airborne
                known, doubted = airborne / REST_SAMPLES + 1, self._zero_sigma**2
                zeros += (before - zeros) * doubted / (doubted * known + noise)
                airborne = min(airborne + REST_SAMPLES, AIR_SAMPLES)
                self._note(zeros=tuple(zeros.tolist()), airborne=airborne)
        return Rest(before=mean)

    def _land(self) -> None:
        """In contact: what was just taken for the air may have been the begin of the press."""
        if self._state.rest.samples or self._state.rest.before is not None:
            self._note(rest=Rest())

    def _moved(self, sample: tuple[float, ...]) -> list[float]:
        """Readings and force less their zeros; in plain numbers, as arrays cost more for so few."""
        return [value - zero for value, zero in zip(sample, self._state.zeros, strict=True)]

    def _unknown(self) -> Belief:
        """What is known at the begin of a touch."""
        return self._fitter.fresh(AIR_SHARE if self._state.airborne >= AIR_SAMPLES / 2 else 1.0)

    def _outside(self, alone: Alone) -> SoftnessStatus | None:
        """The status of a contact outside what is calibrated."""
        fitter = self._fitter
        if not fitter.low <= alone.ln_force <= fitter.high:
            return SoftnessStatus.FORCE_BELOW if alone.ln_force < fitter.low else SoftnessStatus.FORCE_ABOVE
        return SoftnessStatus.OFF_REACH if abs(alone.place_mm) > fitter.surfaces.reach else None

    @abstractmethod
    def _of(self, faults: tuple[int, ...]) -> np.ndarray:
        """The channels that are used with such faults."""

    @abstractmethod
    def _begin(self, y: np.ndarray, faults: tuple[int, ...]):
        """The answer after the first sample (c + 1,) of a touch."""

    @abstractmethod
    def _follow(self, y: np.ndarray, faults: tuple[int, ...], belief: Belief, alone: Alone):
        """The answer after a mean of samples of a touch that is known already, and what noise alone makes of it."""

    @abstractmethod
    def _answer(self, ln_force: float, place: float, faults: tuple[int, ...]):
        """The answer of what is known, at a contact as noise alone has it."""

    def _listen(self, y: np.ndarray, faults: tuple[int, ...]):
        """The answer after one more sample: most are like the one before, and wait until their slot is full."""
        belief, slot, flushed = self._state.belief, self._slot, False
        if slot and belief and (slot.alone or slot.faults != faults or not self._steps(y, faults, belief, slot)):
            self._follow(slot.total / slot.samples, slot.faults, belief, slot.alone or self._alone(slot, belief))
            belief, slot, flushed = self._state.belief, None, True
        self._slot = slot
        if belief is None:
            return self._begin(y, faults)
        size, steps = self._fitter.slot(belief), self._steps(y, faults, belief, slot)
        if steps is None:
            alone = self._fitter.alone(y, self._of(faults), belief)
            odd = alone.here > belief.usual or self._outside(alone)
            if odd or not flushed or self._fitter.channels == 1:
                return self._follow(y, faults, belief, alone)
            # It is learnt beside the next sample: none has to wait for two.
            self._slot = Slot(y, 1, (), faults, alone)
            return self._answer(alone.ln_force, alone.place_mm, faults)
        tangent = self._near(belief, self._of(faults))
        if slot:
            slot = Slot(slot.total + y, slot.samples + 1, slot.reach, faults)
        else:
            slot = Slot(y, 1, tangent.about(steps), faults)
        if slot.samples >= size:
            # The rest of it is done beside the next sample: neither then costs too much.
            slot = slot._replace(alone=self._alone(slot, belief))
        self._slot = slot
        at, place, *_ = tangent.linear.at
        return self._answer(at + steps[0], place + steps[1], faults)

    def _steps(self, y, faults: tuple[int, ...], belief: Belief, slot: Slot | None) -> tuple[float, float] | None:
        """Steps from the tangent to a sample that is like those of the slot, or begins one; None for another."""
        if self._fitter.slot(belief) <= 1:
            return None
        tangent = self._near(belief, self._of(faults))
        return tangent.steps(y, slot.reach if slot else tangent.reach, belief.usual)

    def _alone(self, slot: Slot, belief: Belief) -> Alone:
        """What noise alone makes of a slot."""
        return self._fitter.alone(slot.total / slot.samples, self._of(slot.faults), belief, slot.samples)

    def _near(self, belief: Belief, rows: np.ndarray) -> Tangent:
        """The tangent of a touch, for these channels."""
        known = self._tangent
        if known is None or known.linear is not belief.linear or known.rows is not rows:
            assert belief.linear is not None
            self._tangent = known = self._fitter.tangent(belief.linear, rows)
        return known

    def _learnt(self, y: np.ndarray, rows: np.ndarray, belief: Belief, alone: Alone, **options: float) -> Contrast:
        """Learn a mean of samples, with the options of `Fitter.learn`; what it says against what was known."""
        contrast, learnt = self._fitter.learn(y, rows, belief, alone, **options)
        self._note(belief=learnt)
        return contrast

    def _modulus(self) -> Told:
        """What is known now, worked out when it is asked for."""
        if self._told is None:
            self._told = self._worked_out()
        return self._told

    def _worked_out(self) -> Told:
        fitter, belief = self._fitter, self._state.belief
        assert belief is not None
        modulus, sigma, offset = math.nan, math.nan, (0.0, 0.0) if fitter.stands(belief) else belief.offset
        h, sigma_h = fitter.estimate(belief)
        if float(belief.mean[1:] @ belief.mean[1:]) > DOUBT_LIMIT:
            status = SoftnessStatus.MISFIT
        elif not 0.0 <= h <= fitter.top:
            status = SoftnessStatus.SOFTER if h < 0 else SoftnessStatus.HARDER
        else:
            ln_modulus, slope = fitter.ln_modulus(h)
            modulus, relative = math.exp(ln_modulus), sigma_h / slope
            sigma = relative * modulus
            status = SoftnessStatus.NOT_IDENTIFIABLE if relative > IDENTIFIABLE else SoftnessStatus.OK
        return Told(modulus, sigma, int(status), *offset, belief.place_sigma_mm)
