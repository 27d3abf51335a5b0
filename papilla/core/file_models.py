"""Pydantic models of files, derived from dataclasses: keys, types and defaults are written once, in the dataclass."""

import reprlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, fields
from functools import partial
from types import MappingProxyType
from typing import Annotated, Any, Literal, get_args, get_origin, get_type_hints

from pydantic import AfterValidator, BeforeValidator, ConfigDict, Field, ValidationError, create_model
from pydantic_core import PydanticCustomError

from papilla.core.errors import InputError
from papilla.core.tables import closest

STRICT_RULES = ConfigDict(strict=True, allow_inf_nan=False, arbitrary_types_allowed=True)
"""An integer is accepted for a float; text and booleans are not."""

KEY_LETTERS = 100
"""Most letters of a key that are printed."""

UNKNOWN_KEY = "unknown_key"
"""Type of the error on a key that a table does not have."""


def keys_of(of: type, *, unit: str | Mapping[str, str] = "", **changed: Any) -> dict[str, Any]:
    """The keys of a dataclass for `table`: field name -> (type, default), with the unit appended to the key's name.

    unit : of every key, or of the named ones. changed : types of fields that the file writes in another form.
    """
    # Material is imported for type checkers only; `changed` replaces its type
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
    strict_keys: bool = False,
) -> Any:
    """The type of a table in a file; validation returns `makes(**keys)`.

    keys : name -> type, or (type, field). constants : keys with a fixed value, which identify the table. known : refuse
    other keys. An `InputError` of `makes` is reported as an error of the table.
    """
    fixed: dict[str, Any] = {key: (_one_of(value), value) for key, value in constants.items()}
    declared: dict[str, Any] = {name: key if isinstance(key, tuple) else (key, ...) for name, key in keys.items()}
    model: Any = create_model(makes.__name__, __config__=STRICT_RULES, **fixed, **declared)
    maker = AfterValidator(lambda model: makes(**{name: getattr(model, name) for name in keys}))
    if not strict_keys:
        return Annotated[model, maker]
    names = [field.alias or name for name, field in model.model_fields.items()]
    return Annotated[model, BeforeValidator(partial(_refuse_unknown, names)), maker]


def _refuse_unknown(names: Sequence[str], content: Any) -> Any:
    for key in content if isinstance(content, dict) else ():
        if key not in names:
            raise PydanticCustomError(UNKNOWN_KEY, "unknown key", {"key": key, "near": closest(str(key), names)})
    return content


def _one_of(value: Any) -> Any:
    return Literal[value] if isinstance(value, str) else Annotated[Any, AfterValidator(partial(_same, value))]


def _same(expected: Any, value: Any) -> Any:
    if value != expected:
        raise InputError(f"must be {expected!r}, got {reprlib.repr(value)}")
    return value


def first_of(error: ValidationError) -> Mapping[str, Any]:
    """The most helpful error of a validation: for a misspelt key, "unknown key" is more helpful than "key missing"."""
    first = min(error.errors(), key=lambda fault: fault["type"] != UNKNOWN_KEY)
    return {**first, "loc": (*first["loc"], first["ctx"]["key"])} if first["type"] == UNKNOWN_KEY else first


def _shown(key: str) -> str:
    """A key of a file, which may be of any length and have any letter in it."""
    return key if key.isprintable() and len(key) <= KEY_LETTERS else reprlib.repr(key)


def in_words(problem: Mapping[str, Any], tags: tuple[str, ...] = ()) -> str:
    """An error as one line: key, what is wrong, value.

    tags : names that pydantic inserts into the location of an error, after its first key, although they are no keys.
    """
    first, *inside = (step if isinstance(step, int) else _shown(step) for step in problem["loc"] or ("",))
    places = (first, *(step for step in inside if step not in tags))
    key = "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in places).removeprefix(".")
    if problem["type"] == UNKNOWN_KEY:
        near = problem["ctx"]["near"]
        return f"unknown key {key}" + (f"; did you mean {near}?" if near else "")
    if problem["type"] == "missing":
        return f"key {key} is missing"
    message = problem["msg"].removeprefix("Value error, ").replace("Input should be", "must be")
    message = message.replace("a valid dictionary or object to extract fields from", "a table")
    message = f"{key} {message}" if message.startswith("must") else f"{key}: {message}" if key else message
    return message if problem["type"] == "value_error" else f"{message}, got {reprlib.repr(problem['input'])}"
