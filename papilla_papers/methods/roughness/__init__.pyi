"""The names of `papilla_papers.methods.roughness` and the module that defines each."""

from .impulses import ImpulseDensity as ImpulseDensity
from .impulses import ImpulseInterval as ImpulseInterval
from .impulses import ZeroCrossing as ZeroCrossing
from .impulses import expected_error as expected_error
from .impulses import optimal_period as optimal_period
from .spectra import AmplitudeFit as AmplitudeFit
from .spectra import Okamoto as Okamoto
from .spectra import ShortTimeSpectrum as ShortTimeSpectrum
from .spectra import fit_amplitude as fit_amplitude
from .stream import RoughnessEstimate as RoughnessEstimate
from .stream import RoughnessStatus as RoughnessStatus
from .stream import RoughnessStream as RoughnessStream
