"""The band whose amplitude follows roughness scores best, and how much a search over thousands of bands proves."""

from dataclasses import dataclass

import numpy as np

from papilla.errors import InputError
from papilla.estimators.published.texture.agreement import Concordance, concordance
from papilla.estimators.published.texture.bands import HIGHEST_HZ, band_amplitudes


@dataclass(frozen=True)
class BandMatch:
    """low_Hz, high_Hz and number of the band; agreement of its amplitude with the scores, both over their greatest.

    tried : bands that were searched. The interval of `agreement` knows nothing of the search: the best of many bands
    agrees with anything (see `matching_band`).
    """

    low_Hz: float
    high_Hz: float
    number: int
    agreement: Concordance
    tried: int


def matching_band(samples, sample_rate_Hz: float, scores, bands: list[tuple[int, int, int]]) -> BandMatch:
    """The band whose amplitude over fabrics has the greatest concordance with scores (fabrics,) > 0.

    samples (n, fabrics), one record a fabric; bands as `printed_bands` (exhaustive) or `random_bands` gives them.
    Amplitudes and scores are divided by their greatest; the textile paper says that it normalises, not how.

    What a match proves: with the four fabrics of the paper, spectra that differ at random by 20 % a band of 20 Hz and
    scores drawn without any relation to them, the best of the 11,770 bands of the exhaustive search still reached a
    concordance of 0.78 (median of 200 draws) and more than 0.9 in 23 % of them.
    Raises `InputError` for scores that do not fit, or are not positive, and as `band_amplitudes` does.
    """
    records, wanted = np.asarray(samples, float), np.asarray(scores, float)
    fitting = records.ndim == 2 and wanted.shape == (records.shape[1],)
    if not (fitting and np.isfinite(wanted).all() and (wanted > 0).all()):
        raise InputError(f"scores must be positive, one for each record of samples {records.shape}, got {wanted.shape}")
    if not bands:
        raise InputError("there is no band to search")
    each = band_amplitudes(records, sample_rate_Hz, np.arange(HIGHEST_HZ + 1))
    total = np.concatenate([np.zeros((1, records.shape[1])), np.cumsum(each, axis=0)])
    low, high = np.array([band[1] for band in bands]), np.array([band[2] for band in bands])
    amplitude = total[high] - total[low]
    amplitude /= amplitude.max(axis=1, keepdims=True)
    wanted = wanted / wanted.max()
    best = int(np.argmax(_coefficients(amplitude, wanted)))
    number, first, last = bands[best]
    return BandMatch(float(first), float(last), number, concordance(amplitude[best], wanted), len(bands))


def _coefficients(rows: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Concordance of every row (b, n) with one column (n,)."""
    deviation, other = rows - rows.mean(axis=1, keepdims=True), wanted - wanted.mean()
    shift = rows.mean(axis=1) - wanted.mean()
    return 2 * (deviation @ other) / ((deviation**2).sum(axis=1) + other @ other + len(wanted) * shift**2)
