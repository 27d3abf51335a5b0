"""Offset of the tangential force: what the sensor reads without a load, from air, turns and rests.

Steady sliding one way does not tell it from friction. A regression of T over N seems to, and errs by many times its own
sigma, because mu changes with N (N^(-n) for a soft contact) and by chance together with N. What does tell it:

- air: T without contact;
- turns: the offset with which mu is the same both ways, but for the anisotropy of the skin;
- a rest before and after which T differs by more than half of itself: the finger was let go of. A finger that was held
  may look so, therefore a rest counts only until there is air or a turn.

Repetition does not lessen what each may be wrong by. So each source is one `Reading`, and the offset is their weighted
mean with the prior.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

ANISOTROPY = 0.08
"""Prior standard deviation of mu_+ - mu_-, over their mean: a worn skin or a woven cloth has about as much."""
EXPONENT = 0.2
"""Root mean square of the exponent n of mu ~ N^(-n): 0 for Coulomb's law, 1/3 for Hertz's area at constant shear."""
LEAST_CHANGE = 0.02
"""Relative standard deviation by which mu of a stroke is another than that of the stroke before, at least."""
REST_PULL = 0.06
"""Share of the friction that still pulls in a rest in which the finger was let go of, standard deviation."""
LET_GO, ALIKE = 0.5, 1.2
"""In such a rest T differs from sliding by more than this share of itself, and the normal force from that of the
sliding before by no greater ratio: a finger that is held keeps most of its pull, as long as it is pressed."""
STEADY_LOOKS, STEADY = 5, 0.05
"""And for so many looks it changes by no more than this share of the difference: nobody starts to pull."""
AIR_SIGMA_N, AIR_LOOKS = 1e-3, 25.0
"""Repeatability of a sensor's zero; looks over which air is averaged."""
TURNS_FADE = 0.7
"""Weight of what earlier turns told when a new one is added: zeros drift."""
CONFLICT = 4.0
"""Sum of squared deviations over variances from which the sources contradict each other; all variances grow with it."""


class Look(NamedTuple):
    """Means over a look: tangential and normal force in N, velocity in mm/s; and the noise of one T, in N."""

    tangential: float
    normal: float
    velocity: float
    noise: float


class Reading(NamedTuple):
    """What one source tells of the offset; without information the variance is infinite."""

    value_N: float = 0.0
    variance_N2: float = math.inf


class Stroke(NamedTuple):
    """Sums over the looks of a stroke: s T / N, 1 / N, ln N, squared deviations of mu from its mean; their number."""

    ratio: float = 0.0
    inverse: float = 0.0
    log_normal: float = 0.0
    spread: float = 0.0
    looks: int = 0


def combined(*readings: Reading) -> Reading:
    """Weighted mean of independent readings; its variance grows where they contradict each other."""
    known = [reading for reading in readings if reading.variance_N2 < math.inf]
    if not known:
        return Reading()
    variance = 1 / math.fsum(1 / own for _, own in known)
    value = variance * math.fsum(own / spread for own, spread in known)
    conflict = math.fsum((own - value) ** 2 / spread for own, spread in known) / CONFLICT
    return Reading(value, variance * max(conflict, 1.0))


@dataclass
class Offset:
    """What each source tells of the offset, and all together.

    air : its reading, from `air_looks`; flying : looks in air in a row. moving : (T, N) of the last look of this
    contact that moved, and before : of the last before the rest. still : (T, N) of the last looks at rest; rest : the
    (T, N, change of T) of the steadiest of them; let_go : what it tells. turns : of all turns but the last, anisotropy
    apart.
    """

    prior: Reading
    all: Reading
    air: Reading = Reading()
    air_looks: float = 0.0
    flying: int = 0
    moving: tuple[float, float] | None = None
    before: tuple[float, float] | None = None
    still: tuple[tuple[float, float], ...] = ()
    rest: tuple[float, float, float] = (math.nan, math.nan, math.inf)
    let_go: Reading = Reading()
    turns: Reading = Reading()

    @property
    def told(self) -> bool:
        """Whether anything but the prior tells it."""
        return self.all != self.prior

    def fly(self, look: Look, samples: int) -> None:
        """A look in air, of so many samples; the first still holds the end of the contact."""
        self.flying += 1
        if self.flying == 1:
            return
        self.air_looks = min(self.air_looks + 1, AIR_LOOKS)
        value, variance = self.air if self.air_looks > 1 else (look.tangential, 0.0)
        off = look.tangential - value
        # What reads as a small normal force may be a light contact, which rubs.
        own = AIR_SIGMA_N**2 + (0.5 * look.normal) ** 2 + look.noise**2 / samples + off**2
        self.air = Reading(value + off / self.air_looks, variance + (own - variance) / self.air_looks)
        self.all = combined(self.prior, self.air, self.turns)

    def stand(self, look: Look) -> None:
        """A look at rest."""
        if not self.still:
            self.before, self.rest = self.moving, (math.nan, math.nan, math.inf)
        self.still = (*self.still[1 - STEADY_LOOKS :], (look.tangential, look.normal))
        tangential, normal = zip(*self.still, strict=True)
        change = max(tangential) - min(tangential)
        if len(self.still) == STEADY_LOOKS and change < self.rest[-1]:
            self.rest = (math.fsum(tangential) / STEADY_LOOKS, math.fsum(normal) / STEADY_LOOKS, change)

    def slide(self, look: Look, forward: Stroke, backward: Stroke) -> None:
        """A look of steady sliding, after which these are the last strokes of both directions."""
        level, force, change = self.rest
        around = [look.tangential] if self.before is None else [look.tangential, self.before[0]]
        alike = self.before is None or 1 / ALIKE < self.before[1] / force < ALIKE
        drop = abs(level - look.tangential)
        if self.still and alike and change < STEADY * drop and all(abs(level - T) > LET_GO * abs(T) for T in around):
            self.let_go = Reading(level, (REST_PULL * drop) ** 2 + change**2)
        self.still = ()
        turns, anisotropy = self._turn(forward, backward)
        turns = Reading(turns.value_N, turns.variance_N2 + anisotropy)
        better = self.air_looks or turns.variance_N2 < math.inf
        self.all = combined(self.prior, self.air, turns, Reading() if better else self.let_go)

    def turn(self, forward: Stroke, backward: Stroke) -> None:
        """Keep what the last strokes told, before one of them begins anew."""
        self.turns, _ = self._turn(forward, backward)

    def _turn(self, forward: Stroke, backward: Stroke) -> tuple[Reading, float]:
        """What all turns tell with mu the same both ways, and the variance (N^2) that the anisotropy adds."""
        if not (forward.looks and backward.looks):
            return self.turns, 0.0
        means = ([total / way.looks for total in way[:4]] for way in (forward, backward))
        (a, b, log, spread), (c, d, other, another) = means
        # mu = a - offset b = c + offset d
        offset, mu = (a - c) / (b + d), (a * d + c * b) / (b + d)
        # As much as mu changes within a stroke it may be another in the next; and it may change with the force.
        variance = (LEAST_CHANGE * mu) ** 2 + spread + another + (EXPONENT * mu * (log - other)) ** 2
        faded = Reading(self.turns.value_N, self.turns.variance_N2 / TURNS_FADE)
        return combined(faded, Reading(offset, variance / (b + d) ** 2)), (ANISOTROPY * mu / (b + d)) ** 2
