"""calibration.json: the calibration record as text, and back, bit for bit; no pickle.

The models below are the file's format: what is written and what is accepted. A checksum over the content tells a file
that was edited after papilla wrote it.
"""

import hashlib
import json
import math
import re
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    ValidationError,
    model_validator,
)
from pydantic_core import core_schema

from papilla.calibration.quadratic import FORWARD_TERMS, INVERSE_TERMS, Quadratic, QuadraticInverse
from papilla.calibration.readouts import LEVEL, GaugeSurface, PositionTerms, SdSurface, Uncertainty
from papilla.calibration.record import Calibration
from papilla.calibration.surface import Surface
from papilla.errors import FileAccessError, FileFormatError, InputError
from papilla.files import write_text

SCHEMA = "papilla.calibration/1"
SPLINE = "uniform bicubic B-spline over ln(force_N), ln(modulus_MPa)"
UNITS = {"f": "gf", "E": "MPa", "sd": "microstrain"}
CHECKSUM = "content_sha256"
NO_CHECKSUM = "the file has no checksum: nothing tells whether it is as papilla wrote it"
EDITED = "the file was changed after papilla wrote it: its checksum does not match, so nothing vouches for its answers"


def write_calibration(calibration: Calibration, path: Path) -> None:
    """Write a calibration with its checksum, whole or not at all; raises `FileAccessError`."""
    document = to_document(calibration)
    text = json.dumps(document | {CHECKSUM: checksum(document)}, indent=1, allow_nan=False, ensure_ascii=False)
    # Innermost lists of numbers on one line each: a row of coefficients is a line.
    text = re.sub(r"\[\s+([^\[\]{}\"]*?)\s+\]", lambda match: "[" + " ".join(match[1].split()) + "]", text)
    write_text(path, text + "\n")


def read_calibration(path: Path) -> Calibration:
    """The calibration of a file, with a remark where the file is not as papilla wrote it.

    Raises `FileAccessError` or `FileFormatError` (file and key named).
    """
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise FileAccessError(f"cannot read calibration {path}: {error.strerror or error}") from error
    except (ValueError, RecursionError) as error:
        raise FileFormatError(f"{path} is not a calibration, or was cut short: not valid JSON ({error})") from error
    schema = document.get("schema") if isinstance(document, dict) else None
    if schema != SCHEMA:
        raise FileFormatError(f"{path}: the schema is {schema!r}, this version of papilla reads {SCHEMA!r}")
    try:
        calibration = from_document(document)
    except (InputError, OverflowError) as error:
        raise FileFormatError(f"{path}: {error}") from error
    stated = document.pop(CHECKSUM, None)
    if stated == checksum(document):
        return calibration
    return replace(calibration, remark=NO_CHECKSUM if stated is None else EDITED)


def checksum(document: dict) -> str:
    """SHA-256 of a document's values, whatever the spaces and the order of its keys."""
    text = json.dumps(document, sort_keys=True, separators=(",", ":"), ensure_ascii=False)
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()


def to_document(calibration: Calibration) -> dict:
    """The calibration as plain values under the documented keys, without a checksum."""
    one = calibration
    softness = {
        "forward": one.forward,
        "inverse": one.inverse,
        "surface": _splines(one.surface) | {"usable_nodes": one.surface.usable, "twofold": one.surface.twofold},
        "gauges": [_splines(gauge) | {"name": gauge.name} for gauge in one.gauges],
        "position": one.position
        and {name: getattr(one.position, name) for name in _Position.model_fields if hasattr(one.position, name)}
        | {"gauges": len(one.position.coefficients)},
    }
    parts = {name: getattr(one, name) for name in ("finger", "mesh", "domain", "provenance")}
    parts["notes"] = (*one.notes, one.remark) if one.remark else one.notes
    # Readers that do not know the optional part pass it over, so the schema is the same with and without it.
    absent = {"softness": {"position"}} if one.position is None else None
    return _File.model_validate(parts | {"softness": softness}).model_dump(mode="json", by_alias=True, exclude=absent)


def from_document(document: dict) -> Calibration:
    """The calibration of plain values; raises `InputError` naming the key."""
    try:
        return _File.model_validate(document).calibration
    except ValidationError as error:
        raise InputError(_first_problem(error)) from error


def _first_problem(error: ValidationError) -> str:
    """The first problem of a validation as one line: key, what is wrong, value."""
    problem = error.errors()[0]
    key = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in problem["loc"])[1:]
    if problem["type"] == "missing":
        return f"key {key} is missing"
    said = problem["msg"].removeprefix("Value error, ").replace("Input should be", "must be")
    said = f"{key} {said}" if said.startswith("must") else f"{key}: {said}" if key else said
    if problem["type"] == "value_error":
        return said
    shown = repr(problem["input"])
    return f"{said}, got {shown if len(shown) <= 60 else shown[:57] + '...'}"


def _splines(part: SdSurface | GaugeSurface) -> dict:
    surface = part.surface
    table = {name: getattr(surface, name) for name in ("force_N", "modulus_MPa", "cells", "coefficients")}
    return table | {"uncertainty": part.uncertainty}


# ---- Types of the fields


def _same(expected, value):
    if value != expected:
        raise InputError(f"must be {expected!r}, got {value!r}")
    return value


class _Numbers:
    """Nested lists of finite numbers as an array of a shape (any, where it is empty).

    gaps : null stands for NaN, which JSON has not.
    """

    def __init__(self, *shape: int, gaps: bool = False):
        self._shape, self._gaps = shape, gaps

    def __get_pydantic_core_schema__(self, source, handler):
        written = core_schema.plain_serializer_function_ser_schema(_lists)
        return core_schema.no_info_plain_validator_function(self._array, serialization=written)

    def _array(self, values) -> np.ndarray:
        if isinstance(values, np.ndarray):
            return values
        found = np.array(values, dtype=object)
        flat = [math.nan if value is None and self._gaps else value for value in found.ravel().tolist()]
        if not isinstance(values, list) or not all(type(value) in (int, float) for value in flat):
            raise InputError("must be a list of numbers, each row as long as the others")
        numbers = np.array(flat, dtype=float).reshape(found.shape)
        if np.isinf(numbers).any() or (np.isnan(numbers).any() and not self._gaps):
            raise InputError("must hold finite numbers alone")
        return _shaped(numbers, self._shape or numbers.shape)


def _shaped(array: np.ndarray, shape: tuple[int, ...], name: str = "") -> np.ndarray:
    if array.shape != shape:
        raise InputError(f"{name} must be a list of {' x '.join(map(str, shape))} finite numbers".strip())
    return array


def _not_negative(array: np.ndarray) -> np.ndarray:
    if (array < 0).any():
        raise InputError("must not be negative")
    return array


def _lists(array: np.ndarray):
    return [_lists(row) if row.ndim else None if np.isnan(row) else row.item() for row in array]


Numbers = Annotated[np.ndarray, _Numbers()]
Gaps = Annotated[np.ndarray, _Numbers(gaps=True)]
Interval = Annotated[tuple[float, float], Field(strict=False)]
Texts = Annotated[tuple[str, ...], Field(strict=False)]
AtLeast0 = Annotated[float, Field(ge=0)]


class _Part(BaseModel):
    model_config = ConfigDict(strict=True, allow_inf_nan=False, from_attributes=True, arbitrary_types_allowed=True)

    def _check(self, name: str, *shape: int) -> np.ndarray:
        """The numbers of a field; `InputError` where they have another shape."""
        return _shaped(getattr(self, name), shape, name)

    def _kept(self, *left_out: str) -> dict:
        return {name: getattr(self, name) for name in type(self).model_fields if name not in left_out}


# ---- The parts of the file, in their order


class _Forward(_Part):
    form: Literal["quadratic"] = "quadratic"
    terms: Annotated[list, AfterValidator(partial(_same, list(FORWARD_TERMS)))] = list(FORWARD_TERMS)
    units: Annotated[dict, AfterValidator(partial(_same, UNITS))] = UNITS
    coefficients: Annotated[np.ndarray, _Numbers(5)]
    stderr: Annotated[np.ndarray, _Numbers(5, gaps=True), AfterValidator(_not_negative)]
    covariance: Annotated[np.ndarray, _Numbers(5, 5, gaps=True)]
    rms: AtLeast0
    max: AtLeast0
    modulus_MPa: Interval
    condition: AtLeast0
    notes: Texts


class _Inverse(_Part):
    form: str = "E = branch * sqrt(terms) - shift"
    terms: Annotated[list, AfterValidator(partial(_same, list(INVERSE_TERMS)))] = list(INVERSE_TERMS)
    coefficients: Annotated[np.ndarray, _Numbers(4)]
    shift: float
    branch: Literal[-1, 1]
    modulus_MPa: Interval | None


class _Uncertainty(_Part):
    level: Annotated[float, AfterValidator(partial(_same, LEVEL))] = LEVEL
    fit_rms: AtLeast0
    fit_factor: AtLeast0
    fit_max: AtLeast0
    scatter_force_N: Numbers
    scatter: Annotated[Numbers, AfterValidator(_not_negative)]
    scatter_factor: AtLeast0
    meshes: Annotated[int, Field(ge=0)]

    @model_validator(mode="after")
    def _shapes(self):
        forces = self._check("scatter_force_N", self.scatter_force_N.size)
        if not len(forces) or (forces <= 0).any() or (np.diff(forces) <= 0).any():
            raise InputError("scatter_force_N must rise and be above 0")
        self._check("scatter", len(forces))
        return self

    @property
    def uncertainty(self) -> Uncertainty:
        return Uncertainty(**self._kept("level"))


class _Surface(_Part):
    form: Annotated[str, AfterValidator(partial(_same, SPLINE))] = SPLINE
    force_N: Interval
    modulus_MPa: Interval
    cells: Annotated[tuple[int, int], Field(strict=False)]
    coefficients: Numbers
    uncertainty: _Uncertainty

    @model_validator(mode="after")
    def _shapes(self):
        _ = self.surface
        return self

    @property
    def surface(self) -> Surface:
        coefficients = self._check("coefficients", self.cells[0] + 3, self.cells[1] + 3)
        return Surface(self.force_N, self.modulus_MPa, coefficients)


class _Sd(_Surface):
    quantity: Literal["ln(sd_microstrain)"] = "ln(sd_microstrain)"
    usable_nodes: Numbers
    twofold: Gaps

    @model_validator(mode="after")
    def _nodes(self):
        nodes, last = self._check("usable_nodes", self.cells[0], 2), self.cells[1]
        if ((nodes < 0) | (nodes > last) | (nodes != nodes.round())).any():
            raise InputError(f"usable_nodes must hold whole numbers from 0 to {last}")
        self._check("twofold", self.cells[0], 2)
        return self


class _Gauge(_Surface):
    name: str
    quantity: Literal["reading_microstrain / force_N"] = "reading_microstrain / force_N"


class _Position(_Part):
    quantity: Literal["(reading_microstrain - that at the apex) / force_N"] = (
        "(reading_microstrain - that at the apex) / force_N"
    )
    form: Literal["uniform tricubic B-spline over ln(force_N), ln(modulus_MPa), position_mm"] = (
        "uniform tricubic B-spline over ln(force_N), ln(modulus_MPa), position_mm"
    )
    gauges: int
    force_N: Interval
    modulus_MPa: Interval
    reach_mm: float
    cells: Annotated[tuple[int, int, int], Field(strict=False)]
    coefficients: Numbers
    error: Numbers

    @model_validator(mode="after")
    def _shapes(self):
        _ = self.terms
        return self

    @property
    def terms(self) -> PositionTerms:
        self._check("coefficients", self.gauges, *(cells + 3 for cells in self.cells))
        return PositionTerms(**self._kept("quantity", "form", "gauges", "cells"))


class _Softness(_Part):
    forward: _Forward
    inverse: _Inverse
    surface: _Sd
    gauges: list[_Gauge]
    position: _Position | None = None


class _File(_Part):
    schema_: Annotated[str, AfterValidator(partial(_same, SCHEMA))] = Field(SCHEMA, alias="schema")
    finger: dict[str, Any]
    mesh: dict[str, Any]
    softness: _Softness
    domain: dict[str, Interval]
    provenance: dict[str, Any]
    notes: Texts

    @model_validator(mode="after")
    def _agree(self):
        position, surface, gauges = self.softness.position, self.softness.surface, len(self.softness.gauges)
        if position is not None and position.gauges != gauges:
            raise InputError(f"softness.position must hold {gauges} gauges")
        if self.domain != {"force_N": surface.force_N, "modulus_MPa": surface.modulus_MPa}:
            raise InputError("domain differs from that of softness.surface")
        return self

    @property
    def calibration(self) -> Calibration:
        softness, sd = self.softness, self.softness.surface
        return Calibration(
            **self._kept("schema_", "softness", "domain"),
            forward=Quadratic(**softness.forward._kept("form", "terms", "units")),
            inverse=QuadraticInverse(**softness.inverse._kept("form", "terms")),
            surface=SdSurface(sd.surface, sd.usable_nodes.astype(int), sd.twofold, sd.uncertainty.uncertainty),
            gauges=tuple(GaugeSurface(one.name, one.surface, one.uncertainty.uncertainty) for one in softness.gauges),
            position=None if softness.position is None else softness.position.terms,
        )
