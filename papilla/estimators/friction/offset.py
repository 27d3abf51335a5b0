"""Offset T0 of the tangential force (the reading without a load), from air, turns and rests.

Steady sliding in one direction does not separate T0 from friction. A regression of T over N seems to, but its error is
many times its own sigma, because mu changes with N (as N^(-n) for a soft contact) and by chance together with N. Three
sources show T0:

- air: T without contact;
- turns: T0 is where mu is the same both ways, T+ / N+ - T0 / N+ = -(T- / N- - T0 / N-), but for the anisotropy of the
  skin;
- a rest in which T differs from the sliding before and after by more than half of itself: the finger was let go. A
  finger that was held may look the same, so a rest counts only until there is air or a turn.

Repetition does not reduce the error of a source, because it is the same each time. So each source is one value with its
variance (`Source`), and T0 is their weighted mean with the prior.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

ANISOTROPY_SIGMA = 0.08
"""Prior standard deviation of mu_+ - mu_-, over their mean: as in a worn skin or a woven cloth."""
FORCE_EXPONENT_RMS = 0.2
"""Root mean square of the exponent n of mu ~ N^(-n): 0 for Coulomb's law, 1/3 for Hertz's area at constant shear."""
LEAST_STROKE_CHANGE = 0.02
"""Smallest relative standard deviation of the change of mu from one stroke to the next."""
REST_PULL = 0.06
"""Standard deviation of the pull that remains after the finger was released, as a share of the friction."""
LET_GO, ALIKE_FORCE_RATIO = 0.5, 1.2
"""The finger was released if T differs from sliding by more than the share LET_GO of itself while the normal force
stays within the ratio ALIKE_FORCE_RATIO: a finger that is held keeps most of its pull as long as it is pressed."""
STEADY_BLOCKS, STEADY_PULL_SHARE = 5, 0.05
"""A pull has not begun yet if T changes over so many blocks by no more than this share of the difference."""
AIR_SIGMA_N, MEMORY_BLOCKS = 1e-3, 25.0
"""Repeatability of a sensor's zero (N); number of blocks over which air, and a scatter, is averaged."""
TURNS_FADE = 0.7
"""Weight of earlier turns when a new one is added: zeros drift."""
CONFLICT_SQUARES = 4.0
"""Sum of squared deviations over variances above which sources contradict each other; all variances then grow in
proportion."""


class BlockMeans(NamedTuple):
    """Means over a block: tangential and normal force in N, velocity in mm/s; and the noise of one T, in N."""

    tangential: float
    normal: float
    velocity: float
    noise: float


class Source(NamedTuple):
    """The offset as one source (air, turns or a rest) estimates it, and its variance: infinite before the first use."""

    value_N: float = 0.0
    variance_N2: float = math.inf


class Stroke(NamedTuple):
    """Sums over the blocks of a stroke: s T / N, 1 / N, ln N, squared deviations of mu from its mean; their number."""

    ratio: float = 0.0
    inverse: float = 0.0
    log_normal: float = 0.0
    spread: float = 0.0
    blocks: int = 0


def combined(*readings: Source) -> Source:
    """Weighted mean of independent readings; its variance grows if they contradict each other."""
    sources = [reading for reading in readings if reading.variance_N2 < math.inf]
    if not sources:
        return Source()
    variance = 1 / math.fsum(1 / spread for _, spread in sources)
    value = variance * math.fsum(place / spread for place, spread in sources)
    conflict = math.fsum((place - value) ** 2 / spread for place, spread in sources) / CONFLICT_SQUARES
    return Source(value, variance * max(conflict, 1.0))


@dataclass
class ForceOffset:
    """The offset by each source, and by all together.

    air : mean of `air_blocks`; air_run : number of consecutive blocks in air. moving : (T, N) of the last moving block
    of this contact; before : of the last one before the rest. rests : (T, N) of the last blocks at rest; rest : (T, N,
    change of T) of the steadiest of them; let_go : the offset from it. turns : the offset from all turns except the
    last, without the part of the anisotropy.
    """

    prior: Source
    all: Source
    air: Source = Source()
    air_blocks: float = 0.0
    air_run: int = 0
    moving: tuple[float, float] | None = None
    before: tuple[float, float] | None = None
    rests: tuple[tuple[float, float], ...] = ()
    rest: tuple[float, float, float] = (math.nan, math.nan, math.inf)
    let_go: Source = Source()
    turns: Source = Source()

    @property
    def observed(self) -> bool:
        """Whether anything but the prior shows the offset."""
        return self.all != self.prior

    def in_air(self, block: BlockMeans, samples: int) -> None:
        """Take a block in air, of `samples` samples; the first block may contain the end of the contact."""
        self.air_run += 1
        if self.air_run == 1:
            return
        self.air_blocks = min(self.air_blocks + 1, MEMORY_BLOCKS)
        value, variance = self.air if self.air_blocks > 1 else (block.tangential, 0.0)
        error = block.tangential - value
        # A small normal force may be a light contact, which has friction.
        spread = AIR_SIGMA_N**2 + (0.5 * block.normal) ** 2 + block.noise**2 / samples + error**2
        self.air = Source(value + error / self.air_blocks, variance + (spread - variance) / self.air_blocks)
        # A rest is left out: air is the better evidence of the same thing.
        self.all = combined(self.prior, self.air, self.turns)

    def at_rest(self, block: BlockMeans) -> None:
        """Take a block at rest."""
        if not self.rests:
            self.before, self.rest = self.moving, (math.nan, math.nan, math.inf)
        self.rests = (*self.rests[1 - STEADY_BLOCKS :], (block.tangential, block.normal))
        # A finger that creeps or is pulled again changes T: keep the steadiest stretch of the rest.
        tangential, normal = zip(*self.rests, strict=True)
        change = max(tangential) - min(tangential)
        if len(self.rests) == STEADY_BLOCKS and change < self.rest[-1]:
            self.rest = (math.fsum(tangential) / STEADY_BLOCKS, math.fsum(normal) / STEADY_BLOCKS, change)

    def sliding(self, block: BlockMeans, forward: Stroke, backward: Stroke) -> None:
        """Take a block of steady sliding; forward and backward are the last strokes of both directions, this block
        included."""
        # Was the rest before this stroke a release? T must be steady, far from the sliding on both sides, and the
        # normal force unchanged: else the finger was only held less.
        level, force, change = self.rest
        around = [block.tangential] if self.before is None else [block.tangential, self.before[0]]
        alike = self.before is None or 1 / ALIKE_FORCE_RATIO < self.before[1] / force < ALIKE_FORCE_RATIO
        drop = abs(level - block.tangential)
        steady = self.rests and change < STEADY_PULL_SHARE * drop
        if steady and alike and all(abs(level - T) > LET_GO * abs(T) for T in around):
            self.let_go = Source(level, max((REST_PULL * drop) ** 2 + change**2, AIR_SIGMA_N**2))
        self.rests = ()
        turns, anisotropy = self._turn(forward, backward)
        turns = Source(turns.value_N, turns.variance_N2 + anisotropy)
        # A held finger may look released, so a rest counts only as long as there is nothing better.
        better = self.air_blocks or turns.variance_N2 < math.inf
        self.all = combined(self.prior, self.air, turns, Source() if better else self.let_go)

    def keep_turns(self, forward: Stroke, backward: Stroke) -> None:
        """Keep the result of the last strokes before one of them begins again."""
        self.turns, _ = self._turn(forward, backward)

    def _turn(self, forward: Stroke, backward: Stroke) -> tuple[Source, float]:
        """The offset for which mu is the same in both directions in all turns, and the variance (N^2) that the
        anisotropy adds."""
        if not (forward.blocks and backward.blocks):
            return self.turns, 0.0
        # Means over the last stroke of each direction, with s T / N = mu + s T0 / N: two equations for mu and T0.
        means = ([total / direction.blocks for total in direction[:-1]] for direction in (forward, backward))
        (a, b, log, spread), (c, d, log_back, another) = means
        # mu = a - offset b = c + offset d
        offset, mu = (a - c) / (b + d), (a * d + c * b) / (b + d)
        # From stroke to stroke mu may change as much as within one stroke; and it may change with the force.
        variance = (
            (LEAST_STROKE_CHANGE * mu) ** 2 + spread + another + (FORCE_EXPONENT_RMS * mu * (log - log_back)) ** 2
        )
        # A force that never changes has no scatter at all, but a sensor's zero repeats no better than this.
        turn = Source(offset, max(variance / (b + d) ** 2, AIR_SIGMA_N**2))
        faded = Source(self.turns.value_N, self.turns.variance_N2 / TURNS_FADE)
        return combined(faded, turn), (ANISOTROPY_SIGMA * mu / (b + d)) ** 2
