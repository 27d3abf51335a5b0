"""`papilla export-c`: a calibration as a C header, for a microcontroller or a control loop."""

from functools import partial
from pathlib import Path
from typing import Literal

from papilla.cli.options import argument, keep_inputs, option
from papilla.cli.output import CommandResult, tell


def export_c(
    calibration: Path = argument(..., "Calibration to export.", metavar="CALIBRATION.json"),
    out: Path = option(..., "Header to write (C99 and C++).", metavar="FILE.h"),
    real: Literal["double", "float"] = option("double", "Type of its numbers."),
) -> CommandResult:
    """Write the modulus with sigma, 95 % interval and status as C code: five coefficients, with checks of their
    ranges."""
    from papilla.calibration import Calibration
    from papilla.calibration.fitting.export_c import c_header
    from papilla.core.files import write_text

    keep_inputs([calibration], [out])
    write_text(out, c_header(Calibration.load(calibration), real))
    return CommandResult({"header": str(out), "real": real}, partial(tell, f"Wrote {out}"))
