"""Calibration: sweep over force and modulus, fit, compare with what was published, identify a finger from presses."""

from papilla.calibrate.checking import Check, check
from papilla.calibrate.export_c import c_header
from papilla.calibrate.fitting import fit
from papilla.calibrate.identification import Identification, identify
from papilla.calibrate.indentation import IndentationModulus, fit_indentation
from papilla.calibrate.job import Calibrated, calibrate_finger
from papilla.calibrate.material_fit import MaterialTests, fit_material
from papilla.calibrate.position_terms import with_positions
from papilla.calibrate.press_table import DEFAULT_FORCES, DEFAULT_MODULI, Sweep, sweep
from papilla.calibrate.relaxation import Relaxation, fit_relaxation
from papilla.calibrate.suggest import Suggestion
from papilla.calibrate.suggest import suggest as suggest_presses

__all__ = [
    "DEFAULT_FORCES",
    "DEFAULT_MODULI",
    "Calibrated",
    "Check",
    "Identification",
    "IndentationModulus",
    "MaterialTests",
    "Relaxation",
    "Suggestion",
    "Sweep",
    "c_header",
    "calibrate_finger",
    "check",
    "fit",
    "fit_indentation",
    "fit_material",
    "fit_relaxation",
    "identify",
    "suggest_presses",
    "sweep",
    "with_positions",
]
