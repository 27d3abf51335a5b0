"""Designs of a study: a grid, a Sobol sample with shapes as the outer sample, or those of an optimiser."""

import itertools
import math
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from papilla.design.study import Free, Study

Values = dict[str, float]
LARGEST_RANGE_SHARE = 1 - 1e-12
"""Largest share of a range that an optimiser tries: at 1 a choice among values would leave them."""
FAILED_SCORE = 1e9
"""Score of a failed design for an optimiser; a design that violates a limit has at least a thousandth of it."""


def groups(study: Study) -> Iterator[list[Values]]:
    """The designs of a grid or a Sobol sample, with those of one geometry together; generated on demand."""
    outer, names = study.outer, {one.name for one in study.outer}
    inner = [one for one in study.free if one.name not in names]
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
        sizes = {one.name: len(one.grid) for one in study.free}
        return math.prod(sizes.values()), math.prod(sizes[one.name] for one in outer)
    if sampler.kind == "optimise":
        return sampler.designs, sampler.designs if outer else 1
    shapes = min(sampler.geometries, sampler.designs) if outer else 1
    return (sampler.designs if len(outer) < len(study.free) else shapes), shapes


def optimised(study: Study, score: Callable[[list[Values]], Sequence[float]]) -> None:
    """Minimise the score with SciPy's differential evolution; whole generations are evaluated together."""
    from scipy.optimize import differential_evolution

    free, left = study.free, study.sampler.designs
    size = max(5, min(16, left // 8))

    def of(shares: np.ndarray) -> np.ndarray:
        columns = np.atleast_2d(shares.T).T
        return np.array(score([{one.name: one.at(u) for one, u in zip(free, row, strict=True)} for row in columns.T]))

    differential_evolution(
        of,
        [(0.0, LARGEST_RANGE_SHARE)] * len(free),
        init=np.array([[one.share(value) for one, value in zip(free, row.values(), strict=True)]
                       for row in _sobol(list(free), size, study.sampler.seed)]).clip(0, LARGEST_RANGE_SHARE),
        maxiter=max(1, left // size - 1),
        rng=study.sampler.seed,
        polish=False,
        updating="deferred",
        vectorized=True,
    )  # fmt: skip


def _grid(free: Sequence[Free]) -> Iterator[Values]:
    for values in itertools.product(*(one.grid for one in free)):
        yield {one.name: value for one, value in zip(free, values, strict=True)}


def _sobol(free: Sequence[Free], size: int, seed: int) -> Iterator[Values]:
    """A scrambled Sobol sequence (Owen 1998, doi:10.1006/jcom.1998.0487) of `size` points."""
    if not free:
        yield {}
        return
    from scipy.stats import qmc

    points = qmc.Sobol(len(free), rng=seed).random_base2(max(0, math.ceil(math.log2(size))))[:size]
    for row in points.tolist():
        yield {one.name: one.at(share) for one, share in zip(free, row, strict=True)}
