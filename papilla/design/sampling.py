"""Designs of a study: a grid, a Sobol sample with shapes as the outer sample, or those of an optimiser."""

import itertools
import math
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from papilla.design.study import Free, Study, at_shares

Values = dict[str, float]
LARGEST_RANGE_SHARE = 1 - 1e-12
"""Largest share of a range that an optimiser tries: at 1 a choice among values would leave them."""
FAILED_SCORE = 1e9
"""Score of a failed design for an optimiser; a design that violates a limit has at least a thousandth of it."""


def groups(study: Study) -> Iterator[list[Values]]:
    """The designs of a grid or a Sobol sample, with those of one geometry together; generated on demand."""
    outer, names = study.outer, {parameter.name for parameter in study.outer}
    inner = [parameter for parameter in study.free if parameter.name not in names]
    if study.sampler.kind == "grid":
        for shape in _grid(outer):
            yield [shape | rest for rest in _grid(inner)]
        return
    sampler = study.sampler
    count = min(sampler.geometries, sampler.designs) if outer else 1
    shapes = _sobol(outer, count, sampler.seed)
    for number, shape in enumerate(shapes):
        size = sampler.designs // count + (number < sampler.designs % count)
        yield [shape | rest for rest in _sobol(inner, size if inner else 1, sampler.seed + 1 + number)]


def count(study: Study) -> tuple[int, int]:
    """Number of designs, and of geometries, in a study (the maximum, with an optimiser)."""
    sampler, outer = study.sampler, study.outer
    if sampler.kind == "grid":
        sizes = {parameter.name: len(parameter.grid) for parameter in study.free}
        return math.prod(sizes.values()), math.prod(sizes[parameter.name] for parameter in outer)
    if sampler.kind == "optimise":
        return sampler.designs, sampler.designs if outer else 1
    shapes = min(sampler.geometries, sampler.designs) if outer else 1
    return (sampler.designs if len(outer) < len(study.free) else shapes), shapes


def optimised(study: Study, score: Callable[[list[Values]], Sequence[float]]) -> None:
    """Minimise the score with SciPy's differential evolution; whole generations are evaluated together."""
    from scipy.optimize import differential_evolution

    free, budget = study.free, study.sampler.designs
    size = max(5, min(16, budget // 8))

    starts = [
        [parameter.share(start[parameter.name]) for parameter in free]
        for start in _sobol(free, size, study.sampler.seed)
    ]

    def of(shares: np.ndarray) -> np.ndarray:
        columns = np.atleast_2d(shares.T).T
        return np.array(score([at_shares(free, point) for point in columns.T]))

    differential_evolution(
        of,
        [(0.0, LARGEST_RANGE_SHARE)] * len(free),
        init=np.array(starts).clip(0, LARGEST_RANGE_SHARE),
        maxiter=max(1, budget // size - 1),
        rng=study.sampler.seed,
        polish=False,
        updating="deferred",
        vectorized=True,
    )


def _grid(free: Sequence[Free]) -> Iterator[Values]:
    for values in itertools.product(*(parameter.grid for parameter in free)):
        yield {parameter.name: value for parameter, value in zip(free, values, strict=True)}


def _sobol(free: Sequence[Free], size: int, seed: int) -> Iterator[Values]:
    """A scrambled Sobol sequence (Owen 1998, doi:10.1006/jcom.1998.0487) of `size` points."""
    if not free:
        yield {}
        return
    from scipy.stats import qmc

    points = qmc.Sobol(len(free), rng=seed).random_base2(max(0, math.ceil(math.log2(size))))[:size]
    for point in points.tolist():
        yield at_shares(free, point)
