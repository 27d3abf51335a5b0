"""The continuous wavelet transform with a Morlet wavelet of unit energy.

Torrence and Compo 1998, Bull. Am. Meteorol. Soc. 79:61, doi 10.1175/1520-0477(1998)079<0061:APGTWA>2.0.CO;2.
"""

from dataclasses import dataclass

import numpy as np

from papilla import checks
from papilla.errors import InputError

OMEGA0 = 6.0
"""Angular frequency of the wavelet in its own time; at 6 its mean over a Gaussian is below 1e-7."""
FOURIER = (OMEGA0 + np.sqrt(2 + OMEGA0**2)) / (4 * np.pi)
"""Frequency times scale: a sinusoid of frequency f has its greatest power at the scale FOURIER / f."""


@dataclass(frozen=True, eq=False)
class Wavelet:
    """frequency_Hz (m,); coefficients (m, n) complex, |.|^2 = 1 on average for white noise of variance 1.

    sample_rate_Hz; edge_s (m,) : distance from the ends of the record within which they affect the coefficients
    (e-folding time, sqrt(2) scale).
    """

    frequency_Hz: np.ndarray
    coefficients: np.ndarray
    sample_rate_Hz: float
    edge_s: np.ndarray

    @property
    def power(self) -> np.ndarray:
        """(m, n) squared magnitude, in squared units of the samples."""
        return np.abs(self.coefficients) ** 2

    @property
    def inside(self) -> np.ndarray:
        """(m, n) whether a coefficient is far enough from both ends of the record: the cone of influence."""
        count = self.coefficients.shape[1]
        from_end = np.minimum(np.arange(count), count - 1 - np.arange(count)) / self.sample_rate_Hz
        return from_end >= self.edge_s[:, None]


def octaves(low_Hz: float, high_Hz: float, per_octave: int = 100) -> np.ndarray:
    """Frequencies (m,) from low to high, evenly spaced in their logarithm; 100 per octave as in the 2011 paper.

    Raises `InputError` for frequencies that do not rise or are not positive.
    """
    low, high = checks.positive("low_Hz", low_Hz), checks.positive("high_Hz", high_Hz)
    if low >= high:
        raise InputError(f"low_Hz must be below high_Hz, got {low:g} and {high:g}")
    if per_octave < 1:
        raise InputError(f"per_octave must be at least 1, got {per_octave}")
    count = int(np.floor(np.log2(high / low) * per_octave + 1e-9)) + 1
    return low * 2 ** (np.arange(count) / per_octave)


def morlet(samples, sample_rate_Hz: float, frequency_Hz) -> Wavelet:
    """Transform of samples (n,) at frequencies (m,) in Hz; the mean is removed and the record is padded with zeros.

    Raises `InputError` for samples that are not finite or fewer than 8, and for frequencies at or above half the
    sampling rate (aliases) or below one period per record.
    """
    rate = checks.positive("sample_rate_Hz", sample_rate_Hz)
    values = np.asarray(samples, float)
    frequency = np.atleast_1d(np.asarray(frequency_Hz, float))
    if values.ndim != 1 or values.size < 8 or not np.isfinite(values).all():
        raise InputError(f"a wavelet transform needs one column of 8 or more finite samples, got {values.shape}")
    lowest = rate / values.size
    if not ((frequency >= lowest) & (frequency < 0.5 * rate)).all():
        raise InputError(
            f"frequency_Hz must lie between {lowest:.4g} (one period in the record) and below {0.5 * rate:.4g} (half "
            f"the sampling rate), got {frequency.min():.4g} to {frequency.max():.4g}"
        )
    scale = FOURIER / frequency
    # Zeros as long as the longest wavelet keep the end of the record from affecting its beginning.
    reach = int(np.ceil(6 * scale.max() * rate))
    length = 1 << int(np.ceil(np.log2(values.size + reach)))
    omega = 2 * np.pi * rate * np.arange(length // 2 + 1) / length
    spectrum = np.fft.rfft(values - values.mean(), length)
    daughters = np.sqrt(2 * np.pi * scale * rate)[:, None] * np.pi**-0.25
    daughters = daughters * np.exp(-0.5 * (scale[:, None] * omega - OMEGA0) ** 2)
    # The wavelet is analytic: it has only positive frequencies, so the negative half of the transform stays zero.
    whole = np.zeros((frequency.size, length), complex)
    whole[:, : omega.size] = spectrum * daughters
    whole[:, 0] = 0.0
    coefficients = np.fft.ifft(whole, axis=1)[:, : values.size]
    return Wavelet(frequency, coefficients, rate, np.sqrt(2) * scale)
