"""JSON objects whose values are taken out by type, with complaints that name the full key."""

import math

import numpy as np

from papilla.errors import InputError


class JsonTable:
    """A JSON object whose values are taken out by type; every complaint names the full key."""

    def __init__(self, values, where: str):
        if not isinstance(values, dict):
            raise InputError(f"{where or 'the file'} must be an object, got {_shown(values)}")
        self.values, self._where = values, where

    def name(self, key: str) -> str:
        """The full key, such as softness.surface.cells."""
        return f"{self._where}.{key}" if self._where else key

    def get(self, key: str):
        """The value of a key; `InputError` where it is missing."""
        if key not in self.values:
            raise InputError(f"key {self.name(key)} is missing")
        return self.values[key]

    def table(self, key: str) -> "JsonTable":
        """A nested object."""
        return JsonTable(self.get(key), self.name(key))

    def tables(self, key: str) -> list["JsonTable"]:
        """A list of objects."""
        items = self._list(key)
        return [JsonTable(item, f"{self.name(key)}[{number}]") for number, item in enumerate(items)]

    def text(self, key: str) -> str:
        """A text."""
        if not isinstance(value := self.get(key), str):
            raise InputError(f"{self.name(key)} must be text, got {_shown(value)}")
        return value

    def texts(self, key: str) -> tuple[str, ...]:
        """A list of texts."""
        items = self._list(key)
        if not all(isinstance(item, str) for item in items):
            raise InputError(f"{self.name(key)} must be a list of texts")
        return tuple(items)

    def require(self, key: str, expected) -> None:
        """`InputError` unless the value is the expected one."""
        if (value := self.get(key)) != expected:
            raise InputError(f"{self.name(key)} must be {_shown(expected)}, got {_shown(value)}")

    def number(self, key: str) -> float:
        """A finite number."""
        value = self.get(key)
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            raise InputError(f"{self.name(key)} must be a finite number, got {_shown(value)}")
        return float(value)

    def interval(self, key: str) -> tuple[float, float]:
        """Two finite numbers."""
        low, high = self.array(key, (2,)).tolist()
        return low, high

    def array(self, key: str, shape: tuple[int, ...] | None, *, nulls: bool = False) -> np.ndarray:
        """Numbers of the stated shape (None: any list); with `nulls`, null means NaN."""
        flat: list[float] = []
        found = _collect(self.get(key), flat, nulls)
        expected = found if shape is None and found is not None and len(found) == 1 else shape
        if found is None or found != expected:
            wanted = "numbers" if shape is None else " x ".join(map(str, shape)) + " finite numbers"
            raise InputError(f"{self.name(key)} must be a list of {wanted}, got {_shown(self.get(key))}")
        return np.array(flat).reshape(found)

    def _list(self, key: str) -> list:
        if not isinstance(value := self.get(key), list):
            raise InputError(f"{self.name(key)} must be a list, got {_shown(value)}")
        return value


def _collect(value, flat: list[float], nulls: bool) -> tuple[int, ...] | None:
    """Append all numbers of nested lists to `flat`; their shape, or None where something else stands there."""
    if isinstance(value, list):
        shapes = {_collect(item, flat, nulls) for item in value}
        return (len(value), *inner) if len(shapes) == 1 and (inner := shapes.pop()) is not None else None
    if value is None and nulls:
        flat.append(math.nan)
    elif isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value):
        flat.append(float(value))
    else:
        return None
    return ()


def _shown(value) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."
