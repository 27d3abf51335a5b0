"""The roughness estimators of the papers, exactly as printed and corrected, one module a method."""

from papilla.estimators.published.roughness.answer import RoughnessEstimate as RoughnessEstimate
from papilla.estimators.published.roughness.answer import RoughnessStatus as RoughnessStatus
from papilla.estimators.published.roughness.counting_error import expected_error as expected_error
from papilla.estimators.published.roughness.counting_error import optimal_period as optimal_period
from papilla.estimators.published.roughness.impulse_density import ImpulseDensity as ImpulseDensity
from papilla.estimators.published.roughness.interval import ImpulseInterval as ImpulseInterval
from papilla.estimators.published.roughness.okamoto import AmplitudeFit as AmplitudeFit
from papilla.estimators.published.roughness.okamoto import Okamoto as Okamoto
from papilla.estimators.published.roughness.okamoto import fit_amplitude as fit_amplitude
from papilla.estimators.published.roughness.stft import ShortTimeSpectrum as ShortTimeSpectrum
from papilla.estimators.published.roughness.stream import RoughnessStream as RoughnessStream
from papilla.estimators.published.roughness.zero_crossing import ZeroCrossing as ZeroCrossing
