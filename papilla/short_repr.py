"""A `__repr__` on one line for dataclasses, with the shapes of arrays instead of their numbers."""

import reprlib
from dataclasses import fields
from typing import Any

_SHORTENED = reprlib.Repr()
_SHORTENED.maxother = _SHORTENED.maxstring = 60


def short_repr(of: Any) -> str:
    """The dataclass with its fields, an array as its shape."""
    values = ((item.name, getattr(of, item.name)) for item in fields(of) if item.repr)
    return f"{type(of).__name__}({', '.join(f'{name}={_shown(value)}' for name, value in values)})"


def _shown(value: Any) -> str:
    shape = getattr(value, "shape", ())
    return f"<{' x '.join(map(str, shape))}>" if shape else _SHORTENED.repr(value)
