"""The names of `papilla.calibrate` and the module that defines each."""

from .checking import Check as Check
from .checking import check as check
from .export_c import c_header as c_header
from .fitting import fit as fit
from .identification import Identification as Identification
from .identification import identify as identify
from .job import Calibrated as Calibrated
from .job import calibrate_finger as calibrate_finger
from .material_fit import MaterialTests as MaterialTests
from .material_fit import fit_material as fit_material
from .one_touch import IndentationModulus as IndentationModulus
from .one_touch import Relaxation as Relaxation
from .one_touch import fit_indentation as fit_indentation
from .one_touch import fit_relaxation as fit_relaxation
from .position_terms import with_positions as with_positions
from .press_table import DEFAULT_FORCES as DEFAULT_FORCES
from .press_table import DEFAULT_MODULI as DEFAULT_MODULI
from .press_table import Sweep as Sweep
from .press_table import sweep as sweep
from .suggest import Suggestion as Suggestion
from .suggest import suggest_presses as suggest_presses
