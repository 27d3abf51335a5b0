"""The finger's TOML design file: its keys, types and defaults are those of `papilla.Finger` and its parts."""

import os
import re
import reprlib
from collections.abc import Hashable
from dataclasses import astuple, fields, replace
from functools import cache
from pathlib import Path
from typing import Annotated, Any, TypeVar, Union, cast

from pydantic import BeforeValidator, Field, TypeAdapter, ValidationError

from papilla.core.errors import FileFormatError, InputError
from papilla.core.file_models import first_of, in_words, keys_of, table
from papilla.core.files import toml_lines, write_text
from papilla.core.outside import read_toml
from papilla.model.materials import MATERIALS_BY_KIND, Material
from papilla.model.parts import Bench, Dome, Gauge, Identified, Layer, Ridges, Slab, Surfaces

Design = TypeVar("Design")


def _named_in_lower_case(card: Any) -> Any:
    """A material's table with the people's names in small letters: "neo-Hookean" is "neo-hookean"."""
    if isinstance(card, dict) and isinstance(card.get("model"), str):
        return {**card, "model": card["model"].lower()}
    return card


SHAPE_FORMS = {
    "dome": "outer_mm = [24, 30, 20], interface_mm = [21, 27, 17], bone_mm = [10, 16, 6]",
    "slab": "outer_mm = [24, 20], interface_mm = [21, 17], bone_mm = [10, 6], depth_mm = 10",
    "surfaces": 'outer_file = "skin.stl", interface_file = "interface.stl", bone_file = "bone.stl"',
}
"""Kinds of shapes, and an example of what each takes."""


def _of_known_kind(shape: Any) -> Any:
    """A shape's table; raises `InputError` if it is not a table, or of an unknown kind."""
    if not isinstance(shape, dict):
        raise InputError(f"must be a table [shape], got {reprlib.repr(shape)}")
    if "kind" not in shape:
        raise InputError("key kind is missing")
    if shape["kind"] not in [*SHAPE_FORMS]:
        raise InputError(f"kind must be {', '.join(SHAPE_FORMS)}, in small letters; got {reprlib.repr(shape['kind'])}")
    return shape


def _right_form(design: dict[str, Any], place: tuple[int | str, ...], type_: str) -> str:
    """The end of a message about a shape in the wrong form: the right form of the kind that was probably meant."""
    first = str(place[0]) if place else ""
    if first != "shape" and first not in SHAPE_FORMS and not first.endswith("_file"):
        return ""
    if type_ == "value_error" and len(place) > 1:  # The form is right; a length is wrong
        return ""
    written = repr(design.get("shape", [*design])).lower()
    files = re.search(r"surf|file|stl|ply|vtp", written)
    shape = "surfaces" if files else next((form for form in SHAPE_FORMS if form in written), None)
    return f'; it is written [shape] kind = "{shape}", {SHAPE_FORMS[shape]}' if shape else ""


def _layer(modulus: float | None, nu: float, material: Material | None) -> Layer:
    if modulus is not None:
        return Layer(modulus, nu, material)
    if material is None:
        raise InputError("key modulus_MPa is missing")
    return Layer.of(material, nu)


_CARDS: Any = Union[  # noqa: UP007
    tuple(
        table(card, keys_of(card, unit=dict.fromkeys(card.in_MPa, "_MPa")), {"model": kind}, strict_keys=True)
        for kind, card in MATERIALS_BY_KIND.items()
    )
]
_MATERIAL: Any = Annotated[Annotated[_CARDS, Field(discriminator="model")], BeforeValidator(_named_in_lower_case)]
_LAYER = table(
    _layer, keys_of(Layer, unit={"modulus": "_MPa"}, modulus=float | None, material=_MATERIAL | None), strict_keys=True
)
_SHAPES: Any = (
    table(Dome, keys_of(Dome, unit="_mm"), {"kind": "dome"}, strict_keys=True)
    | table(Slab, keys_of(Slab, unit="_mm"), {"kind": "slab"}, strict_keys=True)
    | table(Surfaces, keys_of(Surfaces, unit="_file"), {"kind": "surfaces"}, strict_keys=True)
)
_SHAPE: Any = Annotated[Annotated[_SHAPES, Field(discriminator="kind")], BeforeValidator(_of_known_kind)]
MOST_DESIGN_GAUGES = 1000
"""Most gauges in a design file: each is a row of the reduced finger."""
_GAUGE = table(Gauge, keys_of(Gauge), strict_keys=True)
_OR_INFINITE: Any = Annotated[float, Field(allow_inf_nan=True)]
_OF_BENCH: Any = {"friction": float | str | None, "thickness": _OR_INFINITE}
_BENCH = table(Bench, keys_of(Bench, unit={"thickness": "_mm", "touch_down": "_mm"}, **_OF_BENCH), strict_keys=True)
_ROW: Any = Annotated[tuple[float, ...], Field(strict=False)]
_IDENTIFIED: Any = table(Identified, keys_of(Identified, covariance=tuple[_ROW, ...]), strict_keys=True)
_TABLES: dict[str, Any] = {
    "shape": _SHAPE,
    "outer": _LAYER,
    "inner": _LAYER,
    "bone": _LAYER | None,
    "ridges": table(Ridges, keys_of(Ridges, unit="_mm"), strict_keys=True) | None,
    "gauges": Annotated[tuple[_GAUGE, ...], Field(strict=False, max_length=MOST_DESIGN_GAUGES)],  # type: ignore[valid-type]
    "bench": _BENCH,
    "identified": _IDENTIFIED | None,
}
_TAGS = (*SHAPE_FORMS, *MATERIALS_BY_KIND)


@cache
def _design_of(makes: Any) -> TypeAdapter:
    return TypeAdapter(table(makes, keys_of(makes, unit={"patch_radius": "_mm"}, **_TABLES), strict_keys=True))


def read_design(makes: type[Design], path: Path) -> Design:
    """The design of a file as the dataclass `makes` (`papilla.Finger`); paths of surfaces start in its folder.

    Raises `FileAccessError` (missing, unreadable) or `FileFormatError` (not TOML, unknown key, wrong type or value).
    """
    design = read_toml(path, "finger file")
    try:
        finger: Any = _design_of(cast(Hashable, makes)).validate_python(design)
        if isinstance(finger.shape, Surfaces):
            surfaces = Surfaces(*(str(path.parent / name) for name in astuple(finger.shape)))
            finger = replace(finger, shape=surfaces)
    except ValidationError as error:
        problem = first_of(error)
        form = _right_form(design, problem["loc"], problem["type"])
        words = in_words(problem, _TAGS)
        # The form alone explains the error
        raise FileFormatError(f"{path}: {words.split('; did you')[0] if form else words}{form}") from error
    return finger


def write_design(finger: Any, path: Path) -> None:
    """Write a finger as a design file that `read_design` makes the same finger of; raises `FileAccessError`."""
    shape: dict[str, Any] = {"kind": type(finger.shape).__name__.lower()}
    if isinstance(finger.shape, Surfaces):
        folder = path.resolve().parent
        shape |= {
            f"{key}_file": os.path.relpath(Path(name).resolve(), folder) for key, name in vars(finger.shape).items()
        }
    else:
        shape |= {f"{key}_mm": value for key, value in vars(finger.shape).items()}
    tables: dict[str, dict[str, Any] | None] = {"shape": shape}
    tables |= {name: _layer_table(getattr(finger, name)) for name in ("outer", "inner", "bone")}
    if finger.ridges is not None:
        tables["ridges"] = {f"{key}_mm": value for key, value in vars(finger.ridges).items()}
    if finger.bench != Bench():
        of_bench = {"thickness_mm": finger.bench.thickness, "touch_down_mm": finger.bench.touch_down}
        tables["bench"] = of_bench | ({} if finger.bench.friction is None else {"friction": finger.bench.friction})
    patch = {} if finger.patch_radius is None else {"patch_radius_mm": finger.patch_radius}
    lines = toml_lines({"name": finger.name, **patch})
    for name, content in tables.items():
        if content is not None:
            lines += ["", f"[{name}]", *toml_lines(content)]
    for gauge in finger.gauges:
        values = {item.name: getattr(gauge, item.name) for item in fields(gauge)}
        changed = {item.name for item in fields(gauge) if values[item.name] != item.default}
        lines += ["", "[[gauges]]", *toml_lines({key: value for key, value in values.items() if key in changed})]
    if finger.identified is not None:
        lines += [
            "",
            "[identified]",
            *toml_lines({entry.name: getattr(finger.identified, entry.name) for entry in fields(Identified)}),
        ]
    write_text(path, "\n".join(lines) + "\n")


def _layer_table(layer: Layer | None) -> dict[str, Any] | None:
    """A layer as a table of the file; None for no layer."""
    if layer is None:
        return None
    table: dict[str, Any] = {"modulus_MPa": layer.modulus, "nu": layer.nu}
    if layer.material is not None:
        if layer.material.kind not in MATERIALS_BY_KIND:
            name = type(layer.material).__qualname__
            raise InputError(f"a design file cannot hold the material {name}: it has {', '.join(MATERIALS_BY_KIND)}")
        card = layer.material.describe()
        names = {key: f"{key}_MPa" if key in layer.material.in_MPa else key for key in card if key != "kind"}
        table["material"] = {"model": card["kind"]} | {name: card[key] for key, name in names.items()}
    return table
