"""The finger's TOML design file: its schema, and messages that name the key. `Finger.load` makes the finger of it."""

import tomllib
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError

from papilla.errors import FileAccessError, FileFormatError


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)


Number = float
"""Whole numbers do; text and booleans do not, by the tables' strictness."""

Pair = Annotated[tuple[Number, Number], Field(strict=False)]
Triple = Annotated[tuple[Number, Number, Number], Field(strict=False)]


class _NeoHookean(_Table):
    model: Literal["neo-hookean"]
    mu_MPa: Number


class _Yeoh(_Table):
    model: Literal["yeoh"]
    c1_MPa: Number
    c2_MPa: Number = 0.0
    c3_MPa: Number = 0.0


class _Ogden(_Table):
    model: Literal["ogden"]
    mu_MPa: Number
    alpha: Number


def _named_in_lower_case(table):
    """A material's table with the people's names in small letters: "neo-Hookean" is "neo-hookean"."""
    if isinstance(table, dict) and isinstance(table.get("model"), str):
        return {**table, "model": table["model"].lower()}
    return table


_Material = Annotated[
    Annotated[_NeoHookean | _Yeoh | _Ogden, Field(discriminator="model")], BeforeValidator(_named_in_lower_case)
]


class _Layer(_Table):
    modulus_MPa: Number | None = None
    nu: Number = 0.4999
    material: _Material | None = None


class _Dome(_Table):
    kind: Literal["dome"]
    outer_mm: Triple
    interface_mm: Triple
    bone_mm: Triple


class _Slab(_Table):
    kind: Literal["slab"]
    outer_mm: Pair
    interface_mm: Pair
    bone_mm: Pair
    depth_mm: Number = 10.0


class _Surfaces(_Table):
    kind: Literal["surfaces"]
    outer_file: str
    interface_file: str
    bone_file: str


class _Ridges(_Table):
    pitch_mm: Number
    width_mm: Number
    height_mm: Number


class _Gauge(_Table):
    name: str = Field(min_length=1)
    angle_deg: Number | None = None
    x_mm: Number | None = None
    y_mm: Number = 0.0
    direction_deg: Number = 0.0
    length_mm: Number = 2.4
    backing_mm: Pair = (4.8, 2.0)
    membrane_gain: Number = 1.0
    lever_mm: Number = 0.0


class _FingerFile(_Table):
    name: str = Field(min_length=1)
    shape: Annotated[_Dome | _Slab | _Surfaces, Field(discriminator="kind")]
    outer: _Layer
    inner: _Layer
    bone: _Layer | None = None
    patch_radius_mm: Number = 15.0
    ridges: _Ridges | None = None
    gauges: list[_Gauge] = Field(min_length=1)


_KINDS = ("dome", "slab", "surfaces", "neo-hookean", "yeoh", "ogden")
"""What pydantic puts into the place of a problem although it is no key."""


def read_design(path: Path) -> dict:
    """The checked tables of a design file as nested plain values, under the keys of the file.

    Raises `FileAccessError` (missing, unreadable) or `FileFormatError` (not TOML, unknown key, wrong type).
    """
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise FileAccessError(f"cannot read finger file {path}: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise FileFormatError(f"{path} is not a text file in UTF-8") from error
    try:
        return _FingerFile.model_validate(tomllib.loads(text)).model_dump()
    except tomllib.TOMLDecodeError as error:
        raise FileFormatError(f"{path} is not valid TOML: {error}") from error
    except ValidationError as error:
        raise FileFormatError(f"{path}: {_first_problem(error)}") from error


def _first_problem(error: ValidationError) -> str:
    """The first problem of a validation as one line: key, message, value."""
    # A misspelt key is both unknown and missing: the unknown one tells more
    problem = min(error.errors(), key=lambda found: found["type"] != "extra_forbidden")
    key = ".".join(str(part) for part in problem["loc"] if part not in _KINDS)
    if problem["type"] == "extra_forbidden":
        return f"unknown key {key}"
    if problem["type"] == "missing":
        return f"key {key} is missing"
    return f"{key}: {problem['msg'].lower()}, got {problem['input']!r}"
