"""The amplitude of a displayed component: from the amplitude that the sensor measured, or from g_A of its
wavelength."""

import math
import reprlib
from dataclasses import dataclass
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from papilla.core import checks
from papilla.core.errors import FileFormatError, InputError
from papilla.core.outside import json_value, read_text, shipped
from papilla.core.tables import TableReader
from papilla.telepresence.actuator import PIEZO_STACK

AMPLITUDE_SCHEMA = "papilla.amplitude/1"
AMPLIFIER_V_PER_MICROSTRAIN = 0.01
GAIN_UM_PER_V = 23.8
"""a_d of equation (9), and the gain of the amplifier before it: Okamoto et al. 2011, sections 5.2 and 3.2.3."""


class Rule(Protocol):
    """A rule that gives the displacement of a component."""

    def __call__(self, wavelength_mm: float, amplitude_microstrain: float) -> float:
        """Amplitude of the display in um; NaN if the rule does not apply."""


@dataclass(frozen=True)
class Measured:
    """The sensor's own amplitude times a gain, as in direct feedback: eq. (9) of Okamoto et al. 2011.

    um_per_microstrain : displacement over reading; as printed a_d = 23.8 um/V behind 0.01 V per microstrain.
    """

    um_per_microstrain: float = GAIN_UM_PER_V * AMPLIFIER_V_PER_MICROSTRAIN

    def __call__(self, wavelength_mm: float, amplitude_microstrain: float) -> float:
        """The amplitude in um."""
        return self.um_per_microstrain * amplitude_microstrain


@dataclass(frozen=True, eq=False)
class AmplitudeFit:
    """Amplitude as a quartic of the wavelength, the form of g_A, equation (8) of Okamoto et al. 2011.

    In the paper it is the power of the line in V^2 s over 0.8-2.0 mm, with R^2 = 0.94, at any speed of the finger.

    coefficients : (5,) of wavelength^4 ... 1. r_squared : of the fit. wavelength_mm : where it holds, low and high.
    freedom : points minus coefficients; at 0 r_squared is 1 whatever was measured.
    """

    coefficients: np.ndarray
    r_squared: float
    wavelength_mm: tuple[float, float]
    freedom: int

    def __call__(self, wavelength_mm) -> np.ndarray:
        """Amplitude at wavelengths (scalar or (n,)); raises `InputError` outside the fitted range."""
        asked = np.asarray(wavelength_mm, float)
        low, high = self.wavelength_mm
        if not ((asked >= low) & (asked <= high)).all():
            raise InputError(f"wavelength_mm must lie between {low:g} and {high:g}, where g_A was fitted")
        return np.polyval(self.coefficients, asked)


def fit_amplitude(wavelength_mm, amplitude) -> AmplitudeFit:
    """Least-squares quartic through amplitudes (n,) at wavelengths (n,) in mm, n >= 5 different ones.

    Raises `InputError` for unequal lengths, fewer than five wavelengths or values that are not finite.
    """
    wavelength, amplitude = np.asarray(wavelength_mm, float), np.asarray(amplitude, float)
    if wavelength.ndim != 1 or wavelength.shape != amplitude.shape:
        raise InputError(f"wavelengths {wavelength.shape} and amplitudes {amplitude.shape} must be two equal columns")
    if not (np.isfinite(wavelength).all() and np.isfinite(amplitude).all()):
        raise InputError("wavelengths and amplitudes must be finite")
    if np.unique(wavelength).size < 5:
        raise InputError(f"a quartic needs 5 different wavelengths, got {np.unique(wavelength).size}")
    coefficients = np.polyfit(wavelength, amplitude, 4)
    residual = amplitude - np.polyval(coefficients, wavelength)
    spread = amplitude - amplitude.mean()
    total = float(spread @ spread)
    r_squared = 1 - float(residual @ residual) / total if total > 0 else math.nan
    return AmplitudeFit(coefficients, r_squared, (float(wavelength.min()), float(wavelength.max())), len(amplitude) - 5)


@dataclass(frozen=True, eq=False)
class PowerCurve:
    """g_A, power of the sensor's line against the wavelength: the exponential of a quartic through ln power.

    The paper prints a quartic of the power itself, eq. (8), without legible coefficients. For small powers such a
    quartic becomes negative, which a power cannot be. `as_printed` gives it nevertheless, with its R^2.

    Parameters
    ----------
    wavelength_mm, power : (n,) points, five or more, positive. source : their origin.
    """

    wavelength_mm: tuple[float, ...]
    power: tuple[float, ...]
    source: str = ""

    @cached_property
    def fit(self) -> AmplitudeFit:
        """The quartic of ln power, with its R^2; its range is that of the points."""
        return fit_amplitude(self.wavelength_mm, np.log(self.power))

    @cached_property
    def as_printed(self) -> AmplitudeFit:
        """The quartic of the power, with its R^2."""
        return fit_amplitude(self.wavelength_mm, self.power)

    @cached_property
    def greatest(self) -> float:
        """The largest power within the range."""
        return float(np.exp(self.fit(np.linspace(*self.fit.wavelength_mm, 201)).max()))

    def __call__(self, wavelength_mm: float) -> float:
        """The power; raises `InputError` outside the range."""
        return math.exp(float(self.fit(wavelength_mm)))


@dataclass(frozen=True)
class FromWavelength:
    """Amplitude from the wavelength alone by g_A, eq. (11) of Okamoto et al. 2011.

    Printed: a = B g_A / P_max with B = 55 um, on an actuator whose stroke is 55 um peak to peak, and with g_A a power
    (V^2 s). Here B is that stroke, so the largest amplitude is half of it; and the amplitude is proportional to the
    root of a power, as in direct feedback. `as_printed` keeps the displacement proportional to the power.

    Parameters
    ----------
    g_A : power of the line against the wavelength. largest_um : amplitude at its largest power.
    as_printed : whether the displacement is proportional to the power.
    """

    g_A: PowerCurve
    largest_um: float = PIEZO_STACK.amplitude_um
    as_printed: bool = False

    def __call__(self, wavelength_mm: float, amplitude_microstrain: float = math.nan) -> float:
        """The amplitude in um; NaN outside the wavelengths for which g_A was fitted."""
        low, high = self.g_A.fit.wavelength_mm
        if not low <= wavelength_mm <= high:
            return math.nan
        share = self.g_A(wavelength_mm) / self.g_A.greatest
        return self.largest_um * (share if self.as_printed else math.sqrt(share))


AMPLITUDE_COLUMNS = ("wavelength_mm", "power")


def read_curve(path: str | PathLike | None = None) -> PowerCurve:
    """g_A from the points in a file; without a file, from the shipped points of sliding scenes.

    The file: a table (CSV) with the columns `wavelength_mm` and `power`, five rows or more; or the same in JSON, with
    `schema` "papilla.amplitude/1" and `source`. Raises `FileFormatError` and `FileAccessError`.
    """
    name = path or "amplitude_curve.json"
    document = _table(Path(path)) if path and Path(path).suffix == ".csv" else _document(name, path)
    try:
        if document["schema"] != AMPLITUDE_SCHEMA:
            raise InputError(f"schema must be {AMPLITUDE_SCHEMA}, got {reprlib.repr(document['schema'])}")
        wavelength, power = (tuple(checks.positive(key, value) for value in document[key]) for key in AMPLITUDE_COLUMNS)
        curve = PowerCurve(wavelength, power, str(document.get("source", "")))
        _ = curve.fit
        return curve
    except (ValueError, KeyError, TypeError) as error:
        what = f"no {error}" if isinstance(error, KeyError) else str(error)
        raise FileFormatError(f"{name}: not an amplitude curve: {what}") from error


def _table(path: Path) -> dict[str, Any]:
    with TableReader(path, lambda name: name in AMPLITUDE_COLUMNS) as reader:
        columns = reader.whole().columns
    return {"schema": AMPLITUDE_SCHEMA, "source": path.name} | {
        name: column.tolist() for name, column in columns.items()
    }


def _document(name: str | PathLike, path: str | PathLike | None) -> Any:
    """The content of a JSON file, or of the one that ships."""
    content = read_text(path) if path else shipped("papilla", "data", "amplitude_curve.json")
    return json_value(content, str(name), "curve of amplitudes")
