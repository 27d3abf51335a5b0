"""The names of `papilla.estimators.published.wavelet` and the module that defines each."""

from .cross import CrossWavelet as CrossWavelet
from .cross import Ridge as Ridge
from .cross import Window as Window
from .cross import cross_wavelet as cross_wavelet
from .phase import lag_of_phase as lag_of_phase
from .phase import periods_of_phase as periods_of_phase
from .significance import RedNoise as RedNoise
from .significance import cross_quantile as cross_quantile
from .significance import cross_threshold as cross_threshold
from .streaming import CrossRidge as CrossRidge
from .streaming import RidgeEstimate as RidgeEstimate
from .streaming import RidgeState as RidgeState
from .streaming import RidgeStatus as RidgeStatus
from .transform import Wavelet as Wavelet
from .transform import morlet as morlet
from .transform import octaves as octaves
