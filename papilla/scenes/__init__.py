"""Made-up readings of a finger, for whoever tests an estimator: random textures, movements and faults, drawn by rules.

Names are imported on first use.
"""

from papilla.core._lazy import attach as _attach

__getattr__, __dir__, __all__ = _attach(__name__, __file__)
