"""Short representations of objects: a `__repr__` on one line for dataclasses, with shapes instead of the numbers of
arrays, and HTML tables for notebooks."""

import reprlib
from collections.abc import Iterable, Sequence
from dataclasses import fields
from html import escape
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


def html_table(title: str, rows: Iterable[Sequence[object]], heads: Sequence[object] = ()) -> str:
    """A title and a table below it, for `_repr_html_`; a number is shown with five digits, text is escaped."""
    lines = [f"<tr>{''.join(f'<th>{_cell(head)}</th>' for head in heads)}</tr>"] if heads else []
    lines += [f"<tr>{''.join(f'<td>{_cell(cell)}</td>' for cell in values)}</tr>" for values in rows]
    return f"<b>{escape(title)}</b><table>{''.join(lines)}</table>"


def _cell(value: object) -> str:
    return escape(f"{value:.5g}" if isinstance(value, float) else str(value))
