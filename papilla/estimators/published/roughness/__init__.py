"""The roughness estimators of the papers, exactly as printed and corrected, one module a method."""

from papilla.estimators.published.roughness.answer import RoughnessEstimate, RoughnessStatus
from papilla.estimators.published.roughness.counting_error import expected_error, optimal_period
from papilla.estimators.published.roughness.impulse_density import ImpulseDensity
from papilla.estimators.published.roughness.interval import ImpulseInterval
from papilla.estimators.published.roughness.okamoto import AmplitudeFit, Okamoto, fit_amplitude
from papilla.estimators.published.roughness.stft import ShortTimeSpectrum
from papilla.estimators.published.roughness.stream import RoughnessStream
from papilla.estimators.published.roughness.zero_crossing import ZeroCrossing

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
]
