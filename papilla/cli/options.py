"""What options of several commands mean: specimens, friction, and files that are read and must stay what they are."""

import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from papilla.checks import positive
from papilla.errors import InputError

if TYPE_CHECKING:
    from papilla.fem import Press
    from papilla.finger import Finger
    from papilla.specimen import Friction, Specimen

PROCESSES = min(2, os.cpu_count() or 1)
"""Processes that long jobs are shared between: each takes up to 1 GB."""

SpecimenKind = Literal["half-space", "block", "sphere"]

FingerOption = Annotated[
    Path | None,
    typer.Option(help="Design file (TOML), or the name of a finger that ships: published.  [default: default]"),
]

SizeOption = Annotated[
    float | None,
    typer.Option(help="Element size at the contact, mm: 0.7 unless told, as of the meshes that ship."),
]

FrictionOption = Annotated[
    str | None,
    typer.Option(
        help="Coulomb friction between finger and specimen, or stick.  [default: not known, stick the likeliest]",
        metavar="0|MU|stick",
    ),
]


def read_friction(text: str | None) -> "Friction | None":
    """The friction of an option's text, None where it is not given; raises `InputError`."""
    from papilla.specimen import friction_coefficient

    if text is None:
        return None
    try:
        friction: Friction = float(text)
    except ValueError:
        friction = text
    friction_coefficient(friction)
    return friction


def mesh_size(size_mm: float | None) -> float:
    """The element size of an option, that of the figures of the README where it is not given; raises `InputError`."""
    from papilla.mesh import DEFAULT_SIZE_MM

    return DEFAULT_SIZE_MM if size_mm is None else positive("--size-mm", size_mm)


def make_specimen(
    kind: SpecimenKind, modulus: float, thickness: float | None, radius: float | None, design: "Finger"
) -> "Specimen":
    """The specimen of the options, a block as thick as those of the design's bench unless told; refuses an option that
    its shape would ignore."""
    from papilla.specimen import Block, HalfSpace, Sphere

    if thickness is not None and kind != "block":
        raise InputError(f"--thickness is for a block, not for a {kind}")
    if radius is not None and kind != "sphere":
        raise InputError(f"--radius is for a sphere, not for a {kind}")
    if kind == "half-space":
        return HalfSpace(modulus)
    if kind == "block":
        return design.bench.specimen(modulus) if thickness is None else Block(modulus, thickness)
    if radius is None:
        raise InputError("a sphere needs --radius (mm)")
    return Sphere(modulus, radius)


def describe(specimen: "Specimen") -> dict:
    """Kind and measures of a specimen under the names of files, as plain values."""
    from dataclasses import asdict

    units = {"modulus": "modulus_MPa", "thickness": "thickness_mm", "radius": "radius_mm"}
    kind = {"HalfSpace": "half-space"}.get(type(specimen).__name__, type(specimen).__name__.lower())
    return {"kind": kind, **{units.get(key, key): value for key, value in asdict(specimen).items() if key != "bonded"}}


def scene_of(touched: "Specimen", found: "Press") -> dict:
    """What a press was made under, as plain values and in words."""
    from papilla.specimen import friction_words, physics_words

    return {
        "specimen": describe(touched),
        "friction": friction_words(found.friction),
        "physics": physics_words(touched, found.friction, found.large_strain),
    }


def keep_inputs(inputs: Iterable[Path | str | None], outputs: Iterable[Path]) -> None:
    """Refuse an output that is an input under whatever name: through links, other spellings, a second hard link."""
    given = [Path(name) for name in inputs if name is not None]
    for output in outputs:
        for name in given:
            if _same(name, output):
                raise InputError(f"{output} would overwrite the input {name}: choose another name")


def surface_files(design: "Finger") -> list[str]:
    """The files of a design's surfaces."""
    from papilla.finger import Surfaces

    return [*vars(design.shape).values()] if isinstance(design.shape, Surfaces) else []


@contextmanager
def about(path: Path) -> Iterator[None]:
    """Bad input that is found while the content of a file is used names the file, as that found while reading does."""
    try:
        yield
    except InputError as error:
        raise InputError(str(error) if str(path) in str(error) else f"{path}: {error}") from error


def _same(one: Path, other: Path) -> bool:
    if os.path.realpath(one) == os.path.realpath(other):
        return True
    try:
        return os.path.samefile(one, other)
    except OSError:
        return False
