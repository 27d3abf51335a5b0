"""`papilla new`: a commented design as a starting point."""

from pathlib import Path
from typing import Literal

from papilla.cli.options import argument, option
from papilla.cli.output import CommandResult, tell
from papilla.core.errors import InputError

Shape = Literal["dome", "slab", "surfaces"]

SURFACE_FILES = {"outer": "skin.stl", "interface": "interface.stl", "bone": "bone.stl"}
"""Surfaces of the commented design: those of the default finger, and their files."""


def new(
    file: Path = argument(..., "Design file to write (TOML).", metavar="FILE"),
    shape: Shape = option("dome", "Half ellipsoid, extruded section, or three surface files, which are written too."),
) -> CommandResult:
    """Write a commented design file to start from; nothing is overwritten."""
    from papilla.core.files import replacing_set
    from papilla.core.outside import read_text
    from papilla.model.finger import DEFAULT_FINGER, Finger

    directions = (
        {}
        if shape != "surfaces"
        else {getattr(Finger.default().shape, key): name for key, name in SURFACE_FILES.items()}
    )
    written = [file, *map(file.with_name, directions.values())]
    for path in written:
        if path.exists() or path.is_symlink():
            raise InputError(f"{path} is already there and is not overwritten: choose another name or folder")
    commented = read_text(DEFAULT_FINGER.with_name(f"{shape}_finger.toml"))
    with replacing_set(written) as (design, *parts):
        design.write_text(commented.replace("FILE.toml", file.name), encoding="utf-8")
        for surface, axes in zip(parts, directions, strict=True):
            from papilla.mesh.surface_files import write_half_ellipsoid

            write_half_ellipsoid(surface, axes)
    facts = {"finger": str(file), "shape": shape, "name": Finger.load(file).name, "files": list(map(str, written))}

    def show() -> None:
        tell(f"Wrote {', '.join(map(str, written))}")
        tell(f"Try it: papilla press --finger {file} --modulus 0.51 --force 0.588")

    return CommandResult(facts, show)
