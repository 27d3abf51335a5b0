"""Identifies a finger from a log of presses: its moduli, gauges and bench, with intervals and doubts.

Reading order: `parameters` (what may vary), `presses` (what a finger feels), `problem` (weighted residuals of a log),
`noise`, `posing` (a log and a design become a problem), `fit` (`identify`), `diagnosis`, `identified_finger`.

Names are imported on first use.
"""

from papilla.core._lazy import attach as _attach

__getattr__, __dir__, __all__ = _attach(__name__, __file__)
