"""Finite elements: a finger on its mesh, condensed once, then pressed thousands of times."""

from papilla.fem.fields import Field, ReceptiveFields, receptive_fields, recover
from papilla.fem.finite import press_finite
from papilla.fem.model import FingerModel
from papilla.fem.prepare import prepare
from papilla.fem.press import press
from papilla.fem.reduced import ReducedFinger
from papilla.fem.scene import Press

__all__ = [
    "Field",
    "FingerModel",
    "Press",
    "ReceptiveFields",
    "ReducedFinger",
    "prepare",
    "press",
    "press_finite",
    "receptive_fields",
    "recover",
]
