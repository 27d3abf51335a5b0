"""The finger's TOML design file: its keys, types and defaults are those of the classes in `papilla.finger`."""

import tomllib
from dataclasses import astuple, replace
from pathlib import Path
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, TypeAdapter, ValidationError

from papilla.errors import FileAccessError, FileFormatError, InputError
from papilla.file_models import first_problem, keys_of, table
from papilla.files import reason
from papilla.finger import Bench, Dome, Finger, Gauge, Layer, Ridges, Slab, Surfaces
from papilla.materials import Material, NeoHookean, Ogden, Yeoh


def _named_in_lower_case(card: Any) -> Any:
    """A material's table with the people's names in small letters: "neo-Hookean" is "neo-hookean"."""
    if isinstance(card, dict) and isinstance(card.get("model"), str):
        return {**card, "model": card["model"].lower()}
    return card


def _layer(modulus: float | None, nu: float, material: Material | None) -> Layer:
    if modulus is not None:
        return Layer(modulus, nu, material)
    if material is None:
        raise InputError("key modulus_MPa is missing")
    return Layer.of(material, nu)


_CARDS: Any = (
    table(NeoHookean, keys_of(NeoHookean, unit="_MPa"), {"model": "neo-hookean"}, known=True)
    | table(Yeoh, keys_of(Yeoh, unit="_MPa"), {"model": "yeoh"}, known=True)
    | table(Ogden, keys_of(Ogden, unit={"mu": "_MPa"}), {"model": "ogden"}, known=True)
)
_MATERIAL: Any = Annotated[Annotated[_CARDS, Field(discriminator="model")], BeforeValidator(_named_in_lower_case)]
_LAYER = table(
    _layer, keys_of(Layer, unit={"modulus": "_MPa"}, modulus=float | None, material=_MATERIAL | None), known=True
)
_SHAPES: Any = (
    table(Dome, keys_of(Dome, unit="_mm"), {"kind": "dome"}, known=True)
    | table(Slab, keys_of(Slab, unit="_mm"), {"kind": "slab"}, known=True)
    | table(Surfaces, keys_of(Surfaces, unit="_file"), {"kind": "surfaces"}, known=True)
)
_GAUGE = table(Gauge, keys_of(Gauge), known=True)
_BENCH = table(
    Bench, keys_of(Bench, unit={"thickness": "_mm", "touch_down": "_mm"}, friction=float | str | None), known=True
)
_FINGER = keys_of(
    Finger,
    unit={"patch_radius": "_mm"},
    shape=Annotated[_SHAPES, Field(discriminator="kind")],
    outer=_LAYER,
    inner=_LAYER,
    bone=_LAYER | None,
    ridges=table(Ridges, keys_of(Ridges, unit="_mm"), known=True) | None,
    gauges=tuple[_GAUGE, ...],  # type: ignore[valid-type]
    bench=_BENCH,
)
_DESIGN: TypeAdapter[Finger] = TypeAdapter(table(Finger, _FINGER, known=True))
_TAGS = ("dome", "slab", "surfaces", "neo-hookean", "yeoh", "ogden")


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
        finger = _DESIGN.validate_python(tomllib.loads(text))
        if isinstance(finger.shape, Surfaces):
            beside = Surfaces(*(str(path.parent / name) for name in astuple(finger.shape)))
            finger = replace(finger, shape=beside)
    except tomllib.TOMLDecodeError as error:
        raise FileFormatError(f"{path} is not valid TOML: {error}") from error
    except RecursionError as error:
        raise FileFormatError(f"{path} is not valid TOML: its brackets are nested too deeply") from error
    except ValidationError as error:
        raise FileFormatError(f"{path}: {first_problem(error, _TAGS)}") from error
    return finger
