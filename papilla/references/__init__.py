"""Closed forms of contact and layered elasticity, used by tests, verification, documentation and fem (mm, N, MPa).

Names are imported on first use: a press needs one of them.
"""

from papilla.core._lazy import attach as _attach

__getattr__, __dir__, __all__ = _attach(__name__, __file__)
