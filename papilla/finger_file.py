"""The finger's TOML design file: its keys, types and defaults are those of the classes in `papilla.finger`."""

import reprlib
import tomllib
from dataclasses import MISSING, astuple, fields, replace
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, get_args, get_origin, get_type_hints

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, create_model

from papilla.errors import FileAccessError, FileFormatError, InputError
from papilla.files import reason
from papilla.finger import Dome, Finger, Gauge, Layer, Ridges, Slab, Surfaces
from papilla.materials import Material, NeoHookean, Ogden, Yeoh


class _Table(BaseModel):
    """A table of the file; whole numbers do where a number is wanted, text and booleans do not."""

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)
    makes: ClassVar[Any]

    def made(self) -> Any:
        """The object that the table describes; raises `InputError`."""
        names = [name for name in type(self).model_fields if name not in ("kind", "model")]
        return type(self).makes(**{name: _made(name, getattr(self, name)) for name in names})


def _made(name: str, value: Any) -> Any:
    if isinstance(value, list):
        return tuple(_made("", item) for item in value)
    if not isinstance(value, _Table):
        return value
    try:
        return value.made()
    except InputError as error:
        raise InputError(f"[{name}] {error}" if name in ("outer", "inner", "bone") else str(error)) from error


def _table(of: type, makes: Any = None, *, unit: str | dict[str, str] = "", **changed: Any) -> Any:
    """The table of a dataclass: each field with its type and default, under its name and unit.

    unit : of every key, or of those named. changed : types of fields that are written otherwise, and a tag that tells
    the table from others.
    """
    hints = {**get_type_hints(of, localns={"Material": Material}), **changed}
    keys: dict[str, Any] = {name: (hints[name], ...) for name in changed if name in ("kind", "model")}
    for item in fields(of):
        hint = hints[item.name]
        rules: dict[str, Any] = {"min_length": 1} if hint is str or get_origin(hint) is list else {}
        if get_origin(hint) is tuple:
            rules["strict"] = False
        needed = None if type(None) in get_args(hint) else ...
        key = item.name + (unit if isinstance(unit, str) else unit.get(item.name, ""))
        default = needed if item.default is MISSING else item.default
        keys[item.name] = (hint, Field(default, alias=key, **rules))
    table = create_model(of.__name__, __base__=_Table, **keys)
    table.makes = makes or of
    return table


def _named_in_lower_case(table: Any) -> Any:
    """A material's table with the people's names in small letters: "neo-Hookean" is "neo-hookean"."""
    if isinstance(table, dict) and isinstance(table.get("model"), str):
        return {**table, "model": table["model"].lower()}
    return table


def _layer(modulus: float | None, nu: float, material: Material | None) -> Layer:
    if modulus is not None:
        return Layer(modulus, nu, material)
    if material is None:
        raise InputError("key modulus_MPa is missing")
    return Layer.of(material, nu)


_CARDS: Any = (
    _table(NeoHookean, unit="_MPa", model=Literal["neo-hookean"])
    | _table(Yeoh, unit="_MPa", model=Literal["yeoh"])
    | _table(Ogden, unit={"mu": "_MPa"}, model=Literal["ogden"])
)
_MATERIAL: Any = Annotated[Annotated[_CARDS, Field(discriminator="model")], BeforeValidator(_named_in_lower_case)]
_LAYER = _table(Layer, _layer, unit={"modulus": "_MPa"}, modulus=float | None, material=_MATERIAL | None)
_SHAPES: Any = (
    _table(Dome, unit="_mm", kind=Literal["dome"])
    | _table(Slab, unit="_mm", kind=Literal["slab"])
    | _table(Surfaces, unit="_file", kind=Literal["surfaces"])
)
_FINGER = _table(
    Finger,
    unit={"patch_radius": "_mm"},
    shape=Annotated[_SHAPES, Field(discriminator="kind")],
    outer=_LAYER,
    inner=_LAYER,
    bone=_LAYER | None,
    ridges=_table(Ridges, unit="_mm") | None,
    gauges=list[_table(Gauge)],  # type: ignore[misc]
)
_KINDS = ("dome", "slab", "surfaces", "neo-hookean", "yeoh", "ogden")
"""What pydantic puts into the place of a problem although it is no key."""


def read_design(path: Path) -> Finger:
    """The finger of a design file; the files of its surfaces are found beside it.

    Raises `FileAccessError` (missing, unreadable) or `FileFormatError` (not TOML, unknown key, wrong type or value).
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise FileFormatError(f"{path} is not a text file in UTF-8") from error
    except (OSError, ValueError) as error:
        raise FileAccessError(f"cannot read finger file {path}: {reason(error)}") from error
    try:
        finger = _FINGER.model_validate(tomllib.loads(text)).made()
        if isinstance(finger.shape, Surfaces):
            beside = Surfaces(*(str(path.parent / name) for name in astuple(finger.shape)))
            finger = replace(finger, shape=beside)
    except tomllib.TOMLDecodeError as error:
        raise FileFormatError(f"{path} is not valid TOML: {error}") from error
    except RecursionError as error:
        raise FileFormatError(f"{path} is not valid TOML: its brackets are nested too deeply") from error
    except ValidationError as error:
        raise FileFormatError(f"{path}: {_first_problem(error)}") from error
    except InputError as error:
        raise FileFormatError(f"{path}: {error}") from error
    return finger


def _first_problem(error: ValidationError) -> str:
    """The first problem of a validation as one line: key, message, value."""
    # A misspelt key is both unknown and missing: the unknown one tells more
    problem = min(error.errors(), key=lambda found: found["type"] != "extra_forbidden")
    key = ".".join(str(part) for part in problem["loc"] if part not in _KINDS)
    if problem["type"] == "extra_forbidden":
        return f"unknown key {key}"
    if problem["type"] == "missing":
        return f"key {key} is missing"
    return f"{key}: {problem['msg'].lower()}, got {reprlib.repr(problem['input'])}"
