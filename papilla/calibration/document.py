"""calibration.json: the calibration record as text and back, bit for bit, without pickle."""

import math
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

import numpy as np
from pydantic import AfterValidator, Field, PlainValidator, TypeAdapter, ValidationError

from papilla.calibration.published import FORWARD_TERMS, INVERSE_TERMS, Quadratic, QuadraticInverse
from papilla.calibration.readouts import (
    COMPACT_TERMS,
    INTERVAL_PROBABILITY,
    Compact,
    GaugeSurface,
    PositionTerms,
    SdSurface,
    Uncertainty,
)
from papilla.calibration.surface import SPLINE_DEGREE, Axes, BicubicSurface
from papilla.core import checks
from papilla.core.errors import FileFormatError, InputError
from papilla.core.file_models import first_of, in_words, keys_of, table
from papilla.core.sealed import read_sealed

CALIBRATION_SCHEMA = "papilla.calibration/1"

Record = TypeVar("Record", bound=Any)

FORWARD_FORM = {
    "form": "quadratic",
    "terms": list(FORWARD_TERMS),
    "units": {"f": "gf", "E": "MPa", "sd": "microstrain"},
}
INVERSE_FORM = {"form": "E = branch * sqrt(terms) - shift", "terms": list(INVERSE_TERMS)}
SPLINE_FORM = {"form": "uniform bicubic B-spline over ln(force_N), ln(modulus_MPa)"}
SD_FORM = SPLINE_FORM | {"quantity": "ln(sd_microstrain)"}
GAUGE_FORM = SPLINE_FORM | {"quantity": "reading_microstrain / force_N"}
COMPACT_FORM = {
    "form": "ln sd = a + b ln_f + c ln_f^2 - log1p(exp(d + e ln_f) / E)",
    "terms": list(COMPACT_TERMS),
    "units": {"f": "N", "E": "MPa", "sd": "microstrain"},
}
POSITION_FORM = {
    "quantity": "(reading_microstrain - that at the apex) / force_N",
    "form": "uniform tricubic B-spline over ln(force_N), ln(modulus_MPa), position_mm",
}
"""Description of each part of the file, in words and units."""


def read_calibration(makes: type[Record], path: Path) -> Record:
    """The calibration of a file as the dataclass `makes` (`papilla.Calibration`), with a note if the file is not as
    papilla wrote it.

    Raises `FileAccessError` or `FileFormatError` (file and key named).
    """
    document, file_note = read_sealed(path, CALIBRATION_SCHEMA, "calibration")
    try:
        parts = _FILE.validate_python(document)
    except ValidationError as error:
        raise FileFormatError(f"{path}: {in_words(first_of(error))}") from error
    domain, calibration = parts.pop("domain"), makes(**parts.pop("softness"), **parts, file_note=file_note)
    if domain != calibration.domain:
        raise FileFormatError(f"{path}: domain differs from that of softness.surface")
    return calibration


def to_document(calibration: Any) -> dict[str, Any]:
    """The calibration as plain values under the documented keys, without a checksum."""
    record_fields, sd, position = calibration, calibration.surface, calibration.position
    softness: dict[str, Any] = {
        "forward": FORWARD_FORM | _values(record_fields.forward),
        "inverse": INVERSE_FORM | _values(record_fields.inverse),
        "surface": SD_FORM | _spline(sd) | {"usable_nodes": sd.usable, "twofold": sd.twofold},
        "gauges": [GAUGE_FORM | _spline(gauge) | {"name": gauge.name} for gauge in record_fields.gauges],
    }
    # Readers that do not know the optional part ignore it, so the schema is the same with and without it.
    if record_fields.compact is not None:
        softness["compact"] = COMPACT_FORM | _values(record_fields.compact)
    if position is not None:
        softness["position"] = POSITION_FORM | {"gauges": len(position.coefficients)} | _values(position)
    record = {
        "schema": CALIBRATION_SCHEMA,
        "finger": record_fields.finger,
        "mesh": record_fields.mesh,
        "softness": softness,
        "domain": record_fields.domain,
    }
    notes = (*record_fields.notes, record_fields.file_note) if record_fields.file_note else record_fields.notes
    return _plain(record | {"provenance": record_fields.provenance, "notes": notes})


def _values(record: Any) -> dict[str, Any]:
    """The fields of a dataclass; for a spline, also its cells."""
    cells = {"cells": record.cells} if isinstance(record, Axes) else {}
    return {item.name: getattr(record, item.name) for item in fields(record)} | cells


def _spline(channel: SdSurface | GaugeSurface) -> dict[str, Any]:
    return _values(channel.surface) | {"uncertainty": {"level": INTERVAL_PROBABILITY} | _values(channel.uncertainty)}


def _plain(value: Any) -> Any:
    """A value as JSON has it, NaN as null."""
    value = _values(value) if is_dataclass(value) else value
    if isinstance(value, Mapping):
        return {key: _plain(inner) for key, inner in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return _plain(value.tolist())
    if isinstance(value, list | tuple):
        return [_plain(inner) for inner in value]
    return None if value != value else value


# ---- What is accepted


def _numbers(*shape: int, gaps: bool = False, least: float = -math.inf) -> Any:
    """A pydantic type: nested lists of finite numbers, as an array of a shape (any shape if `shape` is empty).

    gaps : null stands for NaN, which JSON does not have; least : the smallest allowed number.
    """

    def array(values: Any) -> np.ndarray:
        """The array of nested lists; raises `InputError`."""
        nested = np.array(values, dtype=object)
        flat = [math.nan if value is None and gaps else value for value in nested.ravel().tolist()]
        if not isinstance(values, list) or not all(type(value) in (int, float) for value in flat):
            raise InputError("must be a list of numbers, each row as long as the others")
        try:
            numbers = np.array(flat, dtype=float).reshape(nested.shape)
        except OverflowError:
            numbers = np.array([math.inf])
        if np.isinf(numbers).any() or (np.isnan(numbers).any() and not gaps):
            raise InputError("must hold finite numbers alone")
        if (numbers < least).any():
            raise InputError("must not be negative")
        return _shaped("", numbers, shape or numbers.shape)

    return Annotated[Any, PlainValidator(array)]


def _shaped(name: str, array: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    if array.shape != shape:
        raise InputError(f"{name} must be a list of {' x '.join(map(str, shape))} finite numbers".strip())
    return array


def _surface(force_N, modulus_MPa, cells, coefficients) -> BicubicSurface:
    return BicubicSurface(
        force_N,
        modulus_MPa,
        _shaped("coefficients", coefficients, (cells[0] + SPLINE_DEGREE, cells[1] + SPLINE_DEGREE)),
    )


def _sd(uncertainty, usable_nodes, twofold, **spline) -> SdSurface:
    (m, n), nodes = spline["cells"], usable_nodes
    surface, nodes = _surface(**spline), _shaped("usable_nodes", nodes, (m, 2))
    if np.abs(surface.coefficients).max() > MOST_LN_SD:
        raise InputError(f"coefficients of ln(sd_microstrain) must lie between -{MOST_LN_SD:g} and {MOST_LN_SD:g}")
    if ((nodes < 0) | (nodes > n) | (nodes != nodes.round())).any():
        raise InputError(f"usable_nodes must hold whole numbers from 0 to {n}")
    return SdSurface(surface, nodes.astype(int), _shaped("twofold", twofold, (m, 2)), uncertainty)


def _gauge(name, uncertainty, **spline) -> GaugeSurface:
    return GaugeSurface(checks.name("name of a gauge", name), _surface(**spline), uncertainty)


def _position(gauges, cells, coefficients, **others) -> PositionTerms:
    shape = (gauges, *(count + SPLINE_DEGREE for count in cells))
    return PositionTerms(coefficients=_shaped("coefficients", coefficients, shape), **others)


def _softness(**parts) -> dict[str, Any]:
    position, gauges = parts["position"], len(parts["gauges"])
    if not 1 <= gauges <= MOST_CALIBRATED_GAUGES:
        raise InputError(f"gauges must hold 1 to {MOST_CALIBRATED_GAUGES} of them, got {gauges}")
    if position is not None and len(position.coefficients) != gauges:
        raise InputError(f"position must hold {gauges} gauges")
    return parts | {"gauges": tuple(parts["gauges"])}


def _named(finger: dict[str, Any]) -> dict[str, Any]:
    if finger.get("name"):
        checks.name("name", finger["name"])
    return finger


def _variance(matrix: np.ndarray) -> np.ndarray:
    """A covariance; raises `InputError` for one that no parameters can have. One with gaps is not judged."""
    scale = np.sqrt(np.abs(np.diag(matrix)))
    if not np.isnan(matrix).any():
        share = np.divide(matrix, np.outer(scale, scale), out=np.zeros_like(matrix), where=np.outer(scale, scale) > 0)
        symmetric = np.abs(share - share.T).max() <= CORRELATION_ROUNDING and not (matrix[scale == 0]).any()
        if not symmetric or np.linalg.eigvalsh(share).min() < -CORRELATION_ROUNDING:
            raise InputError("must be symmetric and positive semidefinite, as a covariance is")
    return matrix


CORRELATION_ROUNDING = 1e-6
"""Correlation by which a covariance may miss what it should be: its numbers may be rounded to seven digits."""
MOST_CALIBRATED_GAUGES = 1000
"""Most gauges of a calibration: each sample is a reading of each."""
MOST_LN_SD = 100.0
"""Largest |ln S_d| (S_d in microstrain): its exponential is a number that can still be squared."""
MOST_CALIBRATION_NOTES, NOTE_LETTERS = 1000, 2000
"""Most notes of a calibration, and letters of one; the largest have ten, and 300."""

_AT_LEAST_0, _ANY = Annotated[float, Field(ge=0)], _numbers()
_NOTE = Annotated[str, Field(max_length=NOTE_LETTERS)]
_TEXTS = Annotated[tuple[_NOTE, ...], Field(strict=False, max_length=MOST_CALIBRATION_NOTES)]
_RANGE = Annotated[tuple[float, float], Field(strict=False)]
_CELLS, _CELLS_3D = (Annotated[kind, Field(strict=False)] for kind in (tuple[int, int], tuple[int, int, int]))
_DOMAIN = {"force_N": _RANGE, "modulus_MPa": _RANGE}
_SPLINE = _DOMAIN | {"cells": _CELLS, "coefficients": _ANY}
_UNCERTAINTY = table(
    Uncertainty,
    dict.fromkeys(("fit_rms", "fit_factor", "fit_max", "scatter_factor"), _AT_LEAST_0)
    | {"scatter_force_N": _ANY, "scatter": _numbers(least=0), "meshes": Annotated[int, Field(ge=0)]}
    | {"strain": (_AT_LEAST_0, 0.0), "specimen": (_numbers(4) | None, None)}
    | dict.fromkeys(("friction", "identified", "form"), (table(_surface, _SPLINE) | None, None)),
    {"level": INTERVAL_PROBABILITY},
)
_FITTED = _SPLINE | {"uncertainty": _UNCERTAINTY}
_TERMS, _INVERSE_TERMS, _COMPACT_TERMS = map(len, (FORWARD_TERMS, INVERSE_TERMS, COMPACT_TERMS))
_QUADRATIC = {
    "coefficients": _numbers(_TERMS),
    "stderr": _numbers(_TERMS, gaps=True, least=0),
    "covariance": Annotated[_numbers(_TERMS, _TERMS, gaps=True), AfterValidator(_variance)],
} | dict.fromkeys(("rms", "max", "condition"), _AT_LEAST_0)
_INVERSE = {
    "coefficients": _numbers(_INVERSE_TERMS),
    "shift": float,
    "branch": Literal[-1, 1],
    "modulus_MPa": _RANGE | None,
}
_COMPACT = {"coefficients": _numbers(_COMPACT_TERMS)} | _DOMAIN
_COMPACT |= dict.fromkeys(("rms", "max", "sd_rms", "doubt"), _AT_LEAST_0)
_POSITION = _DOMAIN | {"gauges": int, "reach_mm": float, "cells": _CELLS_3D, "coefficients": _ANY, "error": _ANY}
_PARTS = {
    "forward": table(Quadratic, keys_of(Quadratic, **_QUADRATIC), FORWARD_FORM),
    "inverse": table(QuadraticInverse, _INVERSE, INVERSE_FORM),
    "compact": (table(Compact, _COMPACT, COMPACT_FORM) | None, None),
    "surface": table(_sd, _FITTED | {"usable_nodes": _ANY, "twofold": _numbers(gaps=True)}, SD_FORM),
    "gauges": list[table(_gauge, _FITTED | {"name": str}, GAUGE_FORM)],  # type: ignore[misc]
    "position": (table(_position, _POSITION, POSITION_FORM) | None, None),
}
_FILE: TypeAdapter[dict[str, Any]] = TypeAdapter(
    table(
        dict,
        {
            **dict.fromkeys(("mesh", "provenance"), dict[str, Any]),
            "finger": Annotated[dict[str, Any], AfterValidator(_named)],
            "softness": table(_softness, _PARTS),
            "domain": dict[str, _RANGE],
            "notes": _TEXTS,
        },
    )
)
