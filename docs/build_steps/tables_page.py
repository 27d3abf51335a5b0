"""The page of file formats: keys of TOML and JSON files from their models, columns of logs from the readers."""

import types
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from inspect import getdoc
from pathlib import Path
from typing import Any, Literal, Union, get_args, get_origin

from pages import code, markdown, table
from pages import write as write_page
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from papilla.calibration import SoftnessStatus, document
from papilla.calibration.fitting.sweep import Sweep
from papilla.estimators.friction import FrictionStatus
from papilla.estimators.health import Fault
from papilla.estimators.pipeline import PipelineEstimate
from papilla.estimators.pipeline.clock import ClockStatus
from papilla.estimators.wavelength import TrackingStatus
from papilla.estimators.wavelength.chirp import ChirpStatus
from papilla.logs import log_map
from papilla.logs.log_map import CHANNEL_QUANTITY, LOG_QUANTITIES
from papilla.logs.presses import PRESS_OPTIONAL, SPECIMEN_COLUMNS
from papilla.logs.time_log import TIME_OPTIONAL
from papilla.model import file as finger_file
from papilla.model.finger import Bench, Dome, Finger, Gauge, Layer, Ridges, Slab, Surfaces
from papilla.model.materials import MATERIALS_BY_KIND
from papilla.model.parts import Identified

OPENING = """# Files

Every file has a fixed form. An unknown key, a missing column or a value out of range is refused with one line that
names the file and the key. Lengths are in mm, forces in N, moduli in MPa, times in s, readings in microstrain; the unit
is part of the name.

Meshes, reduced fingers and tables are kept between commands in the folder that `PAPILLA_CACHE` names, by default
papilla's folder in the user's cache. It may be deleted at any time; what is missing is computed again. Its entries are
sealed with a secret in papilla's folder of the user's data, so an entry that somebody else made or changed is not used.

## Design of a finger (TOML)

Read by `--finger` of every command and by `papilla.Finger.load`. Examples with comments are in `papilla/data`.
"""
LOGS = """## Logs (CSV)

A log over time has `t_s` and gauges `g1`, `g2`, ... in microstrain; a log of presses has `force_N`, `modulus_MPa` and
gauges, one press a row. Semicolons, tabs and decimal commas are understood. Optional columns:
"""
OF_LOGS = (
    ("over time", ", ".join([*TIME_OPTIONAL, "torque_Nmm in place of tangential_N"])),
    ("of presses", ", ".join([*PRESS_OPTIONAL, *SPECIMEN_COLUMNS])),
)
UNITS = """### Columns, their units, and the names that laboratories use

A header may carry the unit (`t_ms`, `Fz [gf]`). `papilla log map` proposes a map for other columns.
"""
MATERIAL = """### Material of a layer

A hyperelastic law for large strain, `material = { model = "ogden", ... }`, instead of `modulus_MPa` or beside it.
"""
CALIBRATION = f"""## Calibration (JSON)

`schema` is `{document.CALIBRATION_SCHEMA}`. The file carries a checksum and is read by `papilla.Calibration.load`; a
file that was edited by hand is read with a remark. """
PARTS = (
    ("`finger`, `mesh`", "name and hash of the design; what the mesh was"),
    ("`domain`", "`force_N` and `modulus_MPa`, each from and to"),
    ("`provenance`", "versions, when, under what physics, and what the intervals lack"),
    ("`notes`", "doubts of the fit, a sentence each"),
    ("`softness.forward`", "S_d = a f² + b f + c E² + d E + e; f in gf, E in MPa"),
    ("`softness.inverse`", document.INVERSE_FORM["form"]),
    ("`softness.compact`", document.COMPACT_FORM["form"]),
    ("`softness.surface`", f"{document.SD_FORM['quantity']}: {document.SD_FORM['form']}"),
    ("`softness.gauges`", f"{document.GAUGE_FORM['quantity']}: {document.GAUGE_FORM['form']}"),
    ("`softness.position`", f"{document.POSITION_FORM['quantity']}: {document.POSITION_FORM['form']}"),
)
FIXED = ("form", "terms", "units", "quantity", "level")
"""Keys of a calibration that have one value, which says what the part holds."""
OF_STATUSES = """## Statuses

Every answer has a status, and may be used where its status begins with `ok`. Tables have the code; the sentence stands
in the summary (`NAME.summary.json`), in `Pipeline.legend`, and with single answers.
"""
STATUSES = {
    "modulus_status": SoftnessStatus,
    "wavelength_status": TrackingStatus,
    "wavelength_status without a velocity": ChirpStatus,
    "friction_status": FrictionStatus,
    "status, of the time": ClockStatus,
    "status, of the gauges": Fault,
}
PLURAL = {"number": "numbers", "text": "texts", "whole number": "whole numbers", "true or false": "true or false"}


def write(folder: Path) -> None:
    """Write files.md."""
    write_page(folder / "files.md", "\n".join([OPENING, *_design(), *_logs(), *_calibration(), *_statuses()]))


def _design() -> list[str]:
    parts = finger_file._TABLES
    inside = dict.fromkeys(parts, "table") | {"gauges": "list of tables"}
    said = [_keys(_fields(finger_file.keys_of(Finger, unit={"patch_radius": "_mm"}, **parts)), inside), "### [shape]\n"]
    said.append(
        table(("kind", "example"), [(code(kind), code(form)) for kind, form in finger_file.SHAPE_FORMS.items()])
    )
    for kind in (Dome, Slab, Surfaces):
        keys = finger_file.keys_of(kind, unit="_file" if kind is Surfaces else "_mm")
        said += [f"{markdown(getdoc(kind))}\n", _keys(_fields(keys))]
    for title, part, model in (
        ("[outer], [inner], [bone]", Layer, finger_file._LAYER),
        ("[ridges]", Ridges, parts["ridges"]),
        ("[[gauges]]", Gauge, finger_file._GAUGE),
        ("[bench]", Bench, finger_file._BENCH),
        ("[identified]", Identified, finger_file._IDENTIFIED),
    ):
        said += [f"### {title}\n\n{markdown(getdoc(part))}\n", _keys(_model(model))]
    cards = {
        kind: [item.name + ("_MPa" if item.name in card.in_MPa else "") for item in fields(card)]
        for kind, card in MATERIALS_BY_KIND.items()
    }
    rows = [(code(kind), ", ".join(map(code, keys))) for kind, keys in cards.items()]
    return [*said, MATERIAL, table(("model", "keys"), rows)]


def _logs() -> list[str]:
    rows = [(code(name), ", ".join(one.units), ", ".join(one.words)) for name, one in LOG_QUANTITIES.items()]
    rows.append(("`g1`, `g2`, ...", ", ".join([*CHANNEL_QUANTITY.units]), ", ".join(CHANNEL_QUANTITY.words)))
    return [
        LOGS,
        table(("log", "columns"), OF_LOGS),
        UNITS,
        table(("column", "units", "other names"), rows),
        f"### Map of foreign columns (TOML)\n\n{markdown(log_map.__doc__)}\n",
        _keys({name: key for name, key in _fields(log_map._MAP_KEYS).items() if name != "path"}),
        f"### A column of the map\n\n{markdown(getdoc(log_map.Column))}\n",
        _keys(_fields(log_map._COLUMN_KEYS)),
        f"### Answers of `papilla estimate` (CSV)\n\n{markdown(getdoc(PipelineEstimate))}\n",
        table(("columns",), [(", ".join(map(code, ("t_s", *PipelineEstimate._fields))),)]),
        f"### Presses of a sweep (sweep.csv)\n\n{markdown(getdoc(Sweep))}\n",
    ]


def _calibration() -> list[str]:
    said = [CALIBRATION, table(("key", "holds"), PARTS)]
    for name, part in document._PARTS.items():
        said += [f"### softness.{name}\n", _keys(_model(part[0] if isinstance(part, tuple) else part))]
    return said


def _statuses() -> list[str]:
    said = [OF_STATUSES]
    for column, kind in STATUSES.items():
        rows = [(code(one.code), one.sentence) for one in kind if one.sentence]
        said += [f"### {column}\n", table(("code", "sentence"), rows)]
    return said


def _model(kind: Any) -> Mapping[str, FieldInfo]:
    """The keys of a table: fields of the pydantic model inside its type."""
    while not hasattr(kind, "model_fields"):
        kind = get_args(kind)[0]
    return kind.model_fields


def _fields(keys: Mapping[str, Any]) -> dict[str, FieldInfo]:
    """Keys of `keys_of`, each (type, field), as fields that know their type."""
    found = {}
    for name, (kind, field) in keys.items():
        field.annotation = kind
        found[name] = field
    return found


def _keys(model: Mapping[str, FieldInfo], given: Mapping[str, str] = types.MappingProxyType({})) -> str:
    """A table of keys; given : what they take, where their type does not say it."""
    rows = []
    for name, field in model.items():
        unsaid = field.default in (None, PydanticUndefined) or is_dataclass(field.default)
        default = "required" if field.is_required() else "" if unsaid else code(repr(field.default))
        takes = given.get(name, "fixed" if name in FIXED else _kind(field.annotation))
        rows.append((code(field.alias or name), takes, default))
    return table(("key", "value", "default"), rows)


def _kind(hint: Any) -> str:
    """A type in words."""
    origin, inner = get_origin(hint), get_args(hint)
    if hint in (str, float, int, bool):
        return {str: "text", float: "number", int: "whole number", bool: "true or false"}[hint]
    if origin in (Union, types.UnionType):
        return " or ".join(dict.fromkeys(_kind(one) for one in inner if one is not type(None)))
    if origin is tuple:
        count = "" if Ellipsis in inner else f"{len(inner)} "
        return f"list of {count}{PLURAL.get(_kind(inner[0]), 'lists of numbers')}"
    if origin is Literal:
        return " or ".join(code(repr(one)) for one in inner)
    if origin in (dict, list):
        return "table" if origin is dict else "list of tables"
    if hasattr(hint, "model_fields"):
        return "table"
    return _kind(inner[0]) if inner else "list of numbers"
