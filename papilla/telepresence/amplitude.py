"""How strongly a component is displayed: from the amplitude that the sensor measured, or from g_A of its wavelength."""

import json
import math
from dataclasses import dataclass
from functools import cached_property
from importlib.resources import files
from os import PathLike
from pathlib import Path
from typing import Protocol

from papilla import checks
from papilla.errors import FileFormatError, InputError
from papilla.estimators.published.roughness import AmplitudeFit, fit_amplitude

AMPLIFIER_V_PER_MICROSTRAIN = 0.01
GAIN_UM_PER_V = 23.8
"""a_d of equation (9), and the amplifier before it: Okamoto et al. 2011, sections 5.2 and 3.2.3."""


class Rule(Protocol):
    """What gives a component its displacement."""

    def __call__(self, wavelength_mm: float, amplitude_microstrain: float) -> float:
        """Amplitude of the display in um; NaN where the rule does not hold."""


@dataclass(frozen=True)
class Measured:
    """The sensor's own amplitude times a gain, as direct feedback has it: eq. (9) of Okamoto et al. 2011.

    um_per_microstrain : displacement over reading; as printed a_d = 23.8 um/V behind 0.01 V per microstrain.
    """

    um_per_microstrain: float = GAIN_UM_PER_V * AMPLIFIER_V_PER_MICROSTRAIN

    def __call__(self, wavelength_mm: float, amplitude_microstrain: float) -> float:
        """The amplitude in um."""
        return self.um_per_microstrain * amplitude_microstrain


@dataclass(frozen=True)
class FromWavelength:
    """Amplitude from the wavelength alone by g_A, eqs (8) and (11) of Okamoto et al. 2011.

    Printed: a = B g_A / P_max with B = 55 um, on an actuator whose stroke is 55 um peak to peak, and with g_A a power
    (V^2 s). Taken: B is that stroke, so the greatest amplitude is half of it; and an amplitude goes with the root of a
    power, which is also what direct feedback displays. `as_printed` keeps the displacement proportional to the power.

    Parameters
    ----------
    g_A : power of the line against the wavelength.
    largest_um : amplitude at the greatest power within the range of g_A.
    as_printed : whether the displacement is proportional to the power.
    """

    g_A: AmplitudeFit
    largest_um: float
    as_printed: bool = False

    @cached_property
    def _greatest(self) -> float:
        low, high = self.g_A.wavelength_mm
        return max(float(self.g_A(low + (high - low) * n / 200)) for n in range(201))

    def __call__(self, wavelength_mm: float, amplitude_microstrain: float = math.nan) -> float:
        """The amplitude in um; NaN outside the range of g_A, 0 where its quartic is negative."""
        low, high = self.g_A.wavelength_mm
        if not low <= wavelength_mm <= high:
            return math.nan
        share = max(0.0, float(self.g_A(wavelength_mm)) / self._greatest)
        return self.largest_um * (share if self.as_printed else math.sqrt(share))


def read_curve(path: str | PathLike | None = None) -> AmplitudeFit:
    """g_A fitted (fourth order) to the points of a file; without one, to those that papilla ships.

    The file (JSON): `schema` "papilla.amplitude/1", `wavelength_mm` and `power` (five or more), `source`. Raises
    `FileFormatError` and `FileAccessError`.
    """
    from papilla.errors import FileAccessError

    try:
        text = (Path(path) if path else files("papilla") / "data" / "amplitude_curve.json").read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise FileAccessError(f"cannot read {path}: {error}") from error
    try:
        found = json.loads(text)
        if found["schema"] != "papilla.amplitude/1":
            raise InputError(f"schema must be papilla.amplitude/1, got {found['schema']!r}")
        points = [[checks.positive(name, value) for value in found[name]] for name in ("wavelength_mm", "power")]
        return fit_amplitude(*points)
    except (ValueError, KeyError, TypeError) as error:
        raise FileFormatError(f"{path or 'amplitude_curve.json'}: not an amplitude curve: {error}") from error
