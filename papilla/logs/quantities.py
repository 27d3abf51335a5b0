"""Quantities of a log: papilla's column, the units that labs use, and the names that they give it."""

import re
from collections.abc import Mapping
from dataclasses import dataclass

from papilla.units import CM, KILO, MEGA, MICRO, MILLI, NANO, PER_CENT, S_PER_MIN, gf_to_newton

SAMPLE_RATE_HZ = 1000.0
"""Samples a second of a log whose rate is not stated, as in Okamoto et al. 2011, section 3."""

_TIMES = {"s": 1.0, "ms": MILLI, "us": MICRO, "ns": NANO, "min": S_PER_MIN}
_NEWTON = {"N": 1.0, "mN": MILLI, "kN": KILO}
_FORCES = _NEWTON | {"gf": gf_to_newton(1.0), "g": gf_to_newton(1.0), "kgf": gf_to_newton(KILO)}
_LENGTHS = {"mm": 1.0, "um": MILLI, "cm": CM, "m": KILO}
_SPEEDS = {f"{unit}/s": factor for unit, factor in _LENGTHS.items()}
_PRESSURES = {"MPa": 1.0, "kPa": MILLI, "Pa": MICRO, "GPa": KILO}
_TORQUES = {"Nmm": 1.0, "mNm": 1.0, "Ncm": CM, "Nm": KILO}
ISO = "iso"
"""Unit of a time written as date and time (2026-05-04T12:30:00.001)."""
STRAINS = {"microstrain": 1.0, "ue": 1.0, "um/m": 1.0, "strain": MEGA, "m/m": MEGA, "%": MEGA / PER_CENT}
BRIDGES = ("mV/V", "V", "counts")
"""Units of an amplifier's output; the gauge factor converts it to strain (`papilla.logs.log_map.Column`)."""


@dataclass(frozen=True)
class Quantity:
    """units : name -> factor to the unit of papilla's column. words : names that labs give it, in small letters."""

    units: Mapping[str, float]
    words: tuple[str, ...]


QUANTITIES = {
    "t_s": Quantity(_TIMES | {ISO: 1.0}, ("t", "time", "timestamp", "stamp", "elapsed", "zeit")),
    "force_N": Quantity(
        _FORCES, ("force", "fz", "fn", "load", "normal_force", "normal", "kraft", "loadcell", "normalkraft")
    ),
    "tangential_N": Quantity(_FORCES, ("tangential", "ft", "fx", "shear", "tangential_force", "friction_force")),
    "torque_Nmm": Quantity(_TORQUES, ("torque", "moment", "tz", "mz", "my")),
    "velocity_mm_s": Quantity(_SPEEDS, ("velocity", "speed", "vel", "v", "vx", "geschwindigkeit")),
    "position_mm": Quantity(_LENGTHS, ("position", "pos", "stage", "encoder", "travel", "weg")),
    "indentation_mm": Quantity(_LENGTHS, ("indentation", "depth", "displacement", "z")),
    "modulus_MPa": Quantity(_PRESSURES, ("modulus", "e", "young", "youngs_modulus", "stiffness")),
    "modulus_sigma_MPa": Quantity(_PRESSURES, ("modulus_sigma",)),
    "thickness_mm": Quantity(_LENGTHS, ("thickness",)),
    "radius_mm": Quantity(_LENGTHS, ("radius",)),
    "x_mm": Quantity(_LENGTHS, ("x",)),
    "y_mm": Quantity(_LENGTHS, ("y",)),
    "sd_microstrain": Quantity(STRAINS, ("sd",)),
    "specimen": Quantity({"text": 1.0}, ("specimen",)),
}
"""Papilla's column -> its quantity; gauges g1, g2, ... are those of `GAUGE`."""

GAUGE = Quantity(STRAINS | dict.fromkeys(BRIDGES, 1.0), ("g", "ch", "channel", "gauge", "strain", "sg", "dms", "ai"))

_BRACKETS = re.compile(r"(?P<stem>.*?)[\s_]*(?:\[(?P<a>[^\]]+)\]|\((?P<b>[^)]+)\)|\s/\s(?P<c>\S+))\s*")
_NUMBERED = re.compile(r"(?P<stem>.*?)[\s_.-]*(?P<number>[0-9]+)")


def quantity_of(column: str) -> Quantity:
    """The quantity of one of papilla's columns, `QUANTITIES` or a gauge."""
    return QUANTITIES.get(column, GAUGE)


def split_unit(name: str) -> tuple[str, str | None]:
    """Name and unit of "Fz [N]", "time(s)", "force / N", "force_gf" or "speed_mm_s"; None if there is no unit.

    A part after an underscore counts as a unit only if some quantity has exactly this unit.
    """
    if (found := _BRACKETS.fullmatch(name)) is not None:
        return found["stem"].strip(), plain_unit(next(unit for unit in found.group("a", "b", "c") if unit))
    parts = name.split("_")
    for count in (2, 1):
        unit = plain_unit("/".join(parts[-count:]))
        if len(parts) > count and any(unit in one.units for one in (*QUANTITIES.values(), GAUGE)):
            return "_".join(parts[:-count]), unit
    return name, None


def plain_unit(unit: str) -> str:
    """A unit in the spelling of `QUANTITIES`: u for micro, no spaces, points or powers of -1."""
    text = re.sub(r"[\s.·*]", "", unit).replace("µ", "u").replace("μ", "u").replace("s^-1", "/s").replace("ε", "e")
    return {"uStrain": "microstrain", "ustrain": "microstrain", "µε": "ue", "grams": "g", "sec": "s"}.get(text, text)


def split_number(name: str) -> tuple[str, int | None]:
    """Stem in small letters and number of "Strain 3" or "ch1"; None if there is no number."""
    found = _NUMBERED.fullmatch(name.strip())
    stem, number = (found["stem"], int(found["number"])) if found else (name, None)
    return re.sub(r"[\s_.-]+", "_", stem.strip().lower()), number


def column_meant(stem: str) -> str | None:
    """Papilla's column for a lab's name without its unit; None if no quantity has this name."""
    word, number = split_number(stem)
    if number is not None:
        return f"g{number}" if word in GAUGE.words and number > 0 else None
    return next((column for column, quantity in QUANTITIES.items() if word in quantity.words), None)
