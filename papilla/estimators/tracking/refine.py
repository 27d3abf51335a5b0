"""The wavenumber from the phase of a line along the path, block by block: nearly maximum likelihood.

In a block of whole periods the harmonics and an offset are orthogonal. With a trial wavenumber k_0, the phase of block
i (in cycles) differs from the model by

  phi_i = phi_stroke + (k - k_0) x_i + k T v_i,

so a regression of the phases on path and velocity gives the wavenumber k and the delay T of the path. Each stroke has a
phase of its own. Phase regression reaches the Cramér-Rao bound above a threshold (Tretter 1985,
doi:10.1109/TIT.1985.1057115).
"""

from itertools import accumulate, repeat
from typing import NamedTuple

import numpy as np

from papilla.estimators.spectrum import middle, slope
from papilla.estimators.spread import Pieces
from papilla.units import TINY

BLOCKS = 24
"""Largest number of blocks along a window; each has whole periods."""
WHOLE = 0.9
"""Share of a block's length that its rows must cover."""
PRESENT = 12.0
"""Smallest energy of a harmonic, relative to half the noise, for it to take part: a smaller one is mostly noise."""
MEDIAN_TO_SIGMA = 1.4826
OUTLYING = 3.0
"""Sigmas of a block's phase above which it counts less (Huber 1964, doi:10.1214/aoms/1177703732)."""


class Phases(NamedTuple):
    """cycles (b,) : difference of each block's phase from the model, with its stroke's mean; information (b,) of it;
    place (b,), regressors (b, p) : means over the block; stroke (b,). amplitude (s, g) complex: the fundamental of each
    stroke and gauge; coherence : of the blocks, 1 if all agree."""

    cycles: np.ndarray
    information: np.ndarray
    regressors: np.ndarray
    stroke: np.ndarray
    amplitude: np.ndarray
    coherence: float


class Fit(NamedTuple):
    """step (p,) : change of the parameters; covariance (p, p), from noise and scatter of the blocks; scatter : of the
    blocks in cycles, beyond the noise."""

    step: np.ndarray
    covariance: np.ndarray
    scatter: float


def phases_of(cycles, regressors, weight, count, readings, seen, stroke, noise) -> Pieces[Phases]:
    """Phases of blocks of whole periods.

    cycles (m,) : the model's phase; regressors (m, p) : its derivatives by the parameters; weight (m,) : of the path,
    so that a block is evenly filled; count (m,) : number of samples in a row; readings (m, g), 0 where not seen;
    stroke (m,) : number of each row's; noise (h, g) : variance of a sample at each harmonic, infinite for none.
    """
    begin = np.flatnonzero(np.diff(stroke, prepend=-1))
    # Cut each stroke into at most BLOCKS blocks of the same whole number of periods, so that an offset, and every
    # harmonic, is orthogonal to the others within a block. `label` numbers the blocks of all strokes.
    along = cycles - np.minimum.reduceat(cycles, begin)[stroke]
    length = max(int(np.ceil(along.max() / BLOCKS)), 1)
    label = stroke * (BLOCKS + 2) + (along / length).astype(int)
    order = np.argsort(label, kind="stable")
    edges = np.flatnonzero(np.diff(label[order], prepend=-1))
    of_stroke = stroke[order][edges]
    turns, orders = np.exp(-2j * np.pi * cycles[order]), np.arange(1, len(noise) + 1)
    yield
    weight, along = weight[order], along[order]
    used = weight[:, None] * seen[order]
    values = used * readings[order]
    # exp(-i n phi) of each harmonic by repeated multiplication: one exponential instead of many.
    waves = accumulate(repeat(turns, len(orders)), np.multiply)
    blocks = np.stack([np.add.reduceat(wave[:, None] * values, edges) for wave in waves], axis=1)
    yield
    rows = np.column_stack([used, used * (weight / count[order])[:, None], weight[:, None] * regressors[order]])
    sums, gauges = np.add.reduceat(rows, edges), readings.shape[1]
    amount, square = sums[:, :gauges], sums[:, gauges : 2 * gauges]
    total = np.add.reduceat(weight, edges)
    reach = np.maximum.reduceat(along, edges) - np.minimum.reduceat(along, edges)
    # The remainder at the end of a stroke is not a whole period.
    whole = (reach + middle(np.abs(np.diff(cycles))) > WHOLE * length)[:, None]
    # Mean amplitude of each stroke and harmonic: the reference against which its blocks' phases are measured.
    first = np.flatnonzero(np.diff(of_stroke, prepend=-1))
    mean = np.add.reduceat(blocks * whole[:, :, None], first)
    mean /= np.maximum(np.add.reduceat(amount * whole, first), TINY)[:, None, :]
    yield
    # Noise of each block: variance of one quadrature of its mean, per harmonic and gauge.
    variance = 0.5 * np.minimum(noise, 1e100) * (square / np.maximum(amount, 1e-150) ** 2)[:, None, :]
    inverse = np.where((whole & (amount > 0))[:, None, :], 1 / np.maximum(variance, TINY), 0.0)
    # Harmonics that noise could have made take no part: their phases would be random.
    size = np.abs(mean) ** 2
    certain = (size * np.add.reduceat(inverse, first) > PRESENT)[of_stroke] * inverse
    turn = 2 * np.pi * orders[:, None]
    # Rotate each block by the stroke's reference: its imaginary part is the phase deviation times the amplitude.
    # Harmonic n turns n times as far, so its score and information carry n and n^2. Their ratio is the phase in cycles.
    pull = blocks / np.maximum(amount, TINY)[:, None, :] * np.conj(mean)[of_stroke]
    score = (turn * pull.imag * certain).sum(axis=(1, 2))
    information = (turn**2 * size[of_stroke] * certain).sum(axis=(1, 2))
    # Coherence: length of the sum of all blocks along the reference, over the length if all pointed along it.
    agreeing = (pull * certain).sum(axis=(1, 2))
    return Phases(
        np.where(information > 0, score / np.maximum(information, TINY), 0.0),
        information,
        sums[:, 2 * gauges :] / total[:, None],
        of_stroke,
        2 * mean[:, 0],
        float(agreeing.real.sum() / max(np.abs(agreeing).sum(), TINY)),
    )


def regressed(phases: Phases, prior: np.ndarray, off: np.ndarray) -> Pieces[Fit]:
    """Weighted, robust regression of the blocks' phases, a mean for each stroke removed.

    prior (p,) : 1 / variance of each parameter about a known value; off (p,) : that value minus the present one.
    """
    weight, known = phases.information, phases.information > 0
    stroke = phases.stroke[:, None] == np.arange(phases.stroke[-1] + 1)
    columns = np.column_stack([phases.regressors, phases.cycles])
    spare = max(int(known.sum()) - stroke.shape[1] - len(prior), 1)
    # Iteratively reweighted least squares; three rounds settle the weights.
    for _ in range(3):
        yield
        # Each stroke has a free phase: subtract its weighted mean instead of adding a parameter for it.
        share = weight[:, None] * stroke
        means = share.T @ columns / np.maximum(share.sum(axis=0), TINY)[:, None]
        centred = columns - means[phases.stroke]
        regressors, cycles = centred[:, :-1], centred[:, -1]
        normal = (regressors.T * weight) @ regressors + np.diag(prior)
        # Scaled to a unit diagonal, because path (mm) and delay (s) differ by many powers of ten.
        scale = np.sqrt(np.maximum(normal.diagonal(), TINY))
        inverse = np.linalg.inv(normal / np.outer(scale, scale) + 1e-9 * np.eye(len(prior))) / np.outer(scale, scale)
        step = inverse @ (regressors.T @ (weight * cycles) + prior * off)
        left = np.abs(cycles - regressors @ step)
        rest = left * np.sqrt(phases.information)
        # Birge's ratio (1932, doi:10.1103/PhysRev.40.207): blocks may scatter more than noise does.
        usual = MEDIAN_TO_SIGMA * middle(rest[known]) or 1.0
        # Huber's weights: full up to three robust sigmas, falling as 1 / residual beyond.
        pull = np.minimum(OUTLYING * max(usual, 1.0) / np.maximum(rest, TINY), 1.0)
        weight = phases.information * pull**2
    ratio = max(float((pull * rest) @ (pull * rest)) / spare, 1.0)
    # Scatter beyond the noise: robust variance of the residuals minus what noise alone would give.
    noise, usual = middle(1 / phases.information[known]), MEDIAN_TO_SIGMA * middle(left[known])
    return Fit(step, inverse * ratio, max(usual**2 - noise, 0.0) ** 0.5)


def share_kept(place, readings, seen, wavenumber: float, wanted, noise, periods: int) -> tuple[float, float] | None:
    """Amplitude of a line in the newest `periods`, as a share of its amplitude `wanted` over the whole path, and the
    sigma of this share from the residuals.

    place (m,) : of one stroke; readings, seen (m, g); wanted (g,) : complex amplitude at place 0; noise (g,) : variance
    of a sample. None if the path is less than one period longer.
    """
    cycles = wavenumber * np.abs(place - place[-1])
    first = len(cycles) - int((cycles[::-1] > periods).argmax())
    if cycles.max(initial=0.0) < periods + 1 or first > len(cycles) - 3:
        return None
    place, readings, seen = place[first:], readings[first:], seen[first:]
    path = np.maximum(np.abs(slope(place)), 1e-12)
    total = np.maximum(path @ seen, 1e-150)
    # A gauge that is lost does not mean that its line is lost.
    weight = np.where(total > 0.5 * path.sum(), 1 / np.asarray(noise), 0.0)
    if not weight.any():
        return None
    wanted = np.asarray(wanted)
    power = np.abs(wanted) ** 2 * weight
    size = max(float(power.sum()), TINY)
    # Amplitude in whole periods, where the mean is orthogonal to the wave; then the part of it in phase with the known
    # one.
    values = seen * (readings - path @ (seen * readings) / total)
    wave = np.exp(-2j * np.pi * wavenumber * place)
    own = 2 * ((wave * path) @ values) / total
    rest = path @ (values - seen * np.outer(wave.conj(), own).real) ** 2 / total
    share = path**2 @ seen / total**2
    kept = float((wanted.conj() * own * weight).sum().real) / size
    return kept, float(np.sqrt(2 * (rest * share * power * weight).sum())) / size
