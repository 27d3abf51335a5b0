"""The names of `papilla.identification` and the module that defines each."""

from .bench import BenchPresses as BenchPresses
from .bench import calibrate_bench as calibrate_bench
from .diagnosis import Diagnosis as Diagnosis
from .diagnosis import diagnose as diagnose
from .diagnosis import record as record
from .fit import Identification as Identification
from .fit import identify as identify
from .identified_finger import PressAgreement as PressAgreement
from .identified_finger import compare as compare
from .material_fit import MaterialTests as MaterialTests
from .material_fit import fit_material as fit_material
from .noise import PressNoise as PressNoise
from .one_touch import IndentationModulus as IndentationModulus
from .one_touch import Relaxation as Relaxation
from .one_touch import fit_indentation as fit_indentation
from .one_touch import fit_relaxation as fit_relaxation
from .parameters import PARAMETERS_BY_NAME as PARAMETERS_BY_NAME
from .suggest import Suggestion as Suggestion
from .suggest import suggest_presses as suggest_presses
