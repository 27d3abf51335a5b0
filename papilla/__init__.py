"""papilla: design and calibration of a soft tactile finger, and softness from its gauges.

Every name below is imported on first use, so that `import papilla` costs nothing (no numpy, no FEM).
"""

from importlib import import_module as _import_module

__version__ = "0.1.0"

_HOME = {
    "Finger": "papilla.finger",
    "Gauge": "papilla.finger",
    "HalfSpace": "papilla.specimen",
    "Block": "papilla.specimen",
    "Sphere": "papilla.specimen",
    "Grating": "papilla.specimen",
    "Calibration": "papilla.calibration",
    "PapillaError": "papilla.errors",
    "read_bench": "papilla.logs",
    "read_time_log": "papilla.logs",
}
"""Objects of the curated API and the module that defines each."""

_MODULES = ("calibrate", "errors", "estimators", "fem", "mesh", "references", "units", "view")
"""Packages and modules that are part of the curated API."""

__all__ = ["__version__", *_HOME, *_MODULES]


def __getattr__(name: str):
    """PEP 562: import the home of a curated name when it is first asked for."""
    if name in _HOME:
        value = getattr(_import_module(_HOME[name]), name)
    elif name in _MODULES:
        value = _import_module(f"papilla.{name}")
    else:
        raise AttributeError(f"module 'papilla' has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
