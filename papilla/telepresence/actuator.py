"""The actuator at the operator's fingertip (stroke, band, roll-off, voltage), and its limits: when the output must be
silent, and how it fades out and in again within a stated time, without a step."""

import math
from dataclasses import dataclass

from papilla.core import checks

BAND_FADE_SHARE = 0.05
"""Share of the band, at its upper end, over which a component fades out."""


@dataclass(frozen=True)
class Actuator:
    """A vibrotactile actuator.

    Parameters
    ----------
    name : what it is called.
    stroke_um : largest displacement, peak to peak; half of it is the largest amplitude.
    band_Hz : frequencies up to here are displayed; components are faded out over the last 5 % before it.
    corner_Hz : frequency at which the response has fallen by 3 dB; infinite for a flat response.
    order : of the Butterworth magnitude that models the roll-off.
    drive_V : voltage for the whole stroke (linear), so that half of it is the middle; NaN if not known.

    Raises `InputError` for values that are not positive.
    """

    name: str
    stroke_um: float
    band_Hz: float
    corner_Hz: float = math.inf
    order: int = 20
    drive_V: float = math.nan

    def __post_init__(self):
        checks.positive("stroke_um", self.stroke_um)
        checks.positive("band_Hz", self.band_Hz)

    @property
    def amplitude_um(self) -> float:
        """The largest amplitude, half of the stroke."""
        return 0.5 * self.stroke_um

    def response(self, frequency_Hz: float) -> float:
        """Ratio of the displacement to the commanded one at this frequency: 1 / sqrt(1 + (f / corner)^(2 order))."""
        return 1 / math.sqrt(1 + (frequency_Hz / self.corner_Hz) ** (2 * self.order))

    def passed(self, frequency_Hz: float, top_Hz: float) -> float:
        """Share (0 to 1) of a component that is displayed if the band ends at `top_Hz`: a raised cosine."""
        # 0 where the fade begins, 1 at the end of the band.
        end = (frequency_Hz - (1 - BAND_FADE_SHARE) * top_Hz) / (BAND_FADE_SHARE * top_Hz)
        if end <= 0:
            return 1.0
        return 0.0 if end >= 1 else 0.5 * (1 + math.cos(math.pi * end))

    def volts(self, drive_um: float) -> float:
        """Voltage for a displacement about the middle of the stroke, before the roll-off."""
        return self.drive_V * (0.5 + drive_um / self.stroke_um)


PIEZO_STACK = Actuator("piezo", stroke_um=55.0, band_Hz=300.0, corner_Hz=310.0, order=20, drive_V=150.0)
"""The stack of Okamoto et al. 2011, section 3.2.1: 55 um peak to peak at 150 V, flat to 300 Hz, -3 dB at 310 Hz.

Two printed numbers determine the order: order 20 is 1 dB down at 300 Hz, which agrees with "relatively flat".
"""


def icpf(stroke_um: float) -> Actuator:
    """The ionic polymer display of Okamoto et al. 2007, 0 to 200 Hz; its stroke is not printed and must be stated."""
    return Actuator("ICPF", stroke_um=checks.positive("stroke_um", stroke_um), band_Hz=200.0)


@dataclass(frozen=True)
class Safety:
    """Limits of a display.

    Parameters
    ----------
    hold_s : time after a message for which it is used; then the output decays.
    decay_s : time in which it decays linearly to exactly zero, so it is zero `hold_s + decay_s` after the last message.
    attack_s : time in which it rises again.
    force_limit_N : pressing force above which it decays; in Okamoto et al. 2011 the limit is 2 N.
    force_release_N : force below which it rises again.

    Raises `InputError` for values that are not positive, or a release above the limit.
    """

    hold_s: float = 0.5
    decay_s: float = 0.3
    attack_s: float = 0.1
    force_limit_N: float = 2.0
    force_release_N: float = 1.9

    def __post_init__(self):
        for name in ("hold_s", "decay_s", "attack_s", "force_limit_N", "force_release_N"):
            checks.positive(name, getattr(self, name))
        checks.within("force_release_N", self.force_release_N, 0, self.force_limit_N)


class Fader:
    """A gain between 0 and 1 that rises in `attack_s` and falls in `decay_s`, without steps."""

    def __init__(self, safety: Safety):
        self.safety, self.gain, self.pressed = safety, 0.0, False

    def step(self, dt_s: float, wanted: bool) -> float:
        """The gain after another `dt_s`."""
        if wanted:
            self.gain = min(1.0, self.gain + dt_s / self.safety.attack_s)
        else:
            self.gain = max(0.0, self.gain - dt_s / self.safety.decay_s)
        return self.gain

    def press(self, force_N: float) -> None:
        """Take a reading of the pressing force; a non-finite one changes nothing."""
        if math.isfinite(force_N):
            limit = self.safety.force_release_N if self.pressed else self.safety.force_limit_N
            self.pressed = force_N > limit
