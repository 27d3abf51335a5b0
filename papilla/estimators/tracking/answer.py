"""What every tracker answers, and the state it can hand out and take back."""

from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from papilla.errors import InputError
from papilla.estimators.status_words import status_in_words


class TrackingStatus(IntEnum):
    """What became of an answer; `sentence` says it in words."""

    OK = 0
    SEARCHING = 1
    STANDSTILL = 2
    MISSING = 3
    NO_VELOCITY = 4
    ALIASED = 5
    NO_TEXTURE = 6
    DISTURBED = 7

    @property
    def sentence(self) -> str:
        """The status in words."""
        return _SENTENCES[self]


_SENTENCES = {
    TrackingStatus.OK: "ok",
    TrackingStatus.SEARCHING: "no wavelength stands out yet",
    TrackingStatus.STANDSTILL: "no movement: the wavelength is held, and its sigma grows",
    TrackingStatus.MISSING: "the reading is missing, not finite or saturated: the wavelength is held",
    TrackingStatus.NO_VELOCITY: "no finite velocity: the wavelength is held, the frequency is not known",
    TrackingStatus.ALIASED: "too fast for this sampling rate and wavelength: the sample is left out",
    TrackingStatus.NO_TEXTURE: "no texture above the noise: the wavelength is the last one seen",
    TrackingStatus.DISTURBED: "a hum, a second texture or the baseline is strong too: the wavelength may be far off",
}


class WavelengthEstimate(NamedTuple):
    """wavelength_mm, wavelength_sigma_mm, frequency_Hz (NaN where there is no answer), status (a `TrackingStatus`
    value).

    frequency_Hz is |velocity| over the wavelength. Of a block, arrays (n,).
    """

    wavelength_mm: float | np.ndarray
    wavelength_sigma_mm: float | np.ndarray
    frequency_Hz: float | np.ndarray
    status: int | np.ndarray

    @property
    def sentence(self):
        """The status in words: a string, or a list of them."""
        return status_in_words(TrackingStatus, self.status)


@dataclass(frozen=True)
class TrackerState:
    """All that a tracker remembers: its arrays by name, flattened; complex ones as real and imaginary parts in turn."""

    arrays: tuple[tuple[str, tuple[float, ...]], ...] = ()

    @classmethod
    def of(cls, parts) -> "TrackerState":
        """What (name, array or list) pairs hold."""
        return cls(tuple((name, tuple(np.ravel(values).tolist())) for name, values in parts))

    def into(self, parts) -> None:
        """Write what was kept into such pairs, which stay as they are when nothing was.

        Raises `InputError` where the state is of another tracker.
        """
        given = dict(self.arrays)
        for name, values in parts if self.arrays else ():
            if len(given.get(name, ())) != np.size(values):
                held = len(given.get(name, ()))
                raise InputError(f"the state holds {held} numbers of {name}, this tracker needs {np.size(values)}")
            flat = values if isinstance(values, list) else values.reshape(-1)
            flat[:] = given[name]
