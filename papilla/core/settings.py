"""Numbers of studies, which stand in TOML files: scenes as rules of drawing, cases as forces, sizes and bounds.

A folder of studies has one `parameters.toml` with a table for each module. The units are in the names of the keys, and
comments say why a scene exists and why a bound has its value.
"""

import math
from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np

from papilla.core.errors import InputError
from papilla.core.outside import shipped, toml

DRAW_FACTOR = 1.5
"""Factor by which a parameter is drawn larger or smaller if its rule has no `within`."""


class SettingsTable(dict[str, Any]):
    """A table of a file, whose values are attributes too: a table in it is a record, a list a tuple."""

    def __init__(self, table: Mapping[str, Any]) -> None:
        super().__init__({name: _frozen(value) for name, value in table.items()})

    def __getattr__(self, name: str) -> Any:
        if name in self:
            return self[name]
        raise AttributeError(f"the table has no {name!r}; it has {', '.join(self)}")

    def __reduce__(self) -> tuple:
        return SettingsTable, (dict(self),)


def _frozen(value: Any) -> Any:
    if isinstance(value, list | tuple):
        return tuple(map(_frozen, value))
    return SettingsTable(value) if isinstance(value, dict) else value


def parameters(module: str) -> SettingsTable:
    """The table of a module (`__name__`)."""
    package, _, name = module.rpartition(".")
    return SettingsTable(tables(package)[name])


@lru_cache
def tables(package: str, name: str = "parameters") -> Mapping[str, Any]:
    """All tables of a TOML file in the folder of a package."""
    return toml(shipped(package, f"{name}.toml"), f"{name}.toml")


def drawn(table: Mapping[str, Any], rng: np.random.Generator, *, vary: bool = True) -> dict[str, Any]:
    """The values of a table, drawn in the order of its keys.

    A rule is a table of its own: `about` is a value, multiplied by a factor up to `within` or divided by it; `uniform`
    and `log_uniform` have two ends (`count` : so many values), `angle` any in rad, `normal` its standard deviation;
    `one_of` has the choices, `chance` the probability of True. `noise` is one standard deviation or several: so many
    columns of normal values for `seconds` at `rate_Hz`, two keys before it. Other entries are values as they stand.
    vary : False takes the value of `about` and the first of `one_of`.
    """
    values: dict[str, Any] = {}
    for name, rule in table.items():
        values[name] = _value(rule, rng, vary, values) if isinstance(rule, Mapping) else rule
    return values


def _value(rule: Mapping[str, Any], rng: np.random.Generator, vary: bool, before: Mapping[str, Any]) -> Any:
    match rule:
        case {"about": value, **rest}:
            return value * rest.get("within", DRAW_FACTOR) ** rng.uniform(-1, 1) if vary else value
        case {"uniform": (low, high), **rest}:
            return rng.uniform(low, high, rest.get("count"))
        case {"log_uniform": (low, high)}:
            return np.exp(rng.uniform(np.log(low), np.log(high)))
        case {"angle": "any"}:
            return rng.uniform(0, 2 * math.pi)
        case {"normal": sigma}:
            return rng.normal(0, sigma)
        case {"one_of": choices}:
            return rng.choice(choices).item() if vary else choices[0]
        case {"chance": share}:
            return bool(rng.random() < share)
        case {"noise": sigma}:
            return np.array(sigma) * rng.normal(size=(round(before["seconds"] * before["rate_Hz"]), *np.shape(sigma)))
    raise InputError(f"no rule of drawing: {rule}")
