"""`Figure`: a figure or table of a paper that papilla can compute; `Picture`: its content as data, panels of curves and
maps, or a table, kept in the cache and written as CSV."""

import csv
import inspect
import io
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np
from numpy.typing import ArrayLike

from papilla.core.errors import FileFormatError
from papilla.core.outside import DOCUMENT_BYTES, message_decoder

MOST_ROWS, MOST_CELLS = 1000, 50
"""Largest number of points in the CSV, of a curve and of a map along each axis; pictures show all points."""


@dataclass(frozen=True, eq=False)
class Curve:
    """y (n,) over x (n,), of one kind; spread (n,) : standard deviation, drawn as error bars.

    look : "line", "dashed", "points", "bars" (x are places of the panel's `names`) or "impulses" (lines from zero).
    origin : "papilla" computed it, "printed" in the paper, or "true" in the scene. color : number of a colour of the
    style, -1 for black, None for the next one.
    """

    label: str
    x: np.ndarray
    y: np.ndarray
    look: str = "line"
    spread: np.ndarray | None = None
    origin: str = "papilla"
    color: int | None = None


def dashed(x: ArrayLike, y: ArrayLike, label: str = "", *, origin: str = "true", color: int | None = None) -> Curve:
    """A dashed line through points (n,); one number for x or y holds for all of them."""
    places, values = np.broadcast_arrays(np.asarray(x, float), np.asarray(y, float))
    return Curve(label, places, values, "dashed", None, origin, color)


def printed(label: str, x: ArrayLike, y: ArrayLike, color: int | None = None) -> Curve:
    """Printed values as points; one number for x or y holds for all of them."""
    places, values = np.broadcast_arrays(np.atleast_1d(np.asarray(x, float)), np.asarray(y, float))
    return Curve(label, places, values, "points", None, "printed", color)


@dataclass(frozen=True, eq=False)
class Shade:
    """A map: value (m, n) at x (n,) and y (m,), of the quantity `label`.

    over (m, n) : True regions get a thick outline. phase (m, n) : radians, drawn as arrows where `over` is True.
    top : value of the darkest colour, None for the largest value.
    """

    x: np.ndarray
    y: np.ndarray
    value: np.ndarray
    label: str
    over: np.ndarray | None = None
    phase: np.ndarray | None = None
    top: float | None = None


@dataclass(frozen=True, eq=False)
class Panel:
    """Axes with a title, quantities with units, curves and maps.

    x_range, y_range : ends of the axes, from the data if None. log : logarithmic axes: "x", "y", "xy". names : of the
    places 0, 1, ... along x. even : whether both axes have the same scale.
    """

    title: str
    x_label: str
    y_label: str
    curves: tuple[Curve, ...] = ()
    shade: Shade | None = None
    x_range: tuple[float, float] | None = None
    y_range: tuple[float, float] | None = None
    log: str = ""
    names: tuple[str, ...] = ()
    even: bool = False


@dataclass(frozen=True, eq=False)
class PrintedTable:
    """Heads with units, and rows of cells as they are shown: text, or numbers followed by the printed ones."""

    heads: tuple[str, ...]
    rows: tuple[tuple[str | float, ...], ...]


@dataclass(frozen=True, eq=False)
class Picture:
    """Panels in `columns` columns, and a table; found : the results of this run, and their differences from print."""

    panels: tuple[Panel, ...] = ()
    table: PrintedTable | None = None
    columns: int = 1
    found: str = ""

    def packed(self) -> np.ndarray:
        """The picture as bytes (n,), for the cache."""
        return np.frombuffer(msgspec.msgpack.encode(self, enc_hook=_plain), np.uint8)

    @classmethod
    def unpacked(cls, content: np.ndarray) -> "Picture":
        """The picture in such bytes; raises `FileFormatError` for other bytes."""
        try:
            return message_decoder(cls, DOCUMENT_BYTES, _array)(content.tobytes())
        except (msgspec.MsgspecError, ValueError, RecursionError) as error:
            raise FileFormatError(f"these bytes are no picture, or are damaged ({error})") from error


def _plain(value: np.ndarray | np.generic) -> Any:
    return value.item() if isinstance(value, np.generic) else (value.dtype.str, value.shape, value.tobytes())


def _array(_kind: type, parts: Any) -> np.ndarray:
    number_type, shape, content = parts
    return np.frombuffer(content, number_type).reshape(shape)


@dataclass(frozen=True)
class Figure:
    """A published figure.

    name : as the paper numbers it, "fig. 5". make : computes it; its docstring is the caption: a heading, the method,
    and differences from print. claims : keys of claims of `papilla reproduce` about it. group : figures of one group
    share computations and run in one process, one after the other.
    """

    name: str
    make: Callable[[], Picture]
    claims: tuple[str, ...] = ()
    group: str = ""

    @property
    def title(self) -> str:
        """The content of the figure, in a line."""
        return inspect.cleandoc(self.make.__doc__ or "").split("\n")[0].rstrip(".")

    @property
    def caption(self) -> str:
        """The method, and differences from print."""
        return " ".join(inspect.cleandoc(self.make.__doc__ or "").split("\n")[1:]).strip()

    @property
    def stem(self) -> str:
        """Its name in a file name: "fig_5"."""
        return self.name.replace(".", "").replace(" ", "_").replace("(", "").replace(")", "").lower()


@dataclass(frozen=True)
class Paper:
    """title : of the paper, in short. figures : in its order. left_out : figures that are not drawn, by name, with the
    reason."""

    title: str
    figures: tuple[Figure, ...]
    left_out: Mapping[str, str]


CSV_HEADS = ("panel", "curve", "origin", "x_is", "x", "y_is", "y", "sd", "value_is", "value")


def as_csv(picture: Picture) -> str:
    """The data of a picture: its table, or a row for each point with the names of its panel and curve, its quantities
    and its origin.

    origin : see `Curve`. sd : standard deviation. Of a map every cell is a row with its value. What lies outside of the
    axes is left out; long curves and large maps are thinned.
    """
    text = io.StringIO()
    out = csv.writer(text, lineterminator="\n")
    if picture.table is not None:
        out.writerow(picture.table.heads)
        out.writerows([[_number(cell) for cell in row] for row in picture.table.rows])
    if picture.panels:
        out.writerow(CSV_HEADS)
        for panel in picture.panels:
            out.writerows(_rows(panel))
    return text.getvalue()


def _rows(panel: Panel) -> Iterator[list[str]]:
    for curve in panel.curves:
        low, high = panel.x_range or (-np.inf, np.inf)
        visible = np.flatnonzero((curve.x >= low) & (curve.x <= high))
        for row in visible[:: -(-len(visible) // MOST_ROWS) or 1]:
            x, y, sd = curve.x[row], curve.y[row], np.nan if curve.spread is None else curve.spread[row]
            place = panel.names[int(x)] if curve.look == "bars" else _number(float(x))
            ends = [panel.x_label, place, panel.y_label, _number(y), _number(sd), "", ""]
            yield [panel.title, curve.label, curve.origin, *ends]
    if panel.shade is not None:
        shade = panel.shade
        steps = [-(-len(axis) // MOST_CELLS) for axis in (shade.y, shade.x)]
        for row in range(0, len(shade.y), steps[0]):
            for column in range(0, len(shade.x), steps[1]):
                x, y, value = shade.x[column], shade.y[row], shade.value[row, column]
                cell = [panel.x_label, _number(x), panel.y_label, _number(y), "", shade.label, _number(value)]
                yield [panel.title, "map", "papilla", *cell]


def _number(value: str | float) -> str:
    """A number with six digits; empty for a non-finite one."""
    if isinstance(value, str):
        return value
    return f"{value:.6g}" if np.isfinite(value) else ""
