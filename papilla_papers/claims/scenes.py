"""The scenes of the experiments and figures: data in `scenes.toml`, a table each, read into records."""

from functools import lru_cache

import numpy as np

from papilla.core.settings import SettingsTable, tables


@lru_cache(maxsize=1)
def scenes() -> SettingsTable:
    """All scenes; they are a part of the key under which a result is kept."""
    return SettingsTable(tables(__package__, "scenes"))


def scene(name: str) -> SettingsTable:
    """The scene of an experiment, of several (`signals`), or of a paper's figures."""
    return scenes()[name]


def even(ends: SettingsTable) -> np.ndarray:
    """Evenly spaced values (count,) from one end to the other: `from`, `to` and `count` of a record."""
    return np.linspace(ends["from"], ends["to"], ends["count"])


def by_factors(ends: SettingsTable) -> np.ndarray:
    """Values (count,) from one end to the other, each the same multiple of the one before."""
    return np.geomspace(ends["from"], ends["to"], ends["count"])
