"""Young's modulus of what the finger presses on: from S_d alone, and from every gauge against its own surface."""

from papilla.estimators.softness.channels import Doubts
from papilla.estimators.softness.gauges import GaugeEstimate, GaugeSoftness
from papilla.estimators.softness.touch import Softness, SoftnessEstimate, TouchState

__all__ = ["Doubts", "GaugeEstimate", "GaugeSoftness", "Softness", "SoftnessEstimate", "TouchState"]
