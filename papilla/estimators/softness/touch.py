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
"""Of the contact force, below which a finger is in the air; what is left of a zero's standard deviation after it."""
LONG, FAR = 50, 8.0
"""Samples in a row without a force after which readings below so many standard deviations of a zero are those of the
air."""
PATIENCE = 480
"""Distrust of the gauges when for the first time nothing explains them, in good samples that make up for it."""
AIR_SAMPLES = 100.0
"""Time constant, in samples, of the gauges' zeros in the air."""


class Slot(NamedTuple):
    """Samples that are learnt together: their sum (c + 1,), their number, the (lowest, highest) steps from the tangent
    that they may have, the faults that all of them have, and once there are enough what noise alone makes of them."""

    total: np.ndarray
    samples: int
    reach: tuple[tuple[float, float], ...]
    faults: tuple[int, ...]
    alone: Alone | None = None


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
    """All that an estimator of softness remembers: the gauges' health, their zeros in microstrain and for how many
    samples they were seen in the air, what is known of this touch (None in the air), and the samples that are not yet
    learnt.

    faults, returning : per channel (g gauges and the force) the standing `Fault`, and good samples in a row since.
    found : what the last sample's readings showed by themselves. contradicted : distrust of the gauges, from how often
    what was learnt did not explain them; patience : how much of it there will be when nothing explains them. dominant :
    which doubt made most of sigma in the last touch. light : samples in a row with a force below that of contact.
    """

    health: HealthState
    zeros: tuple[float, ...]
    airborne: float = 0.0
    belief: Belief | None = None
    slot: Slot | None = None
    faults: tuple[int, ...] = ()
    returning: tuple[int, ...] = ()
    found: tuple[int, ...] = ()
    contradicted: int = 0
    patience: int = PATIENCE
    dominant: str = ""
    light: int = 0

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
        low = fitter.surfaces.force_N[0]
        self._lowest = fitter.least_reading() * (self._contact / low)
        self._clean = (0,) * (gauges + 1)
        self._new = TouchState(self._health.state, (0.0,) * gauges, faults=self._clean, returning=self._clean)
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
        if len(memory.zeros) != self._gauges:
            raise InputError(f"the state is of {len(memory.zeros)} gauges, the calibration has {self._gauges}")
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
        """Whether a finger whose force is below that of contact is in the air: readings (less their zeros) are below
        those of contact too; or have been for long, and are not beyond what a zero may have moved."""
        self._light += 1
        square = float(moved @ moved)
        drifted = FAR * self._fitter.doubts.zero_microstrain
        return square < float(least @ least) or (
            self._light > LONG and force == force and square < len(moved) * drifted * drifted
        )

    def _lift(self, readings: tuple[float, ...], force: float, good: bool) -> None:
        """Contact is lost: what was learnt of the touch is dropped, and in the air the gauges' zeros are learnt."""
        old = self._state
        zeros, airborne = old.zeros, old.airborne
        if good and abs(force) < AIR_SHARE * self._contact:
            airborne = min(airborne + 1, AIR_SAMPLES)
            # Kalman gain of one more reading: zeros that are in no doubt are not learnt from noise.
            doubted, noise = self._fitter.doubts.zero_microstrain, float(self._fitter.noise[0])
            weight = doubted**2 / (doubted**2 * airborne + noise**2)
            zeros = tuple([zero + (y - zero) * weight for zero, y in zip(zeros, readings, strict=True)])
        self._slot = None
        if zeros is not old.zeros or old.belief is not None:
            self._note(
                zeros=zeros, airborne=airborne, belief=None, contradicted=0, patience=PATIENCE, dominant=self.dominant
            )

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
        belief, slot = self._state.belief, self._slot
        if belief is None:
            self._slot = None
            return self._begin(y, faults)
        size, steps = self._fitter.slot(belief), None
        if size > 1 and (slot is None or (slot.faults == faults and slot.alone is None)):
            tangent = self._near(belief, self._of(faults))
            steps = tangent.steps(y, slot.reach if slot else tangent.reach, belief.usual)
        if steps is None:
            if slot is None:
                return self._follow(y, faults, belief, self._fitter.alone(y, self._of(faults), belief))
            self._slot, mean = None, slot.total / slot.samples
            self._follow(mean, slot.faults, belief, slot.alone or self._alone(slot, belief))
            return self._listen(y, faults)
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
