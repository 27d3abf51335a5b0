"""The names of `papilla.estimators.published.roughness` and the module that defines each."""

from .answer import RoughnessEstimate as RoughnessEstimate
from .answer import RoughnessStatus as RoughnessStatus
from .counting_error import expected_error as expected_error
from .counting_error import optimal_period as optimal_period
from .impulse_density import ImpulseDensity as ImpulseDensity
from .interval import ImpulseInterval as ImpulseInterval
from .okamoto import AmplitudeFit as AmplitudeFit
from .okamoto import Okamoto as Okamoto
from .okamoto import fit_amplitude as fit_amplitude
from .stft import ShortTimeSpectrum as ShortTimeSpectrum
from .stream import RoughnessStream as RoughnessStream
from .zero_crossing import ZeroCrossing as ZeroCrossing
