"""Options that the commands of `papilla telepresence` share, and what they mean."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from papilla.cli.options import about
from papilla.errors import InputError

if TYPE_CHECKING:
    from papilla.telepresence.actuator import Actuator
    from papilla.telepresence.amplitude import Rule
    from papilla.telepresence.local_model import LocalModel
    from papilla.telepresence.messages import Parameters, Quantity
    from papilla.telepresence.touch import Soft

MODULUS_MPA, FRICTION = 0.3, 0.5
"""Of the simulated specimen, unless stated."""
TOLD = {
    "modulus": ("modulus_MPa", "modulus_sigma_MPa", "modulus_status"),
    "area": ("contact_area_mm2", "contact_area_sigma_mm2", "contact_area_status"),
    "mu_kinetic": ("mu_kinetic", "mu_kinetic_sigma", "mu_kinetic_status"),
    "mu_static": ("mu_static", "mu_static_sigma", "mu_static_status"),
}
"""What rides along in a message, and its columns: value, standard deviation, status."""
TOLD_COLUMNS = tuple(column for columns in TOLD.values() for column in columns)

JsonOption = Annotated[bool, typer.Option("--json", help="Print one JSON object.")]
WavelengthOption = Annotated[float, typer.Option(help="Wavelength (mm) of the grating under the sensor.")]
AmplitudeOption = Annotated[float, typer.Option(help="Amplitude (microstrain) that a gauge reads of it.")]
NoiseOption = Annotated[float, typer.Option(help="Standard deviation (microstrain) of a reading.")]
ComponentsOption = Annotated[int, typer.Option(help="Wavelengths that are sent and displayed at most.", min=1, max=8)]
SpeedOption = Annotated[float, typer.Option(help="Greatest speed (mm/s) of the hand.")]
StrokesOption = Annotated[float, typer.Option(help="Strokes to and fro a second; 0: one at constant speed.")]
ForceOption = Annotated[
    float, typer.Option(help="Mean force (N) with which the hand presses; it swings by 40 %. Above 2 N displays stop.")
]
RateOption = Annotated[float, typer.Option(help="Messages with parameters a second.")]
CalibrationOption = Annotated[
    Path | None,
    typer.Option(help="calibration.json of the finger: softness and friction ride along.", rich_help_panel="Softness"),
]
SweepOption = Annotated[
    Path | None,
    typer.Option(help="sweep.csv of the calibration: the contact area too.", rich_help_panel="Softness"),
]
ModulusOption = Annotated[
    float | None,
    typer.Option(
        help=f"Modulus (MPa) of the simulated specimen, {MODULUS_MPA} unless stated.", rich_help_panel="Softness"
    ),
]
FrictionOption = Annotated[
    float | None,
    typer.Option(help=f"Its coefficient of friction, {FRICTION} unless stated.", rich_help_panel="Softness"),
]
ThicknessOption = Annotated[
    float | None,
    typer.Option(
        help="Thickness (mm) of the specimen, if the sensor's side knows it; else it is in the modulus' sigma.",
        rich_help_panel="Softness",
    ),
]
ActuatorOption = Annotated[
    Literal["piezo", "icpf"],
    typer.Option(help="Of the display: 55 um to 300 Hz, or ionic polymer to 200 Hz.", rich_help_panel="Display"),
]
StrokeOption = Annotated[
    float | None,
    typer.Option(help="Stroke of --actuator icpf, peak to peak, which no paper prints.", rich_help_panel="Display"),
]
RuleOption = Annotated[
    Literal["measured", "g_A"],
    typer.Option(
        help="Amplitude of a line: the sensor's own, or by its wavelength alone (2011, eq. 11).",
        rich_help_panel="Display",
    ),
]
CurveOption = Annotated[
    Path | None,
    typer.Option(
        help="Points of g_A in place of those that ship: CSV with wavelength_mm and power.",
        rich_help_panel="Display",
    ),
]


GRATING = ("wavelength", "second_wavelength", "amplitude", "noise")
SPECIMEN = ("modulus", "friction")


def refuse_with_log(context: typer.Context, log: Path | None, *names: str) -> None:
    """Refuse options of a simulated texture that were given beside a recorded one, which would ignore them."""
    given = [name for name in names if "COMMANDLINE" in str(context.get_parameter_source(name))]
    if given and log is not None:
        options = ", ".join(f"--{name.replace('_', '-')}" for name in given)
        raise InputError(f"{options}: of the simulated texture, a --log has its own")


def make_actuator(name: str, stroke_um: float | None) -> "Actuator":
    """The actuator of the options; raises `InputError` for a stroke that is missing or would be ignored."""
    from papilla.telepresence.actuator import PIEZO, icpf

    if name == "piezo":
        if stroke_um is not None:
            raise InputError("--stroke-um is for --actuator icpf: that of the piezo is 55 um")
        return PIEZO
    if stroke_um is None:
        raise InputError("--actuator icpf needs --stroke-um: no paper prints the stroke of that display")
    return icpf(stroke_um)


def make_rule(name: str, curve: Path | None, actuator: "Actuator") -> "tuple[Rule, dict[str, Any]]":
    """The rule of the options, and what is told of it."""
    from papilla.telepresence.amplitude import FromWavelength, Measured, read_curve

    if name == "measured":
        if curve is not None:
            raise InputError("--curve is for --rule g_A")
        return Measured(), {"rule": name}
    found = read_curve(curve)
    told = {
        "rule": name,
        "source": found.source,
        "wavelength_mm": list(found.fit.wavelength_mm),
        "coefficients": found.fit.coefficients.tolist(),
        "r_squared": found.fit.r_squared,
        "r_squared_as_printed": found.as_printed.r_squared,
    }
    return FromWavelength(found, actuator.amplitude_um), told


def make_model(
    components: int, name: str, stroke_um: float | None, rule: str, curve: Path | None
) -> "tuple[LocalModel, dict[str, Any]]":
    """The local model of the options, and what is told of its actuator and rule."""
    from papilla.telepresence.local_model import LocalModel

    actuator = make_actuator(name, stroke_um)
    made, told = make_rule(rule, curve, actuator)
    about_it = {"actuator": actuator.name, "stroke_um": actuator.stroke_um, "band_Hz": actuator.band_Hz}
    return LocalModel(actuator, made, components=components), {**about_it, "amplitude": told}


def make_soft(
    calibration: Path | None,
    sweep: Path | None,
    modulus: float | None,
    friction: float | None,
    thickness: float | None,
) -> "Soft | None":
    """The soft specimen under the finger of the calibration; None without one."""
    if calibration is None:
        given = {"--sweep": sweep, "--modulus": modulus, "--friction": friction, "--thickness": thickness}
        if ignored := [name for name, value in given.items() if value is not None]:
            raise InputError(f"{', '.join(ignored)} needs --calibration: without one nothing is felt of softness")
        return None
    from papilla.calibration import Calibration
    from papilla.telepresence.contact_area import ContactArea
    from papilla.telepresence.touch import Soft

    area = None if sweep is None else ContactArea.load(sweep)
    with about(calibration):
        return Soft(
            Calibration.load(calibration),
            MODULUS_MPA if modulus is None else modulus,
            FRICTION if friction is None else friction,
            thickness,
            area,
        )


def told_row(message: "Parameters | None") -> list[float | str]:
    """`TOLD_COLUMNS` of a message: NaN and nothing where it does not tell."""
    row: list[float | str] = []
    for name in TOLD:
        one: Quantity | None = getattr(message, name, None)
        if one is None:
            row += [float("nan"), float("nan"), ""]
        else:
            row += [_number(one.value), _number(one.sigma), word(one)]
    return row


def word(one: "Quantity") -> str:
    """The status of a quantity in a word."""
    from papilla.telepresence.answer import Trust

    return Trust(one.status).name.lower()


def _number(value: float | None) -> float:
    return float("nan") if value is None else value
