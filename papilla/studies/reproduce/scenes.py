"""The scenes of the experiments and figures: data in `scenes.toml`, a table each, read into records."""

import tomllib
from functools import lru_cache
from importlib.resources import files
from typing import Any

import numpy as np


class Record(dict[str, Any]):
    """A table of the file, whose values are attributes too: a table in it is a record, a list a tuple."""

    def __init__(self, table: dict[str, Any]) -> None:
        super().__init__({name: _frozen(value) for name, value in table.items()})

    def __getattr__(self, name: str) -> Any:
        if name in self:
            return self[name]
        raise AttributeError(f"the scene has no {name!r}; it has {', '.join(self)}")

    def __reduce__(self) -> tuple:
        return Record, (dict(self),)


def _frozen(value: Any) -> Any:
    if isinstance(value, list | tuple):
        return tuple(map(_frozen, value))
    return Record(value) if isinstance(value, dict) else value


@lru_cache(maxsize=1)
def scenes() -> Record:
    """All scenes; they are a part of the key under which a result is kept."""
    return Record(tomllib.loads((files("papilla.studies.reproduce") / "scenes.toml").read_text(encoding="utf-8")))


def scene(name: str) -> Record:
    """The scene of an experiment, of several (`signals`), or of a paper's figures."""
    return scenes()[name]


def even(ends: Record) -> np.ndarray:
    """Evenly spaced values (count,) from one end to the other: `from`, `to` and `count` of a record."""
    return np.linspace(ends["from"], ends["to"], ends["count"])


def by_factors(ends: Record) -> np.ndarray:
    """Values (count,) from one end to the other, each the same multiple of the one before."""
    return np.geomspace(ends["from"], ends["to"], ends["count"])
