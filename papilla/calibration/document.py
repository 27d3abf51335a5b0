"""calibration.json: the calibration record as text, and back, bit for bit; no pickle, no extra library."""

import json
import math
import re
from pathlib import Path

import numpy as np

from papilla.calibration.data import CalibrationData
from papilla.calibration.json_table import JsonTable
from papilla.calibration.position import PositionTerms
from papilla.calibration.quadratic import FORWARD_TERMS, INVERSE_TERMS, Quadratic, QuadraticInverse
from papilla.calibration.readouts import LEVEL, GaugeSurface, SdSurface, Uncertainty
from papilla.calibration.surface import Surface
from papilla.errors import FileAccessError, FileFormatError, InputError
from papilla.files import write_text

SCHEMA = "papilla.calibration/1"
SPLINE = "uniform bicubic B-spline over ln(force_N), ln(modulus_MPa)"
POSITION_SPLINE = "uniform tricubic B-spline over ln(force_N), ln(modulus_MPa), position_mm"
POSITION_QUANTITY = "(reading_microstrain - that at the apex) / force_N"
UNITS = {"f": "gf", "E": "MPa", "sd": "microstrain"}


def write_calibration(calibration: CalibrationData, path: Path) -> None:
    """Write a calibration, whole or not at all; raises `FileAccessError`."""
    text = json.dumps(to_document(calibration), indent=1, allow_nan=False, ensure_ascii=False)
    # Innermost lists of numbers on one line each: a row of coefficients is a line.
    text = re.sub(r"\[\s+([^\[\]{}\"]*?)\s+\]", lambda match: "[" + " ".join(match[1].split()) + "]", text)
    write_text(path, text + "\n")


def read_calibration(path: Path) -> CalibrationData:
    """Read a calibration; raises `FileAccessError` or `FileFormatError` (file and key named)."""
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
        return from_document(document)
    except (InputError, OverflowError) as error:
        raise FileFormatError(f"{path}: {error}") from error


def to_document(calibration: CalibrationData) -> dict:
    """The calibration as plain values under the documented keys."""
    forward, inverse, sd = calibration.forward, calibration.inverse, calibration.surface
    return {
        "schema": SCHEMA,
        "finger": calibration.finger,
        "mesh": calibration.mesh,
        "softness": {
            "forward": {
                "form": "quadratic",
                "terms": list(FORWARD_TERMS),
                "units": UNITS,
                "coefficients": forward.coefficients.tolist(),
                "stderr": _nulls(forward.stderr),
                "covariance": [_nulls(row) for row in forward.covariance],
                "rms": forward.rms,
                "max": forward.max,
                "modulus_MPa": list(forward.modulus_MPa),
                "condition": forward.condition,
                "notes": list(forward.notes),
            },
            "inverse": {
                "form": "E = branch * sqrt(terms) - shift",
                "terms": list(INVERSE_TERMS),
                "coefficients": inverse.coefficients.tolist(),
                "shift": inverse.shift,
                "branch": inverse.branch,
                "modulus_MPa": None if inverse.modulus_MPa is None else list(inverse.modulus_MPa),
            },
            "surface": {
                "quantity": "ln(sd_microstrain)",
                **_surface_table(sd.surface),
                "usable_nodes": sd.usable.tolist(),
                "twofold": [_nulls(row) for row in sd.twofold],
                "uncertainty": _uncertainty_table(sd.uncertainty),
            },
            "gauges": [
                {
                    "name": gauge.name,
                    "quantity": "reading_microstrain / force_N",
                    **_surface_table(gauge.surface),
                    "uncertainty": _uncertainty_table(gauge.uncertainty),
                }
                for gauge in calibration.gauges
            ],
            **_position_table(calibration.position),
        },
        "domain": {key: list(limits) for key, limits in calibration.domain.items()},
        "provenance": calibration.provenance,
        "notes": list(calibration.notes),
    }


def from_document(document: dict) -> CalibrationData:
    """The calibration of plain values; raises `InputError` naming the key."""
    root = JsonTable(document, "")
    softness = root.table("softness")
    calibration = CalibrationData(
        finger=root.table("finger").values,
        mesh=root.table("mesh").values,
        forward=_forward(softness.table("forward")),
        inverse=_inverse(softness.table("inverse")),
        surface=_sd_surface(softness.table("surface")),
        gauges=tuple(_gauge(table) for table in softness.tables("gauges")),
        provenance=root.table("provenance").values,
        notes=root.texts("notes"),
        position=_position(softness.table("position")) if "position" in softness.values else None,
    )
    if calibration.position is not None and len(calibration.position.coefficients) != len(calibration.gauges):
        raise InputError(f"softness.position must hold {len(calibration.gauges)} gauges")
    domain = root.table("domain")
    if any(domain.interval(key) != limits for key, limits in calibration.domain.items()):
        raise InputError("domain differs from that of softness.surface")
    return calibration


def _forward(table: JsonTable) -> Quadratic:
    table.require("form", "quadratic")
    table.require("terms", list(FORWARD_TERMS))
    table.require("units", UNITS)
    return Quadratic(
        coefficients=table.array("coefficients", (5,)),
        stderr=table.array("stderr", (5,), nulls=True),
        covariance=table.array("covariance", (5, 5), nulls=True),
        rms=table.number("rms"),
        max=table.number("max"),
        modulus_MPa=table.interval("modulus_MPa"),
        condition=table.number("condition"),
        notes=table.texts("notes"),
    )


def _inverse(table: JsonTable) -> QuadraticInverse:
    table.require("terms", list(INVERSE_TERMS))
    branch = table.number("branch")
    if branch not in (-1, 1):
        raise InputError(f"{table.name('branch')} must be 1 or -1, got {branch:g}")
    return QuadraticInverse(
        coefficients=table.array("coefficients", (4,)),
        shift=table.number("shift"),
        branch=int(branch),
        modulus_MPa=None if table.get("modulus_MPa") is None else table.interval("modulus_MPa"),
    )


def _sd_surface(table: JsonTable) -> SdSurface:
    surface = _surface(table)
    m, n = surface.cells
    usable = table.array("usable_nodes", (m, 2))
    if ((usable < 0) | (usable > n) | (usable != usable.round())).any():
        raise InputError(f"{table.name('usable_nodes')} must hold whole numbers from 0 to {n}")
    twofold = table.array("twofold", (m, 2), nulls=True)
    return SdSurface(surface, usable.astype(int), twofold, _uncertainty(table.table("uncertainty")))


def _gauge(table: JsonTable) -> GaugeSurface:
    return GaugeSurface(table.text("name"), _surface(table), _uncertainty(table.table("uncertainty")))


def _surface(table: JsonTable) -> Surface:
    table.require("form", SPLINE)
    cells = table.array("cells", (2,))
    coefficients = table.array("coefficients", (int(cells[0]) + 3, int(cells[1]) + 3))
    return Surface(table.interval("force_N"), table.interval("modulus_MPa"), coefficients)


def _position(table: JsonTable) -> PositionTerms:
    table.require("quantity", POSITION_QUANTITY)
    table.require("form", POSITION_SPLINE)
    gauges, (m, n, k) = int(table.number("gauges")), table.array("cells", (3,)).astype(int)
    return PositionTerms(
        table.interval("force_N"),
        table.interval("modulus_MPa"),
        table.number("reach_mm"),
        table.array("coefficients", (gauges, int(m) + 3, int(n) + 3, int(k) + 3)),
        table.array("error", (gauges, int(k) + 1)),
    )


def _uncertainty(table: JsonTable) -> Uncertainty:
    forces = table.array("scatter_force_N", None)
    if (forces <= 0).any() or (np.diff(forces) <= 0).any():
        raise InputError(f"{table.name('scatter_force_N')} must rise and be above 0")
    return Uncertainty(
        fit_rms=table.number("fit_rms"),
        fit_factor=table.number("fit_factor"),
        fit_max=table.number("fit_max"),
        scatter_force_N=forces,
        scatter=table.array("scatter", forces.shape),
        scatter_factor=table.number("scatter_factor"),
        meshes=int(table.number("meshes")),
    )


def _surface_table(surface: Surface) -> dict:
    return {
        "form": SPLINE,
        "force_N": list(surface.force_N),
        "modulus_MPa": list(surface.modulus_MPa),
        "cells": list(surface.cells),
        "coefficients": surface.coefficients.tolist(),
    }


def _position_table(known: PositionTerms | None) -> dict:
    """The optional part of the file: readers that do not know it pass it over, so the schema is the same."""
    if known is None:
        return {}
    return {
        "position": {
            "quantity": POSITION_QUANTITY,
            "form": POSITION_SPLINE,
            "gauges": len(known.coefficients),
            "force_N": list(known.force_N),
            "modulus_MPa": list(known.modulus_MPa),
            "reach_mm": known.reach_mm,
            "cells": list(known.cells),
            "coefficients": known.coefficients.tolist(),
            "error": known.error.tolist(),
        }
    }


def _uncertainty_table(known: Uncertainty) -> dict:
    return {
        "level": LEVEL,
        "fit_rms": known.fit_rms,
        "fit_factor": known.fit_factor,
        "fit_max": known.fit_max,
        "scatter_force_N": known.scatter_force_N.tolist(),
        "scatter": known.scatter.tolist(),
        "scatter_factor": known.scatter_factor,
        "meshes": known.meshes,
    }


def _nulls(row) -> list:
    """Numbers with null for NaN, which JSON has not."""
    return [None if math.isnan(value) else value for value in row.tolist()]
