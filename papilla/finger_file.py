"""The finger's TOML design file: schema, clear messages, and the way to a `Finger`."""

import tomllib
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from papilla.errors import FileAccessError, FileFormatError, InputError
from papilla.finger import Dome, Finger, Gauge, Layer, Ridges, Slab, Surfaces


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)


Number = Annotated[float, Field(strict=False)]
Pair = Annotated[tuple[Number, Number], Field(strict=False)]
Triple = Annotated[tuple[Number, Number, Number], Field(strict=False)]


class _Layer(_Table):
    modulus_MPa: Number
    nu: Number = 0.4999

    def value(self) -> Layer:
        return Layer(self.modulus_MPa, self.nu)


class _Dome(_Table):
    kind: Literal["dome"]
    outer_mm: Triple
    interface_mm: Triple
    bone_mm: Triple

    def value(self, _folder: Path) -> Dome:
        return Dome(self.outer_mm, self.interface_mm, self.bone_mm)


class _Slab(_Table):
    kind: Literal["slab"]
    outer_mm: Pair
    interface_mm: Pair
    bone_mm: Pair
    depth_mm: Number = 10.0

    def value(self, _folder: Path) -> Slab:
        return Slab(self.outer_mm, self.interface_mm, self.bone_mm, self.depth_mm)


class _Surfaces(_Table):
    kind: Literal["surfaces"]
    outer_file: str
    interface_file: str
    bone_file: str

    def value(self, folder: Path) -> Surfaces:
        return Surfaces(*(str(folder / name) for name in (self.outer_file, self.interface_file, self.bone_file)))


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

    def value(self) -> Gauge:
        return Gauge(**self.model_dump())


class _FingerFile(_Table):
    name: str = Field(min_length=1)
    shape: Annotated[_Dome | _Slab | _Surfaces, Field(discriminator="kind")]
    outer: _Layer
    inner: _Layer
    bone: _Layer | None = None
    patch_radius_mm: Number = 15.0
    ridges: _Ridges | None = None
    gauges: list[_Gauge] = Field(min_length=1)


def read_finger(path: Path) -> Finger:
    """The finger of a TOML file; surface files are found relative to it.

    Raises `FileAccessError` (missing, unreadable) or `FileFormatError` (not TOML, unknown key, unusable value).
    """
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise FileAccessError(f"cannot read finger file {path}: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise FileFormatError(f"{path} is not a text file in UTF-8") from error
    try:
        table = _FingerFile.model_validate(tomllib.loads(text))
        ridges = table.ridges
        return Finger(
            name=table.name,
            shape=table.shape.value(path.parent),
            outer=table.outer.value(),
            inner=table.inner.value(),
            bone=table.bone.value() if table.bone else None,
            patch_radius=table.patch_radius_mm,
            ridges=Ridges(ridges.pitch_mm, ridges.width_mm, ridges.height_mm) if ridges else None,
            gauges=tuple(gauge.value() for gauge in table.gauges),
        )
    except tomllib.TOMLDecodeError as error:
        raise FileFormatError(f"{path} is not valid TOML: {error}") from error
    except ValidationError as error:
        raise FileFormatError(f"{path}: {_first_problem(error)}") from error
    except InputError as error:
        raise FileFormatError(f"{path}: {error}") from error


def _first_problem(error: ValidationError) -> str:
    """The first problem of a validation as one line: key, message, value."""
    problem = error.errors()[0]
    key = ".".join(str(part) for part in problem["loc"] if part not in ("dome", "slab", "surfaces"))
    if problem["type"] == "extra_forbidden":
        return f"unknown key {key}"
    if problem["type"] == "missing":
        return f"key {key} is missing"
    return f"{key}: {problem['msg'].lower()}, got {problem['input']!r}"
