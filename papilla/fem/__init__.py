"""Finite elements: a finger on its mesh, condensed once, then pressed thousands of times."""

from papilla.fem.fields import Field, ReceptiveFields, receptive_fields, recover
from papilla.fem.finite import press_finite
from papilla.fem.pressing.fidelity import press
from papilla.fem.pressing.press import Press
from papilla.fem.reduction.finger_model import FingerModel, prepare
from papilla.fem.reduction.reduced import ReducedFinger
from papilla.fem.sliding.motion import Motion
from papilla.fem.sliding.reduced_section import ReducedSection, prepare_section
from papilla.fem.sliding.slide import Slide, slide

__all__ = [
    "Field",
    "FingerModel",
    "Motion",
    "Press",
    "ReceptiveFields",
    "ReducedFinger",
    "ReducedSection",
    "Slide",
    "prepare",
    "prepare_section",
    "press",
    "press_finite",
    "receptive_fields",
    "recover",
    "slide",
]
