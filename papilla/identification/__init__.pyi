"""The names of `papilla.identification` and the module that defines each."""

from .diagnosis import Diagnosis as Diagnosis
from .diagnosis import diagnose as diagnose
from .diagnosis import record as record
from .fit import Identification as Identification
from .fit import identify as identify
from .identified_finger import Comparison as Comparison
from .identified_finger import compare as compare
from .noise import Noise as Noise
from .parameters import PARAMETERS as PARAMETERS
