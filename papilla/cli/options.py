"""Options that commands share, alone and in groups.

A group is a frozen dataclass whose fields are options and whose methods make the objects that they describe. A command
under `grouped` takes groups as parameters, so each option and its default are defined once.
"""

import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import MISSING, dataclass, fields, is_dataclass
from functools import wraps
from inspect import Parameter, Signature, signature
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_type_hints

import typer

from papilla.cli.output import CommandResult, print_json, say
from papilla.core.checks import positive
from papilla.core.errors import InputError

if TYPE_CHECKING:
    from papilla.fem import Press
    from papilla.logs import PressLog
    from papilla.model.finger import Finger
    from papilla.model.specimen import Friction, Specimen

DEFAULT_PROCESSES = min(2, os.cpu_count() or 1)
"""Number of processes for long jobs; each takes up to 1 GB."""


def option(default: Any, text: str, *names: str, **more: Any) -> Any:
    """An option of a command, used as the default of a parameter; `...` as default means that it is required."""
    return typer.Option(default, *names, help=as_written(text), **more)


def argument(default: Any, text: str, **more: Any) -> Any:
    """An argument of a command, as `option`."""
    return typer.Argument(default, help=as_written(text), **more)


def as_written(text: str) -> str:
    """A help text whose brackets are shown: rich would treat "[default: 10]" as markup and drop it."""
    return text.replace("[", r"\[")


SpecimenKind = Literal["half-space", "block", "sphere"]

FingerOption = Annotated[
    Path | None,
    typer.Option(
        help=as_written("Design file (TOML), or the name of a finger that ships, as published.  [default: default]")
    ),
]

SizeOption = Annotated[
    float | None,
    typer.Option(
        help=as_written(
            "Element size at the contact, mm.  [default: 0.7 for the default finger, in proportion for others]"
        )
    ),
]

PlaceOption = Annotated[tuple[float, float], typer.Option(help="Touch-down point, mm.", metavar="X Y")]

FrictionOption = Annotated[
    str | None,
    typer.Option(
        help=as_written("Coulomb friction of finger and specimen, or stick.  [default: unknown, stick most likely]"),
        metavar="0|MU|stick",
    ),
]


MapOption = Annotated[
    Path | None,
    typer.Option(
        "--map",
        metavar="FILE.toml",
        help=as_written("What the columns of a log are (papilla log map).  [default: log_map.toml beside the log]"),
    ),
]

JsonOption = Annotated[bool, typer.Option("--json", help="Print one JSON object.")]


def grouped(command: Callable[..., CommandResult | None]) -> Callable[..., None]:
    """The command as typer needs it: each field of a parameter that is a dataclass is a parameter of its own.

    A command that returns a `CommandResult` also has `--json`, which prints its facts and its seconds instead.
    """
    hints, parameters = get_type_hints(command, include_extras=True), []
    answers = hints.get("return") is CommandResult
    groups: dict[str, Any] = {}
    for name, parameter in signature(command).parameters.items():
        options_class = hints[name]
        if not is_dataclass(options_class):
            parameters.append(parameter.replace(annotation=options_class, kind=Parameter.KEYWORD_ONLY))
            continue
        options, groups[name] = get_type_hints(options_class, include_extras=True), options_class
        for field in fields(options_class):
            default = Parameter.empty if field.default is MISSING else field.default
            parameters.append(
                Parameter(field.name, Parameter.KEYWORD_ONLY, default=default, annotation=options[field.name])
            )

    if answers:
        parameters.append(Parameter("as_json", Parameter.KEYWORD_ONLY, default=False, annotation=JsonOption))

    @wraps(command)
    def called(**values: Any) -> None:
        """Fill the groups, run the command, print its answer or its JSON, and end with its exit code."""
        began, as_json = perf_counter(), answers and values.pop("as_json")
        filled = {
            name: options_class(**{field.name: values.pop(field.name) for field in fields(options_class)})
            for name, options_class in groups.items()
        }
        result = command(**values, **filled)
        if result is not None:
            print_json({"seconds": perf_counter() - began} | {**result.facts}) if as_json else result.show()
            if result.code:
                raise typer.Exit(result.code)

    called.__signature__ = Signature(parameters)  # type: ignore[attr-defined]
    called.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    return called


def _read_scene(context: typer.Context, path: Path | None) -> Path | None:
    """Use the values of a scene file as the defaults of the options."""
    if path is None:
        return None
    from papilla.core.outside import read_toml
    from papilla.core.tables import closest

    scene = read_toml(path, "scene file")
    names = {option.opts[0].lstrip("-").replace("-", "_"): option.name for option in context.command.params}
    if unknown := [key for key in scene if key not in names or names[key] == "scene"]:
        near = closest(unknown[0], [key for key in names if names[key] != "scene"])
        hint = f"; did you mean {near}?" if near else ""
        raise InputError(f"{path}: `papilla {context.command.name}` has no option {unknown[0]!r}{hint}")
    # As text, so that a value is parsed and refused as on the command line
    context.default_map = {
        names[key]: [str(item) for item in value] if isinstance(value, list) else str(value)
        for key, value in scene.items()
    }
    return path


SceneOption = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE.toml",
        help="Values of the options below: keys are their long names with _ for -. An option that is given overrides "
        "its key.",
        callback=_read_scene,
        is_eager=True,
    ),
]


def given(context: typer.Context, names: Iterable[str]) -> list[str]:
    """Those of these options that the command line or the scene file states, as written there."""
    stated = ("COMMANDLINE", "DEFAULT_MAP")
    return [
        f"--{name.replace('_', '-')}"
        for name in names
        if str(context.get_parameter_source(name)).rpartition(".")[2] in stated
    ]


def read_friction(text: str | None) -> "Friction | None":
    """The friction for an option's text, None if it is not given; raises `InputError`."""
    from papilla.model.specimen import STICK_WORD, friction_coefficient

    if text is None:
        return None
    friction: Friction = (
        text if text == STICK_WORD else number(f'friction must be a number of at least 0 or "{STICK_WORD}"', text)
    )
    friction_coefficient(friction)
    return friction


def number(rule: str, text: str) -> float:
    """The number in a text; raises `InputError` with the rule that it violates."""
    try:
        return float(text)
    except ValueError as error:
        raise InputError(f"{rule}, got {text!r}") from error


def moduli_of(text: str) -> list[float]:
    """The moduli (MPa) in the text of `--moduli`; raises `InputError`."""
    rule = "--moduli must be numbers in MPa with commas"
    return [positive("--moduli (MPa)", number(rule, cell)) for cell in text.split(",")]


def mesh_size(size_mm: float | None) -> float | None:
    """The element size of an option, None for the finger's own; raises `InputError`."""
    return None if size_mm is None else positive("--size-mm", size_mm)


@dataclass(frozen=True)
class SpecimenOptions:
    """The touched specimen."""

    specimen: SpecimenKind = option("block", "Shape of what is touched.")
    thickness: float | None = option(None, "Thickness of a block, mm.  [default: the bench's of the finger, else 10]")
    radius: float | None = option(None, "Radius of a sphere, mm.")

    def of(self, modulus: float, design: "Finger") -> "Specimen":
        """The specimen, by default a block with the thickness of the design's bench. Raises `InputError` for an option
        that does not apply to its shape."""
        from papilla.model.specimen import SPECIMEN_KINDS

        measures = {"block": ("thickness", self.thickness), "sphere": ("radius", self.radius)}
        for shape, (name, value) in measures.items():
            if value is not None and shape != self.specimen:
                raise InputError(f"--{name} is for a {shape}, not for a {self.specimen}")
        name, value = measures.get(self.specimen, ("", None))
        if value is None and self.specimen == "block":
            return design.bench.specimen(modulus)
        if value is None and name:
            raise InputError(f"a {self.specimen} needs --{name} (mm)")
        return SPECIMEN_KINDS[self.specimen](modulus, *([] if value is None else [value]))


def describe(specimen: "Specimen") -> dict:
    """Kind and dimensions of a specimen as plain values, under the names of files."""
    from dataclasses import asdict

    from papilla.model.specimen import SPECIMEN_KINDS

    units = {"modulus": "modulus_MPa", "thickness": "thickness_mm", "radius": "radius_mm"}
    names = (shape for shape, maker in SPECIMEN_KINDS.items() if maker is type(specimen))
    shape = next(names, type(specimen).__name__.lower())
    return {"kind": shape, **{units.get(key, key): value for key, value in asdict(specimen).items() if key != "bonded"}}


def scene_of(touched: "Specimen", press: "Press") -> dict:
    """Specimen, friction and large strain of a press, as plain values and in words."""
    from papilla.model.specimen import friction_words, physics_words

    return {
        "specimen": describe(touched),
        "friction": friction_words(press.friction),
        "physics": physics_words(touched, press.friction, press.large_strain),
    }


def keep_inputs(inputs: Iterable[Path | str | None], outputs: Iterable[Path]) -> None:
    """Refuse an output that is an input or another output, also through a link or another spelling, or that cannot be
    replaced. If an output that may be written is a link, say which file is written."""
    from papilla.core.files import target_of

    written = [*outputs]
    read = [Path(name) for name in inputs if name is not None]
    for number, output in enumerate(written):
        if any(_same(output, earlier) for earlier in written[:number]):
            raise InputError(f"{output} is given for two outputs, of which one would be lost: choose another name")
        for name in read:
            if _same(name, output):
                raise InputError(f"{output} would overwrite the input {name}: choose another name")
        target = target_of(output)
        if target.exists() and not target.stat().st_mode & 0o222:
            raise InputError(f"cannot write {output}: it is read-only, and its content would be lost")
    for output in filter(Path.is_symlink, written):
        say(f"{output} is a link: {target_of(output)} is written")


def ready(inputs: Iterable[Path | str | None], outputs: Iterable[Path]) -> None:
    """`keep_inputs`, and make the folders of the outputs, so that a long computation does not fail at its end."""
    from papilla.core.files import check_writable

    written = [*outputs]
    keep_inputs(inputs, written)
    for path in written:
        check_writable(path.parent)


def read_press_log(path: Path, units: bool, **how: Any) -> "PressLog":
    """The presses of a log, read as `how` says; its notes are shown, and those on units if `units`.

    An identification reports those on units itself, among its notes or in its errors.
    """
    from papilla.logs import read_presses

    log = read_presses(path, **how)
    for note in (*log.notes, *(log.sizes if units else ())):
        say(f"{path}: {note}")
    return log


def design_of(finger: Path | None) -> "Finger":
    """The design that `FingerOption` names, without it the default finger."""
    from papilla.model.finger import Finger

    return Finger.load(finger or "default")


def surface_files(design: "Finger") -> list[str]:
    """The files of a design's surfaces; empty for a dome or slab."""
    from papilla.model.finger import Surfaces

    return [*vars(design.shape).values()] if isinstance(design.shape, Surfaces) else []


@contextmanager
def about(path: Path | None) -> Iterator[None]:
    """Bad input that is found while the content of a file, if there is one, is used names the file, like a fault found
    while reading it."""
    try:
        yield
    except InputError as error:
        named = path is None or str(path) in str(error)
        raise InputError(str(error) if named else f"{path}: {error}") from error


def _same(path: Path, second: Path) -> bool:
    if os.path.realpath(path) == os.path.realpath(second):
        return True
    try:
        return os.path.samefile(path, second)
    except OSError:
        return False
