"""What a classifier of textures is given: windows of a log, and the logarithms of band amplitudes in each."""

import numpy as np

from papilla import checks
from papilla.errors import InputError
from papilla.estimators.published.texture.bands import band_amplitudes


def windows(samples, length: int) -> list[np.ndarray]:
    """The log (n, channels) cut into pieces of `length` rows that do not overlap; what is left at the end is not used.

    Raises `InputError` for a log shorter than one piece.
    """
    rows = np.asarray(samples, float)
    if length < 8:
        raise InputError(f"a window must have at least 8 rows, got {length}")
    if len(rows) < length:
        raise InputError(f"the log has {len(rows)} rows, fewer than one window of {length}")
    return [rows[start : start + length] for start in range(0, len(rows) - length + 1, length)]


def log_band_features(window, sample_rate_Hz: float, bands: int) -> np.ndarray:
    """(bands x channels,) logarithm of the amplitude in bands evenly spaced in log frequency, channel by channel.

    The bands go from two periods a window to 0.95 of half the sampling rate. A straight line is removed first.
    Raises `InputError` for samples that are not finite or a channel that does not change.
    """
    rate = checks.positive("sample_rate_Hz", sample_rate_Hz)
    rows = np.atleast_2d(np.asarray(window, float).T).T
    ramp = np.column_stack([np.ones(len(rows)), np.linspace(-1, 1, len(rows))])
    if not np.isfinite(rows).all():
        raise InputError("features need finite samples")
    if not np.ptp(rows, axis=0).all():
        raise InputError("a channel does not change in this window: its amplitude has no logarithm")
    rows = rows - ramp @ np.linalg.lstsq(ramp, rows, rcond=None)[0]
    edges = np.geomspace(2 * rate / len(rows), 0.475 * rate, bands + 1)
    return np.log(band_amplitudes(rows, rate, edges)).T.ravel()
