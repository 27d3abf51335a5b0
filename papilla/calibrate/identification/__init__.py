"""Identifies a finger from a log of presses: its moduli, gauges and bench, with intervals and doubts.

Names are imported on first use.
"""

from papilla._lazy import attach as _attach

__getattr__, __dir__, __all__ = _attach(__name__, __file__)
