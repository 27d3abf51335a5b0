"""Studies of designs: compares a few designs, or thousands, by objectives such as the expected sigma of the modulus.

Shapes are the outer sample: each is a mapped mesh that is reduced for several ratios of the layers' moduli
(`geometry`). Moduli, places of gauges, gains and levers then need only arithmetic on these results (`places`,
`presses`, `in_scene`).

Names are imported on first use.
"""

from papilla.core._lazy import attach as _attach

__getattr__, __dir__, __all__ = _attach(__name__, __file__)
