"""The local model: the vibration of the texture at the operator's skin, synthesised from the hand's own motion.

y(t) = sum A_i sin(2 pi x(t) / lambda_i), equations (6), (7) and (10) of Okamoto et al. 2011 (Adv. Robot. 25,
doi:10.1163/016918611X574713), f = v / lambda of Okamoto et al. 2007. The phase of the printed sine jumps by 2 pi x
(1/lambda - 1/lambda') when a new wavelength arrives. Here the phase is the integral of dx / lambda, which is the same
for a constant wavelength and always continuous.
"""

import math
from dataclasses import dataclass
from operator import attrgetter
from typing import NamedTuple

from papilla.core import checks
from papilla.core.errors import InputError
from papilla.core.status import Status
from papilla.core.units import S_PER_NS
from papilla.telepresence.actuator import PIEZO_STACK, Actuator, Fader, Safety
from papilla.telepresence.amplitude import Measured, Rule
from papilla.telepresence.messages import MAX_LINES, Component, QuantityTrust, strongest
from papilla.telepresence.motion import FASTEST_HAND_MM_S, HAND_RATE_HZ, Hand


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


RAMP_S = 0.02
"""Time in which an amplitude may rise from zero to the largest."""
BELOW_HALF_RATE = 0.4
"""Share of the output rate above which frequencies are not displayed, whatever the actuator can do."""
LONGEST_STEP = 5
"""Number of output periods after which an update counts as late: the movement of the hand since then is ignored."""
NEAR_WAVELENGTH_RATIO = 1.25
"""Ratio of two wavelengths within which a new one replaces the old one in its oscillator, without a new fade-in."""


@dataclass(eq=False)
class Oscillator:
    """A displayed component: its wavelength_mm, the intended amplitude at the skin (goal_um), the present amplitude of
    the drive (now_um, before the roll-off), and its phase in turns."""

    wavelength_mm: float
    goal_um: float = 0.0
    now_um: float = 0.0
    turns: float = 0.0


class LocalModel:
    """A display that needs only parameters of the texture: `learn` them, `move` the hand, `update` at the output rate.

    The drive is always continuous: phases are integrals, and amplitudes and fading have bounded slopes. A component
    whose frequency leaves the band fades out, and its phase advances at most at the end of the band, so there is no
    aliasing. Amplitudes beyond the stroke are scaled down together, not clipped.

    Parameters
    ----------
    actuator : of the display. rule : displacement of a component from its wavelength and measured amplitude.
    components : N, how many are displayed; the paper's experiments have 1.
    rate_Hz : of the output, at least 1000.
    compensate : whether the roll-off of the actuator is compensated within the band (the paper uses only its flat
        part). safety : limits of the output.
    force_exponent : the sensor's amplitude grows with this power of the pressing force. The display then follows the
        hand's force of now, from the sensor's force in the message. 0 as in the paper: its sensor has no Z axis.

    Raises `InputError` for unusable values.
    """

    def __init__(
        self,
        actuator: Actuator = PIEZO_STACK,
        rule: Rule | None = None,
        *,
        components: int = 1,
        rate_Hz: float = HAND_RATE_HZ,
        compensate: bool = True,
        safety: Safety | None = None,
        force_exponent: float = 0.0,
    ):
        if not 1 <= components <= MAX_LINES:
            raise InputError(f"components must be 1 to {MAX_LINES}, got {components}")
        self.rate_Hz = checks.within("rate_Hz", rate_Hz, HAND_RATE_HZ, 1e6)
        self.force_exponent = checks.within("force_exponent", force_exponent, 0.0, 3.0)
        self.actuator, self.components, self.compensate = actuator, components, compensate
        self.rule: Rule = Measured() if rule is None else rule
        self.safety = Safety() if safety is None else safety
        self.top_Hz = min(actuator.band_Hz, BELOW_HALF_RATE * self.rate_Hz)
        self.reset()

    def reset(self) -> None:
        """Forget everything; the output starts at zero."""
        self.hand, self._fader = Hand(), Fader(self.safety)
        self._oscillators: list[Oscillator] = []
        self._received_s = self._time_s = self._place_mm = math.nan
        self._pressed_N = self._sensed_N = math.nan
        self._held: Shown | None = None

    def learn(
        self,
        time_s: float,
        components: tuple[Component, ...],
        trust: QuantityTrust = QuantityTrust.OK,
        force_N: float = math.nan,
    ) -> None:
        """Take the texture from a message that arrived at `time_s`, and the sensor's pressing force if it is known.

        HELD: the texture stays the same (the sensor stands still). UNKNOWN: there is no texture, and the amplitude goes
        to zero. A component without a usable wavelength or amplitude, or outside the rule's range, is not displayed.
        """
        if math.isfinite(time_s):
            self._received_s = time_s
        if trust == QuantityTrust.HELD:
            return
        self._sensed_N = force_N
        wanted = []
        for component in strongest(components, self.components) if trust == QuantityTrust.OK else ():
            amplitude = self.rule(component.wavelength_mm, component.amplitude_microstrain)
            if math.isfinite(amplitude):
                wanted.append((component.wavelength_mm, amplitude))
        self._assign(wanted)

    def _assign(self, wanted: list[tuple[float, float]]) -> None:
        """Give each wanted (wavelength, amplitude) the oscillator with the nearest wavelength; the others fade to
        zero."""
        free = list(self._oscillators)
        for oscillator in free:
            oscillator.goal_um = 0.0
        for wavelength, amplitude in wanted:
            near = any(
                1 / NEAR_WAVELENGTH_RATIO < unused.wavelength_mm / wavelength < NEAR_WAVELENGTH_RATIO for unused in free
            )
            if near or free and len(self._oscillators) == self.components:
                chosen = min(free, key=lambda unused: abs(math.log(unused.wavelength_mm / wavelength)))
                free.remove(chosen)
            else:
                chosen = Oscillator(wavelength)
                self._oscillators.append(chosen)
            chosen.wavelength_mm, chosen.goal_um = wavelength, amplitude

    def move(self, time_s: float, position_mm: float, force_N: float = math.nan) -> None:
        """Take a reading of the hand's position and, if there is one, of the pressing force."""
        self.hand.read(time_s, position_mm)
        self._fader.press(force_N)
        if math.isfinite(force_N):
            self._pressed_N = force_N

    def update(self, time_s: float) -> Shown:
        """The output of the display now; times must rise, and a time that does not changes nothing."""
        since = time_s - self._time_s
        if not math.isfinite(time_s) or -1.0 < since <= 0:
            last = self._held or Shown(0.0, self.actuator.volts(0.0), math.nan, math.nan, 0.0, 0)
            return last._replace(status=int(DisplayStatus.CLOCK))
        self._time_s = time_s
        moved, speed = self._moved(time_s, since)
        dt = min(since, LONGEST_STEP / self.rate_Hz) if since > 0 else 1 / self.rate_Hz
        status = self._condition(time_s)
        gain = self._fader.step(dt, status == DisplayStatus.OK)
        if gain == 0 and status != DisplayStatus.OK:
            for oscillator in self._oscillators:
                oscillator.now_um = 0.0
        output, limit = self._sound(moved, speed, dt, gain)
        self._held = output._replace(status=int(limit if status == DisplayStatus.OK else status))
        return self._held

    def _moved(self, time_s: float, since: float) -> tuple[float, float]:
        """(path since the last update in mm, speed in mm/s); no path if the update is late or if no hand could reach
        the place in that time."""
        place, velocity = self.hand.at(time_s)
        moved = place - self._place_mm
        self._place_mm = place
        if since * self.rate_Hz > LONGEST_STEP or not (abs(moved) <= FASTEST_HAND_MM_S * since):
            return 0.0, abs(velocity)
        return moved, abs(moved) / since

    def _condition(self, time_s: float) -> DisplayStatus:
        """The reason why the display must be silent now, or OK."""
        if math.isnan(self._received_s):
            return DisplayStatus.NO_MESSAGE
        if not 0 <= time_s - self._received_s + S_PER_NS <= self.safety.hold_s:
            return DisplayStatus.STALLED
        if not -1.0 < self.hand.age_s(time_s) <= self.safety.hold_s:
            return DisplayStatus.NO_HAND
        return DisplayStatus.PRESSED if self._fader.pressed else DisplayStatus.OK

    def _pressing(self) -> float:
        """The amplitude at the hand's force of now over that at the sensor's; 1 if one of them is unknown."""
        if self.force_exponent == 0 or not (self._pressed_N >= 0 and self._sensed_N > 0):
            return 1.0
        return (self._pressed_N / self._sensed_N) ** self.force_exponent

    def _sound(self, moved: float, speed: float, dt: float, gain: float) -> tuple[Shown, DisplayStatus]:
        """The sum of the oscillators after this step, and the status of the limit that applies."""
        actuator, top, status = self.actuator, self.top_Hz, DisplayStatus.OK
        goals, responses, pressing = [], [], self._pressing()
        for oscillator in self._oscillators:
            frequency = speed / oscillator.wavelength_mm
            share = actuator.passed(frequency, top)
            if share < 1 and oscillator.goal_um > 0:
                status = DisplayStatus.TOO_FAST
            # A phase that turns faster than the end of the band would be sampled too rarely: aliasing.
            turns = max(-top * dt, min(top * dt, moved / oscillator.wavelength_mm))
            oscillator.turns = (oscillator.turns + turns) % 1.0
            goals.append(share * pressing * oscillator.goal_um)
            responses.append(actuator.response(min(frequency, top)))
        drives = [goal / share if self.compensate else goal for goal, share in zip(goals, responses, strict=True)]
        # Scaled down together: clipping the sum would add harmonics, which feel like another texture.
        if sum(drives) > actuator.amplitude_um:
            drives = [drive * actuator.amplitude_um / sum(drives) for drive in drives]
            status = DisplayStatus.LIMITED
        # A step of an amplitude is felt as a click, so amplitudes change at a limited rate.
        most = actuator.amplitude_um * dt / RAMP_S
        for oscillator, drive in zip(self._oscillators, drives, strict=True):
            oscillator.now_um += max(-most, min(most, drive - oscillator.now_um))
        total = sum(oscillator.now_um for oscillator in self._oscillators)
        # While amplitudes ramp, their sum may exceed the stroke for a moment, although their goals do not.
        factor = gain * min(1.0, actuator.amplitude_um / total) if total > 0 else 0.0
        displacement = drive_um = 0.0
        for oscillator, response in zip(self._oscillators, responses, strict=True):
            driven = factor * oscillator.now_um * math.sin(2 * math.pi * oscillator.turns)
            drive_um += driven
            displacement += driven * response
        self._oscillators = [
            oscillator for oscillator in self._oscillators if oscillator.now_um > 0 or oscillator.goal_um > 0
        ]
        first = max(self._oscillators, key=attrgetter("goal_um"), default=None)
        if first is None or first.goal_um == 0:
            status = DisplayStatus.NO_TEXTURE
        wavelength = math.nan if first is None else first.wavelength_mm
        return Shown(displacement, actuator.volts(drive_um), speed / wavelength, wavelength, gain, 0), status
