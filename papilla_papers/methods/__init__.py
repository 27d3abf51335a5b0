"""The methods of the papers, separate from papilla's own: roughness as printed and corrected, wavelets, textiles.

Names are imported on first use.
"""

from papilla.core._lazy import attach as _attach

__getattr__, __dir__, __all__ = _attach(__name__, __file__)
