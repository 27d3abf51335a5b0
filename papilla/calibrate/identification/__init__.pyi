"""The names of `papilla.calibrate.identification` and the module that defines each."""

from .ageing import Comparison as Comparison
from .ageing import compare as compare
from .diagnosis import Diagnosis as Diagnosis
from .diagnosis import diagnose as diagnose
from .diagnosis import record as record
from .fit import Identification as Identification
from .identifying import identify as identify
from .noise import Noise as Noise
from .parameters import PARAMETERS as PARAMETERS
