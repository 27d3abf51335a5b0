"""Groups of options that the commands of `papilla telepresence` share, and the objects that they make."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from papilla.cli.options import about, given, option
from papilla.core.errors import InputError

if TYPE_CHECKING:
    from papilla.telepresence.local_model import LocalModel
    from papilla.telepresence.messages import Parameters, TrustedQuantity
    from papilla.telepresence.motion import HandMotion
    from papilla.telepresence.touch import Soft

MODULUS_MPA, DEFAULT_FRICTION = 0.3, 0.5
"""Defaults of the simulated specimen."""
GRATING_OPTIONS = ("wavelength", "second_wavelength", "amplitude", "noise")
"""Options of the simulated texture."""
MESSAGE_QUANTITY_COLUMNS = {
    "modulus": ("modulus_MPa", "modulus_sigma_MPa", "modulus_status"),
    "area": ("contact_area_mm2", "contact_area_sigma_mm2", "contact_area_status"),
    "mu_kinetic": ("mu_kinetic", "mu_kinetic_sigma", "mu_kinetic_status"),
    "mu_static": ("mu_static", "mu_static_sigma", "mu_static_status"),
}
"""Quantities of a message besides the texture, and their columns: value, standard deviation, status."""
QUANTITY_COLUMNS = tuple(column for columns in MESSAGE_QUANTITY_COLUMNS.values() for column in columns)

SOFTNESS_PANEL, DISPLAY_PANEL = {"rich_help_panel": "Softness"}, {"rich_help_panel": "Display"}

ComponentsOption = Annotated[int, typer.Option(help="Wavelengths that are sent and displayed at most.", min=1, max=8)]
RateOption = Annotated[float, typer.Option(help="Messages with parameters a second.")]
OutOption = Annotated[Path | None, typer.Option(help="Table of what was displayed, a row per ms (CSV).")]


@dataclass(frozen=True)
class GratingOptions:
    """The simulated texture under the sensor."""

    wavelength: float = option(1.2, "Wavelength (mm) of the grating under the sensor.")
    amplitude: float = option(50.0, "Amplitude (microstrain) that a gauge reads of it.")
    noise: float = option(3.5, "Standard deviation (microstrain) of a reading.")


@dataclass(frozen=True)
class HandOptions:
    """The hand's motion."""

    speed: float = option(197.0, "Greatest speed (mm/s) of the hand.")
    strokes: float = option(1.07, "Strokes to and fro a second; 0: one at constant speed.")
    force: float = option(0.5, "Mean force (N) of the hand; it swings by 40 %; displays stop above 2 N.")

    def motion(self) -> "HandMotion":
        """The motion; raises `InputError`."""
        from papilla.telepresence.motion import HandMotion

        return HandMotion(self.speed, self.strokes, press_N=self.force)


@dataclass(frozen=True)
class SoftOptions:
    """The soft specimen under the texture, and the calibrated finger that presses on it."""

    calibration: Path | None = option(
        None, "calibration.json of the finger: softness and friction are sent too.", **SOFTNESS_PANEL
    )
    sweep: Path | None = option(None, "sweep.csv of the calibration: the contact area too.", **SOFTNESS_PANEL)
    modulus: float | None = option(
        None, f"Modulus (MPa) of the simulated specimen, {MODULUS_MPA} unless stated.", **SOFTNESS_PANEL
    )
    friction: float | None = option(
        None, f"Its coefficient of friction, {DEFAULT_FRICTION} unless stated.", **SOFTNESS_PANEL
    )
    thickness: float | None = option(
        None, "Thickness (mm) of the specimen, if the sensor's side knows it; else sigma is larger.", **SOFTNESS_PANEL
    )

    def soft(self) -> "Soft | None":
        """The soft specimen under the finger of the calibration; None without one. Raises `InputError`."""
        if self.calibration is None:
            if ignored := [f"--{name}" for name, value in vars(self).items() if value is not None]:
                raise InputError(f"{', '.join(ignored)} needs --calibration: without one nothing is felt of softness")
            return None
        from papilla.calibration import Calibration
        from papilla.telepresence.sensing import ContactArea
        from papilla.telepresence.touch import Soft

        area = None if self.sweep is None else ContactArea.load(self.sweep)
        modulus = MODULUS_MPA if self.modulus is None else self.modulus
        friction = DEFAULT_FRICTION if self.friction is None else self.friction
        with about(self.calibration):
            return Soft(Calibration.load(self.calibration), modulus, friction, self.thickness, area)


@dataclass(frozen=True)
class DisplayOptions:
    """The display: number of wavelengths, actuator and amplitude."""

    components: ComponentsOption = 1
    actuator: Literal["piezo", "icpf"] = option(
        "piezo", "Of the display: 55 um to 300 Hz, or ionic polymer to 200 Hz.", **DISPLAY_PANEL
    )
    stroke_um: float | None = option(
        None, "Stroke of --actuator icpf, peak to peak, which no paper prints.", **DISPLAY_PANEL
    )
    rule: Literal["measured", "g_A"] = option(
        "measured", "Amplitude of a line: the sensor's own, or by its wavelength alone (2011, eq. 11).", **DISPLAY_PANEL
    )
    curve: Path | None = option(
        None, "Points of g_A in place of those that ship: CSV with wavelength_mm and power.", **DISPLAY_PANEL
    )

    def model(self) -> "tuple[LocalModel, dict[str, Any]]":
        """The local model, and its actuator and rule as plain values. Raises `InputError` for a missing stroke and for
        options without effect."""
        from papilla.telepresence.actuator import PIEZO_STACK, icpf
        from papilla.telepresence.amplitude import FromWavelength, Measured, Rule, read_curve
        from papilla.telepresence.local_model import LocalModel

        if self.actuator == "piezo" and self.stroke_um is not None:
            raise InputError("--stroke-um is for --actuator icpf: that of the piezo is 55 um")
        if self.actuator == "icpf" and self.stroke_um is None:
            raise InputError("--actuator icpf needs --stroke-um: no paper prints the stroke of that display")
        if self.rule == "measured" and self.curve is not None:
            raise InputError("--curve is for --rule g_A")
        actuator = PIEZO_STACK if self.stroke_um is None else icpf(self.stroke_um)
        rule: Rule = Measured()
        amplitude: dict[str, Any] = {"rule": self.rule}
        if self.rule == "g_A":
            curve = read_curve(self.curve)
            rule = FromWavelength(curve, actuator.amplitude_um)
            amplitude |= {
                "source": curve.source,
                "wavelength_mm": list(curve.fit.wavelength_mm),
                "coefficients": curve.fit.coefficients.tolist(),
                "r_squared": curve.fit.r_squared,
                "r_squared_as_printed": curve.as_printed.r_squared,
            }
        described = {"actuator": actuator.name, "stroke_um": actuator.stroke_um, "band_Hz": actuator.band_Hz}
        return LocalModel(actuator, rule, components=self.components), {**described, "amplitude": amplitude}


def refuse_with_log(context: typer.Context, log: Path | None, *names: str) -> None:
    """Raise `InputError` for options of a simulated texture beside a recorded one, which would ignore them."""
    if log is not None and (ignored := given(context, names)):
        raise InputError(f"{', '.join(ignored)}: of the simulated texture, a --log has its own")


def quantity_row(message: "Parameters | None") -> list[float | str]:
    """The `QUANTITY_COLUMNS` of a message: NaN and an empty text for missing quantities."""
    cells: list[float | str] = []
    for name in MESSAGE_QUANTITY_COLUMNS:
        quantity: TrustedQuantity | None = getattr(message, name, None)
        numbers = (None, None) if quantity is None else (quantity.value, quantity.sigma)
        cells += [float("nan") if value is None else value for value in numbers]
        cells.append("" if quantity is None else word(quantity))
    return cells


def word(quantity: "TrustedQuantity") -> str:
    """The status of a quantity in one word."""
    from papilla.telepresence.messages import QuantityTrust

    return QuantityTrust(quantity.status).name.lower()
