"""A C header that evaluates the compact inverse and its sigma: no library but math.h, no state, no allocation.

The C code is `report/templates/softness.h`; the coefficients of a calibration are substituted in it.
"""

from string import Template
from typing import Literal

from papilla.calibration import NORMAL_FACTOR, Calibration
from papilla.calibration.fitting.fit import fit_compact
from papilla.calibration.readouts import Compact
from papilla.core.outside import shipped

C_REAL_TYPES = {"double": ("", ".17g", "DBL_MAX"), "float": ("f", ".9g", "FLT_MAX")}
"""Type of the numbers in C: ending of constants and of the functions of math.h, digits that C reads back bit for bit,
and the largest number."""


def c_header(calibration: Calibration, real: Literal["double", "float"] = "double") -> str:
    """The header (C99 and C++) of a calibration's compact form, which is fitted now if the calibration has none.

    real : type of its numbers. In double its answers are those of `Compact.answer` to 1e-9 (a compiled test holds it to
    that). Raises `InputError` if the form does not fit the calibration.
    """
    from papilla import __version__

    form: Compact = calibration.compact or fit_compact(calibration)
    ending, digits, largest = C_REAL_TYPES[real]

    def exact(*values: float) -> str:
        texts = (format(float(value), digits) for value in values)
        return ", ".join((text if "." in text or "e" in text else f"{text}.0") + ending for text in texts)

    # A name could contain the end of a comment or of a line
    name = str(calibration.finger.get("name") or "a measured finger")
    facts = {"version": __version__, "real": real, "f": ending, "largest": largest}
    facts["finger"] = "".join(sign if sign.isprintable() and sign not in "*/\\" else " " for sign in name)
    for key in ("coefficients", "force_N", "modulus_MPa"):
        facts[key] = exact(*getattr(form, key))
    for side, force, modulus in zip(("low", "high"), form.force_N, form.modulus_MPa, strict=True):
        facts |= {f"force_{side}": f"{force:.4g}", f"modulus_{side}": f"{modulus:.4g}"}
    facts |= {"rms": f"{form.rms:.1%}", "max": f"{form.max:.1%}", "doubt": f"{form.doubt:.2%}"}
    facts |= {"exact_rms": exact(form.rms), "exact_doubt": exact(form.doubt), "normal": exact(NORMAL_FACTOR)}
    template = shipped("papilla.calibration.fitting", "templates", "softness.h")
    return Template(template).substitute(facts)
