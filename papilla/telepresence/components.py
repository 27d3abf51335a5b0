"""One wavelength component of a texture, in estimates, messages and displays."""

import math
from dataclasses import dataclass

MAX_LINES = 8
"""Largest number of lines of a texture, in a message and in a display."""


@dataclass(frozen=True)
class Component:
    """A line of the texture.

    wavelength_mm, amplitude_microstrain : of the line. Their sigma: standard deviations, NaN if not known.
    """

    wavelength_mm: float
    amplitude_microstrain: float
    wavelength_sigma_mm: float = math.nan
    amplitude_sigma_microstrain: float = math.nan

    @property
    def usable(self) -> bool:
        """Whether the component can be displayed."""
        return 0 < self.wavelength_mm < math.inf and 0 <= self.amplitude_microstrain < math.inf


def strongest(components: tuple[Component, ...], number: int) -> tuple[Component, ...]:
    """The `number` strongest usable components in the order of eq. (7) of Okamoto et al. 2011, A_i > A_j for i < j."""
    usable = [component for component in components if component.usable]
    return tuple(sorted(usable, key=lambda component: -component.amplitude_microstrain)[:number])
