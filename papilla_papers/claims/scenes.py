"""The scenes of the experiments and figures: data in `scenes.toml`, a table each, read into records."""

from functools import lru_cache

import numpy as np

from papilla.core.settings import Record, tables


@lru_cache(maxsize=1)
def scenes() -> Record:
    """All scenes; they are a part of the key under which a result is kept."""
    return Record(tables(__package__, "scenes"))


def scene(name: str) -> Record:
    """The scene of an experiment, of several (`signals`), or of a paper's figures."""
    return scenes()[name]


def even(ends: Record) -> np.ndarray:
    """Evenly spaced values (count,) from one end to the other: `from`, `to` and `count` of a record."""
    return np.linspace(ends["from"], ends["to"], ends["count"])


def by_factors(ends: Record) -> np.ndarray:
    """Values (count,) from one end to the other, each the same multiple of the one before."""
    return np.geomspace(ends["from"], ends["to"], ends["count"])
