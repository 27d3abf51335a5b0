"""Online estimators: `update(sample)` in a loop, `process(block)` over a log, `reset()` before something new.

Every name is imported on first use. `Pipeline` runs what the columns of a stream allow; `find_lines` is for whole logs.
"""

from importlib import import_module as _import_module

_HOME = {
    "ChirpEstimate": "tracking.blind",
    "ChirpTracker": "tracking.blind",
    "CrossRidge": "wavelet",
    "Friction": "friction",
    "FrictionEstimate": "friction",
    "FusedEstimate": "tracking",
    "FusedTracker": "tracking",
    "GaugeEstimate": "softness",
    "GaugeSoftness": "softness",
    "GaugeState": "softness",
    "ImpulseDensity": "published",
    "ImpulseInterval": "published",
    "LineEstimate": "line_tracker",
    "LineTracker": "line_tracker",
    "Okamoto": "published",
    "Pipeline": "pipeline",
    "PipelineEstimate": "pipeline",
    "ReciprocalCounter": "tracking",
    "RoughnessEstimate": "published",
    "ShortTimeSpectrum": "published",
    "Softness": "softness",
    "SoftnessEstimate": "softness",
    "SoftnessState": "softness",
    "SpaceTracker": "tracking",
    "WavelengthEstimate": "tracking",
    "WavenumberBank": "tracking",
    "ZeroCrossing": "published",
    "channel_lags": "channel_lags",
    "find_lines": "lines",
    "travelled": "lines",
}
"""Curated names and the module below that defines each."""

__all__ = [*_HOME]


def __getattr__(name: str):
    """PEP 562: import the home of a curated name when it is first asked for."""
    if name not in _HOME:
        raise AttributeError(f"module 'papilla.estimators' has no attribute {name!r}")
    value = getattr(_import_module(f"papilla.estimators.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
