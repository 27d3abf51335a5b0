"""Morlet wavelets of one channel and of pairs: frequency, time and phase of the common signal of two channels (2011
Oddo)."""

from papilla.core._lazy import attach as _attach

__getattr__, __dir__, __all__ = _attach(__name__, __file__)
