"""Models of files, made of the classes that they describe: keys, types and defaults stand once, in the class."""

import reprlib
from collections.abc import Callable, Mapping
from dataclasses import MISSING, fields
from functools import partial
from types import MappingProxyType
from typing import Annotated, Any, Literal, get_args, get_origin, get_type_hints

from pydantic import AfterValidator, ConfigDict, Field, ValidationError, create_model

from papilla.errors import InputError

RULES = ConfigDict(strict=True, allow_inf_nan=False, arbitrary_types_allowed=True)
"""Whole numbers do where a number is wanted, text and booleans do not."""


def keys_of(of: type, *, unit: str | Mapping[str, str] = "", **changed: Any) -> dict[str, Any]:
    """The keys of a dataclass for `table`: each field with its type and default, under its name and unit.

    unit : of every key, or of those named. changed : types of the fields that are written otherwise.
    """
    # Names that a module knows to type checkers alone are among those that are written otherwise
    hints = {**get_type_hints(of, localns={"Material": Any}), **changed}
    keys = {}
    for item in fields(of):
        hint = hints[item.name]
        rules: dict[str, Any] = {"min_length": 1} if hint is str else {}
        if get_origin(hint) is tuple:
            rules["strict"] = False
        needed = None if type(None) in get_args(hint) else ...
        default = needed if item.default is MISSING else item.default
        key = item.name + (unit if isinstance(unit, str) else unit.get(item.name, ""))
        keys[item.name] = (hint, Field(default, alias=key, **rules))
    return keys


def table(
    makes: Callable[..., Any],
    keys: Mapping[str, Any],
    constants: Mapping[str, Any] = MappingProxyType({}),
    *,
    known: bool = False,
) -> Any:
    """The type of a table of a file that becomes `makes(**keys)`.

    keys : name -> type, or type and field. constants : keys of one value, which tell what the table holds. known : no
    other keys may stand there. An `InputError` of `makes` becomes a problem of the table.
    """
    fixed: dict[str, Any] = {key: (_one_of(value), value) for key, value in constants.items()}
    given: dict[str, Any] = {name: key if isinstance(key, tuple) else (key, ...) for name, key in keys.items()}
    config = RULES | ConfigDict(extra="forbid" if known else "ignore")
    model: Any = create_model(makes.__name__, __config__=config, **fixed, **given)
    return Annotated[model, AfterValidator(lambda found: makes(**{name: getattr(found, name) for name in keys}))]


def _one_of(value: Any) -> Any:
    return Literal[value] if isinstance(value, str) else Annotated[Any, AfterValidator(partial(_same, value))]


def _same(expected: Any, value: Any) -> Any:
    if value != expected:
        raise InputError(f"must be {expected!r}, got {value!r}")
    return value


def first_of(error: ValidationError) -> Mapping[str, Any]:
    """The problem of a validation that tells most: a misspelt key is both unknown and missing."""
    return min(error.errors(), key=lambda found: found["type"] != "extra_forbidden")


def in_words(problem: Mapping[str, Any], tags: tuple[str, ...] = ()) -> str:
    """A problem as one line: key, what is wrong, value.

    tags : what pydantic puts into the place of a problem, after its first key, although it is no key.
    """
    first, *inside = problem["loc"] or ("",)
    places = (first, *(part for part in inside if part not in tags))
    key = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in places).removeprefix(".")
    if problem["type"] == "extra_forbidden":
        return f"unknown key {key}"
    if problem["type"] == "missing":
        return f"key {key} is missing"
    said = problem["msg"].removeprefix("Value error, ").replace("Input should be", "must be")
    said = said.replace("a valid dictionary or object to extract fields from", "a table")
    said = f"{key} {said}" if said.startswith("must") else f"{key}: {said}" if key else said
    return said if problem["type"] == "value_error" else f"{said}, got {reprlib.repr(problem['input'])}"
