"""`papilla view`: pictures of a press and of receptive fields."""

from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from papilla.checks import positive
from papilla.cli.options import (
    FingerOption,
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
from papilla.cli.output import Answer, Progress, progress, tell
from papilla.errors import FileFormatError, InputError

if TYPE_CHECKING:
    from papilla.finger import Finger

What = Literal["strain", "contact", "receptive"]
Component = Literal["xx", "yy", "zz", "xy", "yz", "xz", "mises"]

SHOWN_MODULUS_MPA, SHOWN_FORCE_N = 0.51, 0.588
"""The default scene: 60 gf on the middle one of the published specimens."""

SLIDER_SHARES = (0.2, 0.4, 0.6, 0.8, 1.0)
"""Factors of the force between which the slider of a page moves."""


def view(
    specimen: SpecimenOptions,
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
    at: PlaceOption = (0.0, 0.0),
    component: Component | None = option(None, "Show this component of the stress instead of the strain."),
    gauge: str | None = option(None, "Gauge of a receptive field.  [default: maps of all]"),
    finger: FingerOption = None,
    size_mm: SizeOption = None,
) -> Answer:
    """Draw the strain field of a press, its contact pressure, or the receptive fields of the gauges."""
    given = {"html": html, "export": export, "component": component}
    _refuse_idle(what, specimen, given, {"modulus": modulus, "beside": beside, "force": force}, gauge)
    if screenshot is None and html is None and export is None:
        screenshot = Path(f"{what}.png")
    targets = {"screenshot": screenshot, "html": html, "export": export}
    written = [path for path in targets.values() if path is not None]

    from papilla import view as pictures
    from papilla.files import check_writable
    from papilla.finger import Finger
    from papilla.view.style import kind_of

    if screenshot is not None:
        kind_of(screenshot)
    if html is not None:
        from papilla.view.turning import need_plotly

        need_plotly()
    if export is not None and export.suffix.lower() != ".vtu":
        raise FileFormatError(f"{export}: fields are written as .vtu files")
    design = Finger.load(finger or "default")
    keep_inputs([finger, *surface_files(design)], written)
    for path in written:
        check_writable(path.parent)
    facts: dict[str, Any] = {"finger": design.name, "picture": what}
    with progress() as shown:
        if what == "receptive":
            pictures.receptive(written[0], design, gauge, size_mm=mesh_size(size_mm), progress=shown.line)
            facts["gauge"] = gauge or [one.name for one in design.gauges]
        else:
            moduli = [SHOWN_MODULUS_MPA if modulus is None else modulus, *([] if beside is None else [beside])]
            load = SHOWN_FORCE_N if force is None else positive("--force (N)", force)
            scene = _Pictures(design, specimen, moduli, load, at, mesh_size(size_mm), shown)
            facts |= scene.write(what, targets, component)
    facts |= {key: path and str(path) for key, path in targets.items()}

    def show() -> None:
        if "physics" in facts:
            tell(f"Pressed on: {facts['physics']}")
        tell(f"Wrote {', '.join(map(str, written))}")

    return Answer(facts, show)


def _refuse_idle(what: str, specimen: SpecimenOptions, of_field: dict, of_press: dict, gauge: str | None) -> None:
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


class _Pictures:
    """The presses to show, and the files to write."""

    def __init__(
        self,
        design: "Finger",
        specimen: SpecimenOptions,
        moduli: list[float],
        force: float,
        at: tuple[float, float],
        size_mm: float,
        shown: Progress,
    ):
        from papilla import fem
        from papilla import view as pictures

        self.design, self.force, self.say = design, force, shown.line
        self.touched = [specimen.of(modulus, design) for modulus in moduli]
        self.reduced = fem.prepare(design, size_mm=size_mm, at=at, progress=self.say)
        self.found = [pictures.shown(self.reduced, one, force=force) for one in self.touched]

    def write(self, what: str, targets: dict[str, Path | None], component: str | None) -> dict[str, Any]:
        """Write the files whose paths are not None; returns the press as plain values."""
        from papilla import view as pictures
        from papilla.fem.fields import save_field
        from papilla.view.style import STRAIN

        first, touched = self.found[0], self.touched[0]
        other = (self.found[1], self.touched[1]) if len(self.found) > 1 else None
        kind: Any = {"shown": component or STRAIN, "progress": self.say}
        if (path := targets["screenshot"]) is not None:
            if what == "contact":
                pictures.contact(path, self.reduced, first, touched, other)
            else:
                pictures.strain(path, self.design, self.reduced, first, touched, beside=other, **kind)
        if (path := targets["html"]) is not None:
            lighter = [pictures.shown(self.reduced, touched, force=share * self.force) for share in SLIDER_SHARES[:-1]]
            pictures.strain_page(path, self.design, self.reduced, [*lighter, first], touched, **kind)
        if (path := targets["export"]) is not None:
            (field,) = pictures.fields(self.design, self.reduced, [first], progress=self.say)
            save_field(field, path)
        facts = (
            first.to_json() | scene_of(touched, first) | {"shown": "pressure" if what == "contact" else kind["shown"]}
        )
        return facts | ({} if other is None else {"beside": other[0].to_json() | scene_of(other[1], other[0])})
