"""The calibration record (NumPy; pydantic to load a file). `papilla.calibration` makes it; the estimators use it."""

from papilla.calibration.published import Quadratic as Quadratic
from papilla.calibration.published import QuadraticInverse as QuadraticInverse
from papilla.calibration.readouts import IDENTIFIABLE as IDENTIFIABLE
from papilla.calibration.readouts import LEVEL as LEVEL
from papilla.calibration.readouts import NORMAL_FACTOR as NORMAL_FACTOR
from papilla.calibration.readouts import GaugeSurface as GaugeSurface
from papilla.calibration.readouts import PositionTerms as PositionTerms
from papilla.calibration.readouts import SdSurface as SdSurface
from papilla.calibration.readouts import SoftnessStatus as SoftnessStatus
from papilla.calibration.readouts import Uncertainty as Uncertainty
from papilla.calibration.record import Calibration as Calibration
from papilla.calibration.record import Inversion as Inversion
from papilla.calibration.surface import Surface as Surface
