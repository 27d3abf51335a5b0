"""`papilla new`: a commented design as a starting point."""

from pathlib import Path
from typing import Literal

from papilla.cli.options import argument, option
from papilla.cli.output import Answer, tell
from papilla.errors import InputError

Shape = Literal["dome", "slab", "surfaces"]

SURFACES_MM = {"skin.stl": (24.0, 30.0, 20.0), "interface.stl": (21.0, 27.0, 17.0), "bone.stl": (10.0, 16.0, 6.0)}
"""Surface files of the commented design, with the semi-axes of the default finger's surfaces."""


def new(
    file: Path = argument(..., "Design file to write (TOML).", metavar="FILE"),
    shape: Shape = option("dome", "Half ellipsoid, extruded section, or three surface files, which are written too."),
) -> Answer:
    """Write a commented design file to start from; nothing is overwritten."""
    from papilla.files import replacing_set
    from papilla.finger import DEFAULT_FINGER, Finger

    surfaces = {file.with_name(name): axes for name, axes in SURFACES_MM.items()} if shape == "surfaces" else {}
    written = [file, *surfaces]
    for path in written:
        if path.exists() or path.is_symlink():
            raise InputError(f"{path} is already there and is not overwritten: choose another name or folder")
    commented = DEFAULT_FINGER.with_name(f"{shape}_finger.toml").read_text(encoding="utf-8")
    with replacing_set(written) as (design, *parts):
        design.write_text(commented.replace("FILE.toml", file.name), encoding="utf-8")
        for part, axes in zip(parts, surfaces.values(), strict=True):
            from papilla.mesh.example_surfaces import write_half_ellipsoid

            write_half_ellipsoid(part, axes)
    facts = {"finger": str(file), "shape": shape, "name": Finger.load(file).name, "files": list(map(str, written))}

    def show() -> None:
        tell(f"Wrote {', '.join(map(str, written))}")
        tell(f"Try it: papilla press --finger {file} --modulus 0.51 --force 0.588")

    return Answer(facts, show)
