"""`papilla telepresence timing`: a control period of both ends on this machine, and whether their memory grows."""

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from papilla.cli.options import JsonOption, option
from papilla.cli.output import print_json, progress, show_rows
from papilla.cli.telepresence_options import SoftOptions

if TYPE_CHECKING:
    from papilla.studies.telepresence.soak import SoakRow
    from papilla.telepresence.touch import Soft

PERIOD_NAMES = ("end", "busy", "periods", "missed", "work p50, ms", "p99.9", "of which CPU p50", "p99.9", "round trip")
SOAK_NAMES = ("end", "periods", "s", "MB at the end", "MB more an hour", "±", "blocks more an hour", "±")


def timing(
    seconds: float = option(10.0, "Of each measurement."),
    load: int | None = option(None, "Busy processes beside the second measurement; one a core by default.", min=0),
    soak_hours: float | None = option(
        None,
        "Instead: how the memory of each end grows in so many hours.",
        min=1e-4,
        max=1000,
    ),
    calibration: Path | None = option(None, "calibration.json of the finger: softness and friction are estimated too."),
    as_json: JsonOption = False,
) -> None:
    """Measure one control period of sensor and display on this machine: two processes at 1 kHz, idle and loaded.

    With --calibration the sensor's end estimates softness and friction too, as `sensor --calibration` does.
    """
    from papilla import checks
    from papilla.studies.telepresence.timing import periods

    soft = SoftOptions(calibration, None, None, None, None).soft()
    rows: list[NamedTuple]
    names: tuple[str, ...]
    if soak_hours is not None:
        key, names, rows = "soak", SOAK_NAMES, list(_soaked(soak_hours, soft))
    else:
        checks.within("--seconds", seconds, 1, 3600)
        with progress() as bar:
            bar.line("two processes over loopback, idle and loaded")
            key, names, rows = "rows", PERIOD_NAMES, list(periods(seconds, load, calibration))
    if as_json:
        print_json({key: [row._asdict() for row in rows]})
    else:
        show_rows(names, ([f"{one:.3f}" if isinstance(one, float) else str(one) for one in row] for row in rows))


def _soaked(hours: float, soft: "Soft | None") -> "list[SoakRow]":
    from papilla.studies.telepresence.soak import soak
    from papilla.telepresence.texture import GratingTexture
    from papilla.telepresence.touch import Touch

    rows = []
    for side in ("sensor", "display"):
        with progress() as bar:
            bar.line(f"{side}: {hours:g} h of periods without waiting")
            rows.append(soak(side, hours, Touch(GratingTexture(1.2), soft=soft), progress=bar.steps))
    return rows
