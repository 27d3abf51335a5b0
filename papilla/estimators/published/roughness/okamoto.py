"""Wavelength and amplitude from 32 ms spectra, and amplitude as a quartic of the wavelength (Okamoto et al. 2011)."""

import math
from dataclasses import dataclass

import numpy as np

from papilla.errors import InputError
from papilla.estimators.published.roughness.stft import Method, ShortTimeSpectrum


class Okamoto(ShortTimeSpectrum):
    """Streaming wavelength and power of the strongest line; a sample is (reading, velocity_mm_s[, t_s]).

    As printed (Okamoto et al. 2011, Adv. Robot. 25, section 4): Hamming taper of 32 ms, frequency of the greatest power
    spectral density (lines 31 Hz apart), wavelength = v(t) / f, amplitude = that density. Two things are not printed:
    the window is moved by one sample, because figure 9 averages an estimate per millisecond, and 0 Hz is left out,
    because the offset of a strain gauge would always win.

    Corrected: 80 ms (32 ms hold one period of 3 mm at 100 mm/s), mean and trend removed, interpolated peak, only
    lines of the wavelength range, and the mean |v| under the taper.

    Measured (RMS error of the wavelength over 0.6-3.0 mm, synthetic gratings, as printed / corrected): 17 / 0.26 % at
    20 dB and 97-103 mm/s, 22 / 2.1 % at 0 dB; 25 / 13 % in active touch of 100 sin 2 pi t mm/s and 20 / 8.6 % of
    197 sin 2 pi 1.07 t, the touch that the paper chose its window for.

    Parameters are those of `ShortTimeSpectrum`; hop_s None is one sample.
    """

    VARIANTS = {
        "as_printed": Method(window_s=0.032, hop_s=0.0, taper=np.hamming, padding=1, corrected=False),
        "corrected": Method(window_s=0.08, hop_s=0.0, taper=np.hamming, padding=4, corrected=True),
    }


@dataclass(frozen=True, eq=False)
class AmplitudeFit:
    """Amplitude as a quartic of the wavelength, the form of g_A, equation (8) of Okamoto et al. 2011.

    In the paper it is the power of the line in V^2 s over 0.8-2.0 mm, with R^2 = 0.94, at any speed of the finger.

    coefficients : (5,) of wavelength^4 ... 1. r_squared : of the fit. wavelength_mm : where it holds, low and high.
    freedom : points minus coefficients; at 0 r_squared is 1 whatever was measured.
    """

    coefficients: np.ndarray
    r_squared: float
    wavelength_mm: tuple[float, float]
    freedom: int

    def __call__(self, wavelength_mm) -> np.ndarray:
        """Amplitude at wavelengths (scalar or (n,)); raises `InputError` outside the fitted range."""
        asked = np.asarray(wavelength_mm, float)
        low, high = self.wavelength_mm
        if not ((asked >= low) & (asked <= high)).all():
            raise InputError(f"wavelength_mm must lie between {low:g} and {high:g}, where g_A was fitted")
        return np.polyval(self.coefficients, asked)


def fit_amplitude(wavelength_mm, amplitude) -> AmplitudeFit:
    """Least-squares quartic through amplitudes (n,) at wavelengths (n,) in mm, n >= 5 different ones.

    Raises `InputError` for unequal lengths, fewer than five wavelengths or values that are not finite.
    """
    wavelength, amplitude = np.asarray(wavelength_mm, float), np.asarray(amplitude, float)
    if wavelength.ndim != 1 or wavelength.shape != amplitude.shape:
        raise InputError(f"wavelengths {wavelength.shape} and amplitudes {amplitude.shape} must be two equal columns")
    if not (np.isfinite(wavelength).all() and np.isfinite(amplitude).all()):
        raise InputError("wavelengths and amplitudes must be finite")
    if np.unique(wavelength).size < 5:
        raise InputError(f"a quartic needs 5 different wavelengths, got {np.unique(wavelength).size}")
    coefficients = np.polyfit(wavelength, amplitude, 4)
    residual = amplitude - np.polyval(coefficients, wavelength)
    spread = amplitude - amplitude.mean()
    total = float(spread @ spread)
    r_squared = 1 - float(residual @ residual) / total if total > 0 else math.nan
    return AmplitudeFit(coefficients, r_squared, (float(wavelength.min()), float(wavelength.max())), len(amplitude) - 5)
