"""Discriminates fabrics, and estimates their roughness from vibration: bands, concordance, outliers, nearest
neighbours."""

from papilla._lazy import attach as _attach

__getattr__, __dir__, __all__ = _attach(__name__, __file__)
