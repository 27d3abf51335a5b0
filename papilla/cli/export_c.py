"""`papilla export-c`: a calibration as a C header, for a small chip or a control loop."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from papilla.cli.options import JsonOption, keep_inputs
from papilla.cli.output import print_json, tell


def export_c(
    calibration: Annotated[Path, typer.Argument(metavar="CALIBRATION.json", help="Calibration to export.")],
    out: Annotated[Path, typer.Option(metavar="FILE.h", help="Header to write (C99 and C++).")],
    real: Annotated[Literal["double", "float"], typer.Option(help="Type of its numbers.")] = "double",
    as_json: JsonOption = False,
) -> None:
    """Write the modulus with sigma, 95 % interval and status as C: five coefficients, checked against their ranges."""
    from papilla.calibrate.export_c import c_header
    from papilla.calibration import Calibration
    from papilla.files import write_text

    keep_inputs([calibration], [out])
    write_text(out, c_header(Calibration.load(calibration), real))
    if as_json:
        print_json({"header": str(out), "real": real})
    else:
        tell(f"Wrote {out}")
