"""`papilla view`: pictures of a press and of what the gauges feel."""

from pathlib import Path
from typing import Literal

from papilla.cli.options import (
    FingerOption,
    JsonOption,
    PlaceOption,
    SizeOption,
    SpecimenOptions,
    argument,
    keep_inputs,
    mesh_size,
    option,
    scene_of,
    surface_files,
)
from papilla.cli.output import Stopwatch, print_json, progress, tell
from papilla.errors import InputError

What = Literal["strain", "contact", "receptive"]

SHOWN_MODULUS_MPA, SHOWN_FORCE_N = 0.51, 0.588
"""The scene that is shown where none is asked for: 60 gf on the middle one of the published specimens."""


def view(
    specimen: SpecimenOptions,
    what: What = argument("strain", "Strain field or contact pressure of a press, or receptive field of a gauge."),
    screenshot: Path | None = option(None, "File to write: .png, .pdf or .svg.  [default: WHAT.png]", metavar="FILE"),
    modulus: float | None = option(None, "Modulus of the specimen, MPa.  [default: 0.51]"),
    force: float | None = option(None, "Pressing force, N.  [default: 0.588]"),
    at: PlaceOption = (0.0, 0.0),
    gauge: str | None = option(None, "Gauge of a receptive field.  [default: the middle one]"),
    finger: FingerOption = None,
    size_mm: SizeOption = None,
    as_json: JsonOption = False,
) -> None:
    """Draw the strain field of a press, its contact pressure, or the receptive field of a gauge."""
    watch = Stopwatch()
    if what == "receptive" and (modulus, force, specimen.thickness, specimen.radius) != (None, None, None, None):
        raise InputError("a receptive field has no press: leave out --modulus, --force, --thickness and --radius")
    if what != "receptive" and gauge is not None:
        raise InputError(f"--gauge goes with a receptive field, not with {what}")
    target = Path(f"{what}.png") if screenshot is None else screenshot

    from papilla import fem
    from papilla import view as pictures
    from papilla.files import check_writable
    from papilla.finger import Finger
    from papilla.view.style import kind_of

    kind_of(target)
    keep_inputs([finger], [target])
    design, size = Finger.load(finger or "default"), mesh_size(size_mm)
    touched = specimen.of(SHOWN_MODULUS_MPA if modulus is None else modulus, design)
    keep_inputs(surface_files(design), [target])
    check_writable(target.parent)
    facts = {"finger": design.name, "picture": what}
    with progress() as shown:
        if what == "receptive":
            name = design.gauges[len(design.gauges) // 2].name if gauge is None else gauge
            pictures.receptive(target, design, name, size_mm=size, progress=shown.line)
            facts["gauge"] = name
        else:
            reduced = fem.prepare(design, size_mm=size, at=at, progress=shown.line)
            found = pictures.shown(reduced, touched, force=SHOWN_FORCE_N if force is None else force)
            facts |= found.to_json() | scene_of(touched, found)
            if what == "strain":
                pictures.strain(target, design, reduced, found, touched, progress=shown.line)
            else:
                pictures.contact(target, reduced, found)
    if as_json:
        print_json({**facts, "screenshot": str(target), "seconds": watch.seconds})
    else:
        if "physics" in facts:
            tell(f"Pressed on: {facts['physics']}")
        tell(f"Wrote {target}")
