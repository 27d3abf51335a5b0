"""The names of `papilla_papers.methods.wavelet` and the module that defines each."""

from .cross import CrossWavelet as CrossWavelet
from .cross import RedNoise as RedNoise
from .cross import Ridge as Ridge
from .cross import RidgeWindow as RidgeWindow
from .cross import Wavelet as Wavelet
from .cross import cross_quantile as cross_quantile
from .cross import cross_threshold as cross_threshold
from .cross import cross_wavelet as cross_wavelet
from .cross import lag_of_phase as lag_of_phase
from .cross import morlet as morlet
from .cross import octaves as octaves
from .cross import periods_of_phase as periods_of_phase
from .streaming import CrossRidge as CrossRidge
from .streaming import RidgeEstimate as RidgeEstimate
from .streaming import RidgeState as RidgeState
from .streaming import RidgeStatus as RidgeStatus
