"""Young's modulus of what the finger presses on: from S_d alone, and from every gauge against its own surface."""

from papilla.estimators.softness.faults import Fault
from papilla.estimators.softness.gauge_state import GaugeState
from papilla.estimators.softness.gauges import GaugeEstimate, GaugeSoftness
from papilla.estimators.softness.sd import Softness, SoftnessEstimate, SoftnessState

__all__ = [
    "Fault",
    "GaugeEstimate",
    "GaugeSoftness",
    "GaugeState",
    "Softness",
    "SoftnessEstimate",
    "SoftnessState",
]
