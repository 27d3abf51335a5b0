"""The output of a display at one instant, and the trust in a quantity of a message."""

from typing import NamedTuple

from papilla.status import Named, Status


class Trust(Named):
    """How far a quantity of a message may be used.

    HELD: the value of an earlier message still holds. DOUBTED: there is a value with the right sigma, but its estimator
    adds a remark to "ok": not identifiable, some channels left out, slid one way only.
    """

    OK = 0
    HELD = 1
    UNKNOWN = 2
    DOUBTED = 3


class DisplayStatus(Status):
    """Status of the display; those that begin with "ok" mean that it shows the intended texture."""

    OK = "ok"
    NO_MESSAGE = "no message about a texture has arrived yet: the output is zero"
    STALLED = "no message for too long: the output decays to zero"
    NO_HAND = "no position of the hand: the output decays to zero"
    PRESSED = "the finger presses harder than allowed: the output decays to zero"
    NO_TEXTURE = "no usable texture: the amplitude goes to zero"
    TOO_FAST = "the hand moves a component out of the band: it is faded out"
    LIMITED = "the amplitudes are scaled down to the stroke of the actuator"
    CLIPPED = "the signal is beyond the stroke of the actuator, which cuts it"
    CLOCK = "the time did not advance: the output is held"


class Shown(NamedTuple):
    """displacement_um of the skin, drive_V of the actuator, frequency_Hz and wavelength_mm of the strongest component
    (NaN if there is none or it is not known), gain (0 to 1) of the fading, status (a `DisplayStatus` value)."""

    displacement_um: float
    drive_V: float
    frequency_Hz: float
    wavelength_mm: float
    gain: float
    status: int
