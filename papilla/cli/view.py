"""`papilla view`: pictures of a press and of receptive fields."""

from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from papilla.cli import options
from papilla.cli.options import argument, option
from papilla.cli.output import CommandResult, progress, tell
from papilla.cli.press import write_field
from papilla.core.checks import positive
from papilla.core.errors import FileFormatError, InputError
from papilla.core.progress import Progress

if TYPE_CHECKING:
    from papilla.fem import ReducedFinger
    from papilla.model.finger import Finger
    from papilla.model.specimen import Specimen

What = Literal["strain", "contact", "receptive"]
Component = Literal["xx", "yy", "zz", "xy", "yz", "xz", "mises"]

VIEWED_MODULUS_MPA, VIEWED_FORCE_N = 0.51, 0.588
"""The default scene: 60 gf on the middle one of the published specimens."""

SLIDER_SHARES = (0.2, 0.4, 0.6, 0.8)
"""Lighter forces that the slider of a page shows besides the force, as factors of it."""


def view(
    specimen: options.SpecimenOptions,
    what: What = argument("strain", "Strain field or contact pressure of a press, or receptive fields of the gauges."),
    screenshot: Path | None = option(
        None, "Picture to write: .png, .pdf or .svg.  [default: WHAT.png, unless a page or field is]", metavar="FILE"
    ),
    html: Path | None = option(
        None, "Page to write: the strain field to be turned, at five forces (extra view).", metavar="FILE.html"
    ),
    export: Path | None = option(
        None, "Field to write: displacement, strain and stress for ParaView.", metavar="FILE.vtu"
    ),
    modulus: float | None = option(None, "Modulus of the specimen, MPa.  [default: 0.51]"),
    beside: float | None = option(None, "Modulus of a second specimen, drawn beside on the same scale, MPa."),
    force: float | None = option(None, "Pressing force, N.  [default: 0.588]"),
    at: options.PlaceOption = (0.0, 0.0),
    component: Component | None = option(None, "Show this component of the stress instead of the strain."),
    gauge: str | None = option(None, "Gauge of a receptive field.  [default: maps of all]"),
    finger: options.FingerOption = None,
    size_mm: options.SizeOption = None,
) -> CommandResult:
    """Draw the strain field of a press, its contact pressure, or the receptive fields of the gauges."""
    of_field = {"html": html, "export": export, "component": component}
    _refuse_idle(what, specimen, of_field, {"modulus": modulus, "beside": beside, "force": force}, gauge)
    if screenshot is None and html is None and export is None:
        screenshot = Path(f"{what}.png")
    targets = {"screenshot": screenshot, "html": html, "export": export}
    written = [path for path in targets.values() if path is not None]

    from papilla import fem
    from papilla import view as pictures
    from papilla.view.style import kind_of

    if screenshot is not None:
        kind_of(screenshot)
    if html is not None:
        from papilla.view.turning import need_plotly

        need_plotly()
    if export is not None and export.suffix.lower() != ".vtu":
        raise FileFormatError(f"{export}: fields are written as .vtu files")
    design = options.design_of(finger)
    options.ready([finger, *options.surface_files(design)], written)
    facts: dict[str, Any] = {"finger": design.name, "picture": what}
    with progress() as reporter:
        if what == "receptive":
            pictures.receptive(written[0], design, gauge, size_mm=options.mesh_size(size_mm), progress=reporter)
            facts["gauge"] = gauge or [value.name for value in design.gauges]
        else:
            moduli = [VIEWED_MODULUS_MPA if modulus is None else modulus, *([] if beside is None else [beside])]
            load = VIEWED_FORCE_N if force is None else positive("--force (N)", force)
            touched = [specimen.of(value, design) for value in moduli]
            reduced = fem.prepare(design, size_mm=options.mesh_size(size_mm), at=at, progress=reporter)
            facts |= _draw(what, component, targets, design, reduced, touched, load, reporter)
    facts |= {key: path and str(path) for key, path in targets.items()}

    def show() -> None:
        if "physics" in facts:
            tell(f"Pressed on: {facts['physics']}")
        tell(f"Wrote {', '.join(map(str, written))}")

    return CommandResult(facts, show)


def _refuse_idle(
    what: str, specimen: options.SpecimenOptions, of_field: dict, of_press: dict, gauge: str | None
) -> None:
    """Raise `InputError` for options that the kind of picture would ignore."""
    if what == "receptive":
        idle = {**of_press, "thickness": specimen.thickness, "radius": specimen.radius}
        if any(value is not None for value in idle.values()):
            raise InputError(f"a receptive field has no press: leave out {', '.join(f'--{name}' for name in idle)}")
    elif gauge is not None:
        raise InputError(f"--gauge goes with a receptive field, not with {what}")
    for name, value in of_field.items():
        if value is not None and what != "strain":
            raise InputError(f"--{name} goes with strain, not with {what}")


def _draw(
    what: str,
    component: str | None,
    targets: dict[str, Path | None],
    design: "Finger",
    reduced: "ReducedFinger",
    touched: "list[Specimen]",
    force: float,
    reporter: Progress,
) -> dict[str, Any]:
    """Press the touched specimens and write the files whose paths are not None; returns the press as plain values."""
    from papilla import view as pictures
    from papilla.view.style import STRAIN_QUANTITY

    first, *others = (
        (pictures.shown(reduced, touched_specimen, force=force), touched_specimen) for touched_specimen in touched
    )
    press, specimen = first
    second = others[0] if others else None
    style: Any = {"shown": component or STRAIN_QUANTITY, "progress": reporter}
    if (path := targets["screenshot"]) is not None:
        if what == "contact":
            pictures.contact(path, reduced, press, specimen, second)
        else:
            pictures.strain(path, design, reduced, press, specimen, beside=second, **style)
    if (path := targets["html"]) is not None:
        lighter = [pictures.shown(reduced, specimen, force=share * force) for share in SLIDER_SHARES]
        pictures.strain_page(path, design, reduced, [*lighter, press], specimen, **style)
    if (path := targets["export"]) is not None:
        write_field(path, design, reduced, press, reporter)
    facts = press.to_json() | options.scene_of(specimen, press)
    facts["shown"] = "pressure" if what == "contact" else style["shown"]
    return facts | ({} if second is None else {"beside": second[0].to_json() | options.scene_of(second[1], second[0])})
