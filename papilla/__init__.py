"""papilla: design and calibration of a soft tactile finger, and softness from its gauges.

Three verbs for the three jobs: `papilla.press`, `papilla.calibrate`, `papilla.identify`. Every name, and every room
such as `papilla.fem`, is imported on first use, so that `import papilla` costs nothing (no numpy, no FEM).
"""

from papilla.core._lazy import attach as _attach

__version__ = "0.3.0"
__getattr__, __dir__, __all__ = _attach(__name__, __file__)
__all__ += ["__version__"]
