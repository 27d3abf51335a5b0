"""The calibration of a finger: the record, which estimators use (NumPy; pydantic to load a file), and `fitting`, which
makes it.

Every name is imported on first use.
"""

from papilla.core._lazy import attach as _attach

__getattr__, __dir__, __all__ = _attach(__name__, __file__)
