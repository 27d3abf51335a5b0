"""Which finger made these presses: its moduli, gauges and bench, from a log, with intervals and what to doubt.

Names are imported on first use.
"""

from papilla._lazy import attach as _attach

__getattr__, __dir__, __all__ = _attach(__name__, __file__)
