"""Morlet wavelets of one channel and of pairs: frequency, time and phase of what two channels share (2011 Oddo)."""

from papilla.estimators.published.wavelet.cross import CrossWavelet, Ridge, Window, cross_wavelet
from papilla.estimators.published.wavelet.phase import lag_of_phase, periods_of_phase
from papilla.estimators.published.wavelet.significance import RedNoise, cross_quantile, cross_threshold
from papilla.estimators.published.wavelet.streaming import CrossRidge, RidgeEstimate, RidgeState, RidgeStatus
from papilla.estimators.published.wavelet.transform import Wavelet, morlet, octaves

__all__ = [
    "CrossRidge",
    "CrossWavelet",
    "RedNoise",
    "Ridge",
    "RidgeEstimate",
    "RidgeState",
    "RidgeStatus",
    "Wavelet",
    "Window",
    "cross_quantile",
    "cross_threshold",
    "cross_wavelet",
    "lag_of_phase",
    "morlet",
    "octaves",
    "periods_of_phase",
]
