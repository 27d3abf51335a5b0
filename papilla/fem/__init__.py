"""Finite elements: a finger on its mesh, condensed once, then pressed thousands of times."""

from papilla.fem.fields import Field, ReceptiveFields, receptive_fields, recover
from papilla.fem.finite import press_finite
from papilla.fem.pressing.fidelity import press
from papilla.fem.pressing.press import Press
from papilla.fem.reduction.finger_model import FingerModel, prepare
from papilla.fem.reduction.reduced import ReducedFinger

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
