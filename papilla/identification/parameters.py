"""Parameters that a fit of a finger may vary: each with its unit, prior and bounds, in one table."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from papilla.core import checks
from papilla.core.errors import InputError
from papilla.core.tables import closest
from papilla.model.finger import Finger
from papilla.model.specimen import THICKNESS_MM


@dataclass(frozen=True)
class Parameter:
    """One parameter of a finger or its bench.

    sigma : standard deviation of its prior about the start value; for a logarithmic parameter, that of its natural
    logarithm. low, high : bounds, as differences from the start value (of the logarithm, for a logarithmic parameter).
    each_gauge : True if there is one for every gauge, named "name.g1" and so on. linear : True if the readings are
    linear in it. source : where prior and bounds come from.
    """

    unit: str
    sigma: float
    low: float
    high: float
    source: str
    logarithmic: bool = False
    each_gauge: bool = False
    linear: bool = False


_BATCHES = (
    "batches of one silicone, and labs, differ by a factor of two (FACTS of the sensor: tensile and phantom data)"
)
_BY_HAND = "where a careful hand glues it: 1 mm"
_BY_EYE = "where it is set by eye: 1.5 degrees; a flat contact rolls along the skin by it"
PARAMETERS_BY_NAME: dict[str, Parameter] = {
    "outer_modulus_MPa": Parameter("MPa", 0.7, -1.6, 1.6, _BATCHES, logarithmic=True),
    "inner_modulus_MPa": Parameter("MPa", 0.7, -1.6, 1.6, _BATCHES, logarithmic=True),
    "thickness_mm": Parameter("mm", 0.03, -0.25, 0.25, "a cast block is known to 0.3 mm of 10", logarithmic=True),
    "gain": Parameter("", 2.0, -20, 20, "a foil in rubber reads 1e-4 to 2 of its strain", each_gauge=True, linear=True),
    "lever_mm": Parameter("mm", 0.87, -20, 20, "lever / gain from -2 to 1 mm", each_gauge=True, linear=True),
    "zero_microstrain": Parameter("µε", 1e3, -1e5, 1e5, "an amplifier's zero", each_gauge=True, linear=True),
    "touch_down_mm": Parameter("mm", 0.5, -2.0, 2.0, "0.155 mm in the published press", linear=True),
    "row_along_mm": Parameter("mm", 1.0, -1.5, 1.5, f"all gauges towards greater x, {_BY_HAND}"),
    "row_across_mm": Parameter("mm", 1.0, -1.5, 1.5, f"all gauges towards greater y, {_BY_HAND}"),
    "place_mm": Parameter("mm", 1.0, -1.5, 1.5, f"one gauge towards greater x, {_BY_HAND}", each_gauge=True),
    "tilt_x_deg": Parameter("deg", 1.5, -3.0, 3.0, f"of the finger about x, {_BY_EYE}"),
    "tilt_y_deg": Parameter("deg", 1.5, -3.0, 3.0, f"of the finger about y, {_BY_EYE}"),
    "stick_share": Parameter("", 0.5, -0.5, 0.5, "0 without friction, 1 stuck; silicones may lie anywhere between"),
    "common_gain": Parameter("", 3.0, -9.2, 9.2, "all gains and levers over the design's", logarithmic=True),
    "common_lever_mm": Parameter("mm", 0.87, -2.0, 1.0, "all levers over gains, besides the design's"),
    "specimen_modulus": Parameter("MPa", 0.1, -0.5, 0.5, "modulus_sigma_MPa of the log", logarithmic=True),
}
"""All parameters. Gains have next to no prior; the prior of a lever is on its ratio to the gain. Each specimen whose
log states an uncertainty of its modulus has a modulus parameter. There is a share of stick if the friction is not
stated."""

CONTACT_MOVES = ("row_along_mm", "row_across_mm", "place_mm", "tilt_x_deg", "tilt_y_deg")
"""Parameters that move contacts relative to gauges: 0 unless they are freed or fixed."""

OF_THE_LOG = ("specimen_modulus", "stick_share")
"""Parameters that the data and the stated friction determine to be free or not: no user names them."""

OF_THE_BENCH = ("tilt_x_deg", "tilt_y_deg", "specimen_modulus", "stick_share")
"""Parameters that belong to the bench, not to the finger."""

LEVER_PER_GAIN_MM = -0.5
"""Mean of the prior of lever over gain; `PARAMETERS_BY_NAME` has its standard deviation, that of a uniform distribution
from -2 to 1 mm."""


def names_of(finger: Finger) -> tuple[str, ...]:
    """The names of all parameters of a finger and its bench, with one name per gauge where each gauge has its own."""
    gauges = [gauge.name for gauge in finger.gauges]
    names: list[str] = []
    for key, parameter in PARAMETERS_BY_NAME.items():
        if key not in OF_THE_LOG:
            names += [f"{key}.{gauge}" for gauge in gauges] if parameter.each_gauge else [key]
    return tuple(names)


def linear_last(names: Iterable[str]) -> tuple[str, ...]:
    """The names in their order, but linear parameters after the others."""
    return tuple(sorted(names, key=lambda name: PARAMETERS_BY_NAME[kind(name)].linear))


def kind(name: str) -> str:
    """The entry of `PARAMETERS_BY_NAME` for a parameter's name."""
    return name.split(".", 1)[0]


def plain_value(name: str, value: float) -> bool:
    """Whether a parameter has the value of a finger as it is drawn: 0, and 1 for a factor of all gains."""
    return value == (1.0 if kind(name) == "common_gain" else 0.0)


def start_of(finger: Finger, thickness_mm: float = THICKNESS_MM) -> dict[str, float]:
    """Start value of each parameter of a finger, from its design, in the parameter's unit."""
    values = {
        "outer_modulus_MPa": finger.outer.modulus,
        "inner_modulus_MPa": finger.inner.modulus,
        "thickness_mm": thickness_mm,
        "touch_down_mm": finger.bench.touch_down,
        "common_gain": 1.0,
    }
    for gauge in finger.gauges:
        values[f"gain.{gauge.name}"] = gauge.membrane_gain
        values[f"lever_mm.{gauge.name}"] = gauge.lever_mm
        values[f"zero_microstrain.{gauge.name}"] = 0.0
    return {name: values.get(name, 0.0) for name in names_of(finger)}


def expanded(asked: Sequence[str], finger: Finger) -> list[str]:
    """The parameters that `asked` stands for ("gain" for those of all gauges). Raises `InputError` for unknown
    names."""
    names, parameters = names_of(finger), []
    for name in asked:
        if name in names:
            parameters.append(name)
        elif name in PARAMETERS_BY_NAME and name not in OF_THE_LOG:
            parameters += [parameter for parameter in names if kind(parameter) == name]
        else:
            every = [key for key in PARAMETERS_BY_NAME if key not in OF_THE_LOG]
            meant = closest(name, [*every, *names])
            hint = f", did you mean {meant}?" if meant else "."
            raise InputError(f"no parameter is called {name!r}{hint} There are {', '.join(every)}")
    return list(dict.fromkeys(parameters))


def checked_values(fix: Mapping[str, float], finger: Finger) -> dict[str, float]:
    """The values at which parameters are held, by their full names; raises `InputError`."""
    values = {}
    for asked, value in fix.items():
        for name in expanded([asked], finger):
            number = checks.finite(asked, value)
            values[name] = checks.positive(asked, number) if PARAMETERS_BY_NAME[kind(name)].logarithmic else number
    return values


def scaled(name: str, value: float) -> float:
    """A parameter's value in the scale of the fit."""
    return math.log(value) if PARAMETERS_BY_NAME[kind(name)].logarithmic else value


def physical(name: str, value: float) -> float:
    """The value, in its unit, of a parameter that is given in the scale of the fit."""
    return math.exp(value) if PARAMETERS_BY_NAME[kind(name)].logarithmic else value
