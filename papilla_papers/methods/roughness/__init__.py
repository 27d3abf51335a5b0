"""The roughness estimators of the papers, exactly as printed and corrected: by impulses and by spectra."""

from papilla.core._lazy import attach as _attach

__getattr__, __dir__, __all__ = _attach(__name__, __file__)
