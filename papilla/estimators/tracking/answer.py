"""The answer of a tracker of the wavelength."""

from typing import Any, NamedTuple

import numpy as np

from papilla.status import Status


class TrackingStatus(Status):
    """Status of an answer; those that begin with "ok" may be used."""

    OK = 0, "ok"
    SEARCHING = 1, "no wavelength stands out yet: a value, if there is one, is a guess"
    STANDSTILL = 2, "no movement: the wavelength is held"
    MISSING = 3, "the reading is missing, not finite or saturated: the wavelength is held"
    NO_VELOCITY = 4, "no finite velocity or position: the wavelength is held, the frequency is not known"
    ALIASED = 5, "too fast for this sampling rate and wavelength: the wavelength is held"
    NO_TEXTURE = 6, "the line is no longer there: the wavelength is the last one seen"
    TIME_LOCKED = (
        7,
        "the line keeps its frequency, or is at one of the mains or a resonance: it may not be the surface's",
    )
    CONSTANT_SPEED = 8, "ok, constant speed: a vibration of that frequency is not excluded"
    OUT_OF_RANGE = 9, "the lines are harmonics of a wavelength outside the search range"
    INCOHERENT = 10, "the line is smeared: no single wavelength, or the path is wrong"
    AMBIGUOUS = 12, "ambiguous: a line stands out, but it may be a harmonic: the value is a guess"
    LONE = 13, "a line of 25 to 90 Hz at a constant speed, without harmonics: it may be a motor's, not the surface's"
    VAGUE = 11, "the standard deviation of the wavelength is too large"


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
    def sentence(self) -> Any:
        """The status in words: a string, or a list of them."""
        return TrackingStatus.in_words(self.status)


class FusedEstimate(NamedTuple):
    """The fields of `WavelengthEstimate` for all gauges together; and wavelength_by_phase_mm with its sigma, from the
    phases between gauges (NaN if their places are unknown or the number of whole turns is not clear); gauges : number
    of gauges with readings now. Of a block, arrays (n,)."""

    wavelength_mm: float | np.ndarray
    wavelength_sigma_mm: float | np.ndarray
    frequency_Hz: float | np.ndarray
    status: int | np.ndarray
    wavelength_by_phase_mm: float | np.ndarray
    wavelength_by_phase_sigma_mm: float | np.ndarray
    gauges: int | np.ndarray

    @property
    def sentence(self) -> Any:
        """The status in words: a string, or a list of them."""
        return TrackingStatus.in_words(self.status)
