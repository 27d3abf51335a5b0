"""The names of `papilla_papers.methods` and the module that defines each."""

from .force_depth import ForceDepth as ForceDepth
from .roughness import ImpulseDensity as ImpulseDensity
from .roughness import ImpulseInterval as ImpulseInterval
from .roughness import Okamoto as Okamoto
from .roughness import RoughnessEstimate as RoughnessEstimate
from .roughness import ShortTimeSpectrum as ShortTimeSpectrum
from .roughness import ZeroCrossing as ZeroCrossing
from .softness import PrintedSoftness as PrintedSoftness
from .wavelet import CrossRidge as CrossRidge
