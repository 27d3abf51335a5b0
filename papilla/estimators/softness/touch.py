"""What both estimators of softness share: the gauges' health, contact, zeros in the air, and the answer of a fit."""

import math
from typing import NamedTuple

import numpy as np

from papilla import checks
from papilla.calibration import IDENTIFIABLE, SoftnessStatus
from papilla.errors import InputError
from papilla.estimators.health import GaugeHealth, HealthState
from papilla.estimators.softness.fitter import Alone, Belief, Fit, Fitter
from papilla.estimators.softness.start import Start

DOUBT_LIMIT = 60.0
"""Squared length of the nuisances from which none of them, and no modulus, is believed."""
AIR_SHARE = 0.5
"""Of the contact force, below which a finger is in the air; what is left of a zero's standard deviation after it."""
LONG, FAR = 50, 8.0
"""Samples in a row without a force after which readings below so many standard deviations of a zero are those of the
air."""
AIR_SAMPLES = 100.0
"""Time constant, in samples, of the gauges' zeros in the air."""


class TouchState(NamedTuple):
    """All that an estimator of softness remembers: the gauges' health, their zeros in microstrain and for how many
    samples they were seen in the air, and what is known of this touch (None in the air).

    faults, returning : per channel (g gauges and the force) the standing `Fault`, and good samples in a row since.
    contradicted : share of the last looks at which what was learnt did not explain the readings. dominant : which doubt
    made most of sigma in the last touch. light : samples in a row with a force below that of contact.
    """

    health: HealthState
    zeros: tuple[float, ...]
    airborne: float = 0.0
    belief: Belief | None = None
    faults: tuple[int, ...] = ()
    returning: tuple[int, ...] = ()
    contradicted: float = 0.0
    dominant: str = ""
    light: int = 0

    @property
    def information(self) -> float:
        """What noise alone tells of the modulus in this touch; 0 where there is none."""
        return self.belief.information if self.belief else 0.0


class Touch:
    """Base of the estimators; `gauges` readings and a force make a sample."""

    def __init__(self, fitter: Fitter, gauges: int, contact_force_N: float, saturation: float, stuck_samples: int):
        self._fitter, self._start, self._gauges = fitter, Start(fitter), gauges
        self._contact = checks.positive("contact_force_N", contact_force_N)
        self._health = GaugeHealth(gauges, saturation, stuck_samples)
        low = fitter.surfaces.force_N[0]
        self._lowest = fitter.least_reading() * (self._contact / low)
        self._clean = (0,) * (gauges + 1)
        self._new = TouchState(self._health.state, (0.0,) * gauges, faults=self._clean, returning=self._clean)
        self.reset()

    @property
    def state(self) -> TouchState:
        """All that the estimator remembers, to be kept or to be set again."""
        return self._state._replace(health=self._health.state, light=self._light)

    @state.setter
    def state(self, state: TouchState) -> None:
        if len(state.zeros) != self._gauges:
            raise InputError(f"the state is of {len(state.zeros)} gauges, the calibration has {self._gauges}")
        self._health.state, self._state, self._light = state.health, state, state.light

    def reset(self) -> None:
        """Forget everything."""
        self.state = self._new

    @property
    def dominant(self) -> str:
        """Which doubt makes most of the modulus' sigma in the last touch, in words; empty before it."""
        return self._fitter.dominant(self._state.belief) if self._state.belief else self._state.dominant

    @property
    def stuck_gauges(self) -> tuple[int, ...]:
        """Numbers (from 0) of the gauges that are stuck now."""
        return self._health.stuck

    def _rows(self, block) -> np.ndarray:
        rows = np.asarray(block, float)
        if rows.ndim != 2 or rows.shape[1] != self._gauges + 1:
            shape = " x ".join(map(str, rows.shape))
            raise InputError(f"a block must be n x {self._gauges + 1} (gauges, then force_N), got {shape}")
        return rows

    def _split(self, sample) -> tuple[list[float], float]:
        *readings, force = map(float, sample)
        if len(readings) != self._gauges:
            raise InputError(f"a sample must be {self._gauges} readings and force_N, got {len(readings) + 1} values")
        return readings, force

    def _is_away(self, moved: np.ndarray, least: np.ndarray, force: float) -> bool:
        """Whether a finger whose force is below that of contact is in the air: readings (less their zeros) are below
        those of contact too; or have been for long, and are not beyond what a zero may have moved."""
        self._light += 1
        square = float(moved @ moved)
        drifted = FAR * self._fitter.doubts.zero_microstrain
        return square < float(least @ least) or (
            self._light > LONG and force == force and square < len(moved) * drifted * drifted
        )

    def _lift(self, readings: list[float], force: float, good: bool) -> None:
        """Contact is lost: what was learnt of the touch is dropped, and in the air the gauges' zeros are learnt."""
        old = self._state
        zeros, airborne = old.zeros, old.airborne
        if good and abs(force) < AIR_SHARE * self._contact:
            airborne = min(airborne + 1, AIR_SAMPLES)
            weight = self._zero_gain(airborne)
            zeros = tuple([zero + (y - zero) * weight for zero, y in zip(zeros, readings, strict=True)])
        if zeros is not old.zeros or old.belief is not None:
            self._state = old._replace(
                zeros=zeros, airborne=airborne, belief=None, contradicted=0.0, dominant=self.dominant
            )

    def _zero_gain(self, samples: float) -> float:
        """Kalman gain of one more reading in the air: zeros that are in no doubt are not learnt from noise."""
        doubted, noise = self._fitter.doubts.zero_microstrain, float(self._fitter.noise[0])
        return doubted**2 / (doubted**2 * samples + noise**2)

    def _fresh(self) -> Belief:
        """What is known at the begin of a touch."""
        return self._fitter.fresh(AIR_SHARE if self._state.airborne >= AIR_SAMPLES / 2 else 1.0)

    def _outside(self, alone: Alone) -> SoftnessStatus | None:
        """The status of a contact outside what is calibrated."""
        fitter = self._fitter
        if not fitter.low <= alone.ln_force <= fitter.high:
            return SoftnessStatus.FORCE_BELOW if alone.ln_force < fitter.low else SoftnessStatus.FORCE_ABOVE
        return SoftnessStatus.OFF_REACH if abs(alone.place_mm) > fitter.surfaces.reach else None

    def _take(self, y: np.ndarray, rows: np.ndarray, belief: Belief, alone: Alone, keep: float = 1.0) -> Fit | None:
        """Learn one more sample; what the filter made of it, where it was its turn."""
        fitter = self._fitter
        belief, due = fitter.heard(belief, alone, y, rows, keep), fitter.due(belief, alone)
        mean, count = belief.heard / belief.waiting, belief.waiting
        if not np.isfinite(mean[rows]).all():
            mean, count = y, 1
        fit = fitter.fit(mean, rows, belief, alone, count) if due else None
        self._state = self._state._replace(belief=fitter.learnt(fit, alone, keep) if fit else belief)
        return fit

    def _modulus(self) -> tuple[float, float, SoftnessStatus]:
        """Modulus and sigma in MPa, and the status of what is known now."""
        fitter, belief = self._fitter, self._state.belief
        assert belief is not None
        if fitter.doubt(belief) > DOUBT_LIMIT:
            return math.nan, math.nan, SoftnessStatus.MISFIT
        h, sigma = fitter.estimate(belief)
        if not 0.0 <= h <= fitter.top:
            return math.nan, math.nan, SoftnessStatus.SOFTER if h < 0 else SoftnessStatus.HARDER
        ln_modulus, slope = fitter.ln_modulus(h)
        relative, modulus = sigma / slope, math.exp(ln_modulus)
        status = SoftnessStatus.NOT_IDENTIFIABLE if relative > IDENTIFIABLE else SoftnessStatus.OK
        return modulus, relative * modulus, status
