"""Validation at the boundary: each check returns the value as a float or raises `InputError` with one clear line."""

import math
import reprlib
from typing import TYPE_CHECKING, Any
from unicodedata import category

from papilla.core.errors import InputError

SIZE_OPTION = "--size-mm of press, calibrate and view"
"""Name of the element size `size_mm` on the command line; messages that advise another size name both."""

ROUNDING_SHARE = 1e-9
"""Share by which a number may exceed a bound that it should meet exactly: more than the rounding of a few thousand
operations, less than any tolerance of manufacture."""

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np


def finite(name: str, value: Any) -> float:
    """The value as a finite float; raises `InputError` for text, NaN and infinities."""
    if value is None or isinstance(value, bool | str):
        raise InputError(f"{name} must be a number, got {value!r}")
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError(f"{name} must be a number, got {value!r}") from error
    if not math.isfinite(number):
        raise InputError(f"{name} must be finite, got {number}")
    return number


def positive(name: str, value: Any) -> float:
    """The value as a float > 0."""
    number = finite(name, value)
    if number <= 0:
        raise InputError(f"{name} must be greater than 0, got {number:g}")
    return number


def within(name: str, value: Any, low: float, high: float) -> float:
    """The value as a float in the closed interval [low, high]."""
    number = finite(name, value)
    if not low <= number <= high:
        raise InputError(f"{name} must lie between {low:g} and {high:g}, got {number:g}")
    return number


def rising(name: str, value: Any) -> tuple[float, float]:
    """A range (low, high) as floats, 0 < low < high."""
    try:
        low, high = value
    except (TypeError, ValueError):
        raise InputError(f"{name} must be two numbers (low, high), got {value!r}") from None
    low, high = positive(f"{name} (low end)", low), positive(f"{name} (high end)", high)
    if low >= high:
        raise InputError(f"{name} must rise, got {low:g} and {high:g}")
    return low, high


LONGEST_NAME_LETTERS = 200
"""Most letters of a name: of a finger, a gauge, a study."""


def name(what: str, value: Any) -> str:
    """A name: text of 1 to `LONGEST_NAME_LETTERS` letters on one line, without control characters and marks of
    direction, by which it could change what stands around it. Letters of every script may be in it, and every sign."""
    if not isinstance(value, str) or not 1 <= len(value) <= LONGEST_NAME_LETTERS:
        length = f"{len(value)} letters" if isinstance(value, str) else reprlib.repr(value)
        raise InputError(f"{what} must be a text of 1 to {LONGEST_NAME_LETTERS} letters, got {length}")
    for letter in value:
        if not letter.isprintable() and category(letter) != "Zs":
            raise InputError(f"{what} has {letter!r} in it, which cannot be printed: {reprlib.repr(value)}")
    return value


LARGEST_READING = 1e12
"""Largest sample that counts as a reading, in any unit. Its fourth power is still a finite float."""


def place(name: str, value: "Sequence[float]") -> tuple[float, float]:
    """A point (x, y) in mm as floats; its squares are finite."""
    try:
        x, y = value
    except (TypeError, ValueError):
        raise InputError(f"{name} must be two numbers (x, y) in mm, got {value!r}") from None
    return within(f"{name} x (mm)", x, -LARGEST_READING, LARGEST_READING), within(
        f"{name} y (mm)", y, -LARGEST_READING, LARGEST_READING
    )


def believable(values: "np.ndarray") -> "np.ndarray":
    """Samples with NaN where |value| is infinite or greater than `LARGEST_READING`."""
    import numpy as np

    return np.where(np.abs(values) <= LARGEST_READING, values, np.nan)


def poisson(name: str, value: Any) -> float:
    """A Poisson's ratio in [0, 0.5]; exactly 0.5 (incompressible) is allowed."""
    return within(name, value, 0.0, 0.5)
