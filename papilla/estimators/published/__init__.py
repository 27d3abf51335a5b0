"""The roughness estimators of the papers, exactly as printed and corrected, one module a method."""

from papilla.estimators.published.answer import RoughnessEstimate, RoughnessStatus
from papilla.estimators.published.counting_error import expected_error, optimal_period, wavelength_of_optimum
from papilla.estimators.published.impulse_density import ImpulseDensity
from papilla.estimators.published.interval import ImpulseInterval
from papilla.estimators.published.okamoto import AmplitudeFit, Okamoto, fit_amplitude
from papilla.estimators.published.stft import ShortTimeSpectrum
from papilla.estimators.published.stream import RoughnessStream
from papilla.estimators.published.zero_crossing import ZeroCrossing

__all__ = [
    "AmplitudeFit",
    "ImpulseDensity",
    "ImpulseInterval",
    "Okamoto",
    "RoughnessEstimate",
    "RoughnessStatus",
    "RoughnessStream",
    "ShortTimeSpectrum",
    "ZeroCrossing",
    "expected_error",
    "fit_amplitude",
    "optimal_period",
    "wavelength_of_optimum",
]
