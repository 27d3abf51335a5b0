"""The names of `papilla.calibration` and the module that defines each."""

from .fitting.checking import Check as Check
from .fitting.checking import check as check
from .fitting.export_c import c_header as c_header
from .fitting.fit import fit as fit
from .fitting.job import Calibrated as Calibrated
from .fitting.job import calibrate_finger as calibrate_finger
from .fitting.position_terms import with_positions as with_positions
from .fitting.sweep import DEFAULT_FORCES as DEFAULT_FORCES
from .fitting.sweep import DEFAULT_MODULI as DEFAULT_MODULI
from .fitting.sweep import Sweep as Sweep
from .fitting.sweep import sweep as sweep
from .published import Quadratic as Quadratic
from .published import QuadraticInverse as QuadraticInverse
from .readouts import IDENTIFIABLE_SIGMA as IDENTIFIABLE_SIGMA
from .readouts import INTERVAL_PROBABILITY as INTERVAL_PROBABILITY
from .readouts import NORMAL_FACTOR as NORMAL_FACTOR
from .readouts import GaugeSurface as GaugeSurface
from .readouts import PositionTerms as PositionTerms
from .readouts import SdSurface as SdSurface
from .readouts import SoftnessStatus as SoftnessStatus
from .readouts import Uncertainty as Uncertainty
from .record import Calibration as Calibration
from .record import Inversion as Inversion
from .surface import BicubicSurface as BicubicSurface
