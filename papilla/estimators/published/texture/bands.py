"""Amplitude in frequency bands, and the search for the band with the most of it (textile paper, equation (1)).

The paper cuts 0-500 Hz into ten bands whose edges grow by random steps, and finds 18-118 Hz. **That is a corner of its
search grid, not a finding**: 18 Hz is the smallest sixth edge that the steps allow (1 + 1 + 1 + 5 + 5 + 5), 118 Hz the
largest seventh edge from there (+ 100). A band of the greatest width at the lowest start collects the most amplitude of
any spectrum that falls slowly with frequency, whatever was touched; `Band.corner` says so of each answer.
"""

from dataclasses import dataclass

import numpy as np

from papilla import checks
from papilla.errors import InputError

STEPS_HZ = (
    tuple(range(1, 11)),
    tuple(range(1, 21)),
    tuple(range(1, 21)),
    tuple(range(5, 51, 5)),
    tuple(range(5, 51, 5)),
    tuple(range(5, 51, 5)),
    tuple(range(10, 101, 10)),
    tuple(range(10, 101, 10)),
    tuple(range(10, 101, 10)),
)
"""Widths in Hz that bands 1 to 9 may have; table 2 of the paper searches these nine, the tenth is what is left."""
HIGHEST_HZ = 500.0


@dataclass(frozen=True)
class Band:
    """low_Hz, high_Hz; number : of the band in its cut of the axis, from 1; amplitude : mean over the signals.

    corner : the start is the lowest and the width the greatest that the grid has for this number, so a wider or lower
    band might have won: the grid decided, not the signal. `sentence` says it.
    """

    low_Hz: float
    high_Hz: float
    number: int
    amplitude: float
    corner: bool

    @property
    def sentence(self) -> str:
        """The band in words, and whether it is a corner of the grid."""
        text = f"{self.low_Hz:g}-{self.high_Hz:g} Hz (band {self.number})"
        if self.corner:
            return f"{text}: a corner of the search grid, its lowest start and greatest width"
        return text


def band_amplitudes(samples, sample_rate_Hz: float, edges_Hz) -> np.ndarray:
    """Integral of the amplitude spectrum over bands (b,) between rising edges (b + 1,) in Hz, equation (1).

    samples (n,) or (n, channels), which gives (b, channels); in units of the samples times Hz. The mean is removed; the
    spectrum is one-sided, a sinusoid of amplitude 1 has a line of height 1 and width 1 / duration.
    Raises `InputError` for samples that are not finite and for edges that do not rise from 0 or more to at most half
    the sampling rate.
    """
    rate = checks.positive("sample_rate_Hz", sample_rate_Hz)
    values, edges = np.asarray(samples, float), np.asarray(edges_Hz, float)
    if values.ndim not in (1, 2) or len(values) < 8 or not np.isfinite(values).all():
        raise InputError(f"band amplitudes need 8 or more finite samples, got {values.shape}")
    if edges.ndim != 1 or edges.size < 2 or not (np.diff(edges) > 0).all() or edges[0] < 0 or edges[-1] > rate / 2:
        raise InputError(f"edges_Hz must rise from 0 or more to at most {rate / 2:g} Hz, half the sampling rate")
    amplitude = 2 / len(values) * np.abs(np.fft.rfft(values - values.mean(axis=0), axis=0))
    width = rate / len(values)
    # Lines are rectangles of one width around their frequency; the first, at 0 Hz, has half of it.
    borders = np.concatenate([[0.0], (np.arange(len(amplitude)) + 0.5) * width])
    sums = np.concatenate([np.zeros((1, *amplitude.shape[1:])), np.cumsum(amplitude * width, axis=0)])
    columns = sums.reshape(len(sums), -1)
    at_edges = np.column_stack([np.interp(edges, borders, column) for column in columns.T])
    return np.diff(at_edges, axis=0).reshape(edges.size - 1, *amplitude.shape[1:])


def printed_bands() -> list[tuple[int, int, int]]:
    """Every (number, low_Hz, high_Hz) that the grid of the paper can have: the exhaustive search."""
    starts, bands = {0}, []
    for number, steps in enumerate(STEPS_HZ, start=1):
        found = {(start, start + step) for start in starts for step in steps}
        bands += [(number, *pair) for pair in sorted(found)]
        starts = {high for _, high in found}
    return bands


def random_bands(draws: int, seed: int) -> list[tuple[int, int, int]]:
    """The bands (number, low_Hz, high_Hz) of `draws` random cuts of the axis: the random search of the paper."""
    if draws < 1:
        raise InputError(f"draws must be at least 1, got {draws}")
    generator = np.random.default_rng(seed)
    widths = np.column_stack([generator.choice(steps, draws) for steps in STEPS_HZ])
    edges = np.concatenate([np.zeros((draws, 1), int), np.cumsum(widths, axis=1)], axis=1)
    found = {
        (number + 1, int(low), int(high))
        for number in range(len(STEPS_HZ))
        for low, high in zip(edges[:, number], edges[:, number + 1], strict=True)
    }
    return sorted(found)


def best_band(samples, sample_rate_Hz: float, bands: list[tuple[int, int, int]]) -> Band:
    """The band with the greatest amplitude, averaged over the signals of samples (n,) or (n, signals).

    Raises `InputError` where there is no band, and for a sampling rate below 1000 Hz, which cannot show 0-500 Hz.
    """
    if sample_rate_Hz < 2 * HIGHEST_HZ:
        raise InputError(f"the bands go up to {HIGHEST_HZ:g} Hz, which a rate of {sample_rate_Hz:g} Hz cannot show")
    if not bands:
        raise InputError("there is no band to search")
    up_to = band_amplitudes(samples, sample_rate_Hz, np.arange(HIGHEST_HZ + 1))
    total = np.concatenate([[0.0], np.cumsum(up_to if up_to.ndim == 1 else up_to.mean(axis=1))])
    number, low, high = max(bands, key=lambda band: total[band[2]] - total[band[1]])
    first = sum(steps[0] for steps in STEPS_HZ[: number - 1])
    corner = low == first and high - low == STEPS_HZ[number - 1][-1]
    return Band(float(low), float(high), number, float(total[high] - total[low]), corner)
