"""Morlet wavelets of one channel and of pairs: frequency, time and phase of what two channels share (2011 Oddo)."""

from papilla.estimators.published.wavelet.cross import CrossWavelet as CrossWavelet
from papilla.estimators.published.wavelet.cross import Ridge as Ridge
from papilla.estimators.published.wavelet.cross import Window as Window
from papilla.estimators.published.wavelet.cross import cross_wavelet as cross_wavelet
from papilla.estimators.published.wavelet.phase import lag_of_phase as lag_of_phase
from papilla.estimators.published.wavelet.phase import periods_of_phase as periods_of_phase
from papilla.estimators.published.wavelet.significance import RedNoise as RedNoise
from papilla.estimators.published.wavelet.significance import cross_quantile as cross_quantile
from papilla.estimators.published.wavelet.significance import cross_threshold as cross_threshold
from papilla.estimators.published.wavelet.streaming import CrossRidge as CrossRidge
from papilla.estimators.published.wavelet.streaming import RidgeEstimate as RidgeEstimate
from papilla.estimators.published.wavelet.streaming import RidgeState as RidgeState
from papilla.estimators.published.wavelet.streaming import RidgeStatus as RidgeStatus
from papilla.estimators.published.wavelet.transform import Wavelet as Wavelet
from papilla.estimators.published.wavelet.transform import morlet as morlet
from papilla.estimators.published.wavelet.transform import octaves as octaves
