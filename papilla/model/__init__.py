"""The finger, the specimen and the texture as values, and the file of a design.

Names are imported on first use.
"""

from papilla.core._lazy import attach as _attach

__getattr__, __dir__, __all__ = _attach(__name__, __file__)
