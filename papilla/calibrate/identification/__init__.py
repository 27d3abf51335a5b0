"""Which finger made these presses: its moduli, gauges and bench, from a log, with intervals and what to doubt."""

from papilla.calibrate.identification.ageing import Comparison, compare
from papilla.calibrate.identification.diagnosis import Diagnosis, diagnose, record
from papilla.calibrate.identification.fit import Identification
from papilla.calibrate.identification.identifying import identify
from papilla.calibrate.identification.noise import Noise
from papilla.calibrate.identification.parameters import PARAMETERS

__all__ = [
    "PARAMETERS",
    "Comparison",
    "Diagnosis",
    "Identification",
    "Noise",
    "compare",
    "diagnose",
    "identify",
    "record",
]
