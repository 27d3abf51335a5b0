"""Telepresence: parameters of a texture are sent, and the display synthesises the touch from them and the hand's own
motion.

Every name is imported on first use.
"""

from papilla.core._lazy import attach as _attach

__getattr__, __dir__, __all__ = _attach(__name__, __file__)
