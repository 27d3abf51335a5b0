"""Pictures and plots, offscreen: `view.strain`, `view.receptive` and `view.contact` write PNG, PDF or SVG files.

>>> papilla.view.strain("strain.png", finger, reduced, press, specimen)

They render with VTK where it can (EGL, OSMesa) and with matplotlib alone where it cannot. `papilla.view.plots` makes
figures of arrays. Everything is imported on first use.
"""

from papilla.core._lazy import attach as _attach

__getattr__, __dir__, __all__ = _attach(__name__, __file__)
