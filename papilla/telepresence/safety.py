"""Limits of the display: when it must be silent, and how it fades out and in again within a stated time, without a
step."""

import math
from dataclasses import dataclass

from papilla import checks


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
