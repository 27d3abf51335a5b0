"""Direct feedback, for comparison with the local model: the sensor's signal itself is displayed when it arrives.

Equations (3) and (9) of Okamoto et al. 2011: y_m(t) = a_d y_s(t - T) = a_d G(x_m(t - 2 T)), delayed by the round trip.
"""

import math
import warnings

from papilla.core import checks
from papilla.telepresence.actuator import PIEZO_STACK, Actuator, Fader, Safety
from papilla.telepresence.amplitude import AMPLIFIER_V_PER_MICROSTRAIN, GAIN_UM_PER_V
from papilla.telepresence.local_model import LONGEST_STEP, DisplayStatus, Shown
from papilla.telepresence.motion import HAND_RATE_HZ

COUPLING_HZ = 10.0
"""Corner frequency of the amplifier's coupling for a pressed finger: pressing is far slower than any texture."""


class HighPass:
    """A second-order Butterworth high-pass, sample by sample, which keeps the texture in a pressed gauge's reading."""

    def __init__(self, rate_Hz: float, corner_Hz: float = COUPLING_HZ):
        # The bilinear transform of 1 / (1 + sqrt(2) s + s^2); k prewarps the corner, so that it lies at corner_Hz.
        k = math.tan(math.pi * corner_Hz / rate_Hz)
        norm = 1 / (1 + math.sqrt(2) * k + k * k)
        self._gain, self._back = norm, (2 * (k * k - 1) * norm, (1 - math.sqrt(2) * k + k * k) * norm)
        self._first: float | None = None
        self._one = self._two = 0.0

    def __call__(self, reading: float) -> float:
        """The filtered reading; a constant gives 0 from the first sample on."""
        if self._first is None:
            self._first = reading
        value = reading - self._first
        out = self._gain * value + self._one
        self._one = self._two - 2 * self._gain * value - self._back[0] * out
        self._two = self._gain * value - self._back[1] * out
        return out


class DirectFeedback:
    """A display of readings in the order in which the link gives them out; the last one is held until the next.

    The actuator clips signals beyond its stroke, and the status says so; its roll-off is not compensated. The output
    decays when readings stop, as with the local model.

    Parameters
    ----------
    actuator : of the display. um_per_microstrain : a_d times the gain of the amplifier, 23.8 um/V x 0.01 V as printed.
    safety : limits of the output.
    """

    def __init__(
        self,
        actuator: Actuator = PIEZO_STACK,
        *,
        um_per_microstrain: float = GAIN_UM_PER_V * AMPLIFIER_V_PER_MICROSTRAIN,
        safety: Safety | None = None,
    ):
        self.actuator, self.safety = actuator, Safety() if safety is None else safety
        self.um_per_microstrain = checks.positive("um_per_microstrain", um_per_microstrain)
        self.reset()

    def reset(self) -> None:
        """Forget everything; the output starts at zero."""
        self._fader, self._reading = Fader(self.safety), 0.0
        self._received_s = self._time_s = math.nan

    def take_reading(self, time_s: float, reading_microstrain: float) -> None:
        """Display a reading that arrived at `time_s` from now on; a non-finite one is ignored."""
        if math.isfinite(reading_microstrain):
            self._reading, self._received_s = reading_microstrain, time_s

    def hear(self, time_s: float, reading_microstrain: float) -> None:
        """The former name of `take_reading`; it warns."""
        warnings.warn("DirectFeedback.hear is now take_reading", DeprecationWarning, stacklevel=2)
        self.take_reading(time_s, reading_microstrain)

    def update(self, time_s: float) -> Shown:
        """The output of the display now."""
        dt = min(LONGEST_STEP / HAND_RATE_HZ, max(0.0, time_s - self._time_s)) if math.isfinite(self._time_s) else 0.0
        self._time_s = time_s
        alive = time_s - self._received_s <= self.safety.hold_s
        gain = self._fader.step(dt, alive)
        limit, asked = self.actuator.amplitude_um, gain * self.um_per_microstrain * self._reading
        displacement = max(-limit, min(limit, asked))
        status = DisplayStatus.CLIPPED if displacement != asked else DisplayStatus.OK
        if not alive:
            status = DisplayStatus.NO_MESSAGE if math.isnan(self._received_s) else DisplayStatus.STALLED
        return Shown(displacement, self.actuator.volts(displacement), math.nan, math.nan, gain, int(status))
