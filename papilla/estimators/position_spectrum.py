"""Power over wavenumber of readings at any positions: readings spread on an even grid of position, then transformed."""

from dataclasses import dataclass

import numpy as np

GRID_PER_PERIOD = 8
"""Grid points in the shortest wavelength: what lies beyond the grid then folds back weaker than 2 %."""
PADDING = 8


@dataclass(frozen=True, eq=False)
class PositionSpectrum:
    """power (n, channels) : squared magnitude at the wavenumbers 0, step, 2 step ... in periods a mm.

    gain : magnitude of a unit cosine at its own wavenumber. resolution : one over the path, per mm.
    spread : standard deviation of the wavenumber of a line times the square root of (line power / background).
    """

    power: np.ndarray
    step: float
    gain: float
    resolution: float
    spread: float

    @property
    def wavenumber(self) -> np.ndarray:
        """(n,) in periods a mm."""
        return self.step * np.arange(len(self.power))

    def pooled(self) -> np.ndarray:
        """(n,) mean over the channels of each one's power over its own median, from 1.5 resolutions on."""
        apart = np.arange(1.5 * self.resolution, self.step * (len(self.power) - 1), self.resolution) / self.step
        own = np.median(self.power[np.round(apart).astype(int)], axis=0)
        own = np.maximum(own, 1e-12 * own.max())
        return np.maximum(self.power @ (1 / own) / len(own), 1e-300)


def position_spectrum(
    position: np.ndarray, channels: np.ndarray, highest_per_mm: float, trend: int
) -> PositionSpectrum:
    """Spectrum of channels (n, c) at positions (n,) in mm up to a wavenumber, under a Hann taper along the path.

    A sample weighs as much as the path it stands for, so that standing still adds nothing and uneven steps do not
    matter. A polynomial of degree `trend` in position is removed first.
    """
    path = float(np.ptp(position))
    at = (position - position.min()) / path
    # Over position, not time: a path to and fro has its ends at every turn, and would leak there.
    weights = np.sin(np.pi * at) ** 2 * np.abs(np.gradient(position))
    basis = np.polynomial.legendre.legvander(2 * at - 1, trend)
    root = np.sqrt(weights)[:, None]
    level = basis @ np.linalg.lstsq(basis * root, channels * root, rcond=None)[0]
    step = 1 / (GRID_PER_PERIOD * highest_per_mm)
    grid = _spread_out(at * path / step, weights[:, None] * (channels - level))
    length = 1 << int(np.ceil(np.log2(PADDING * len(grid))))
    count = int((highest_per_mm + 3 / path) * length * step) + 1
    # One channel at a time: of each padded spectrum only the part below the highest wavenumber is kept.
    power = np.stack([np.abs(np.fft.rfft(column, length)[:count]) ** 2 for column in grid.T], axis=1)
    # Spreading a sample over two grid points is a convolution with a triangle, whose transform is sinc squared.
    power /= np.sinc(np.arange(count) / length)[:, None] ** 4
    gain = 0.5 * float(weights.sum())
    return PositionSpectrum(power, 1 / (length * step), gain, 1 / path, _spread(position, weights))


def _spread_out(places: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Values (n, c) shared by the two grid points next to each place (n,)."""
    first = np.floor(places).astype(int)
    share = (places - first)[:, None]
    grid = np.zeros((int(first.max()) + 2, values.shape[1]))
    np.add.at(grid, first, (1 - share) * values)
    np.add.at(grid, first + 1, share * values)
    return grid


def _spread(position: np.ndarray, weights: np.ndarray) -> float:
    """Standard deviation of a line's wavenumber at line power = background.

    The maximum of a weighted periodogram has the angular variance W0^2 sum(w^2 x^2) / (2 r sum(w^2) W2^2), with r the
    power over the background, W0 = sum w, W2 = sum w x^2 and x from the weighted middle.
    """
    x = position - float(weights @ position) / float(weights.sum())
    square = weights**2
    variance = weights.sum() ** 2 * (square @ x**2) / (2 * square.sum() * (weights @ x**2) ** 2)
    return float(np.sqrt(variance) / (2 * np.pi))
