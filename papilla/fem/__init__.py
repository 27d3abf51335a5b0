"""Finite elements: a finger on its mesh, condensed once, then pressed thousands of times.

Names are imported on first use: a press needs neither sliding nor the full mesh at finite strain.
"""

from papilla.core._lazy import attach as _attach

__getattr__, __dir__, __all__ = _attach(__name__, __file__)
