"""The answer of a tracker of the wavelength."""

from typing import Any, NamedTuple

import numpy as np

from papilla.status import Status


class TrackingStatus(Status):
    """Status of an answer; those that begin with "ok" may be used."""

    OK = "ok"
    SEARCHING = "no wavelength stands out yet: a value, if there is one, is a guess"
    STANDSTILL = "no movement: the wavelength is held"
    MISSING = "the reading is missing, not finite or saturated: the wavelength is held"
    NO_VELOCITY = "no finite velocity or position: the wavelength is held, the frequency is not known"
    ALIASED = "too fast for this sampling rate and wavelength: the wavelength is held"
    NO_TEXTURE = "the line is no longer there: the wavelength is the last one seen"
    TIME_LOCKED = "the line keeps its frequency, or is at one of the mains or a resonance: it may not be the surface's"
    CONSTANT_SPEED = "ok, constant speed: a vibration of that frequency is not excluded"
    OUT_OF_RANGE = "the lines are harmonics of a wavelength outside the search range"
    INCOHERENT = "the line is smeared: no single wavelength, or the path is wrong"
    VAGUE = "the standard deviation of the wavelength is too large"
    AMBIGUOUS = "ambiguous: a line stands out, but it may be a harmonic: the value is a guess"
    LONE = "a line of 25 to 90 Hz at a constant speed, without harmonics: it may be a motor's, not the surface's"


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
