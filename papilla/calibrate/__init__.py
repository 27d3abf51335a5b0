"""Calibration: sweep over force and modulus, fit, compare with what was published, identify a finger from presses.

Names are imported on first use.
"""

from papilla._lazy import attach as _attach

__getattr__, __dir__, __all__ = _attach(__name__, __file__)
