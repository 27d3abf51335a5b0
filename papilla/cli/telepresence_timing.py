"""`papilla telepresence timing`: a control period of both ends on this machine, and whether their memory grows."""

from typing import TYPE_CHECKING, Annotated, NamedTuple

import typer

from papilla.cli.output import print_json, progress, show_table
from papilla.cli.telepresence_ends import telepresence
from papilla.cli.telepresence_options import CalibrationOption, JsonOption, make_soft

if TYPE_CHECKING:
    from papilla.studies.telepresence.soak import SoakRow

SoakOption = Annotated[
    float | None,
    typer.Option(
        help="Instead: so many hours of periods of each end, one after the other without waiting, and how its memory "
        "grows.",
        min=1e-4,
        max=1000,
    ),
]


@telepresence.command()
def timing(
    seconds: Annotated[float, typer.Option(help="Of each measurement.")] = 10.0,
    load: Annotated[
        int | None, typer.Option(help="Busy processes beside the second measurement; one a core by default.", min=0)
    ] = None,
    soak_hours: SoakOption = None,
    calibration: CalibrationOption = None,
    as_json: JsonOption = False,
) -> None:
    """Measure one control period of sensor and display on this machine: two processes at 1 kHz, idle and loaded.

    With --calibration the sensor's end estimates softness and friction too, as `sensor --calibration` does.
    """
    from papilla import checks
    from papilla.studies.telepresence.timing import periods

    soft = make_soft(calibration, None, None, None, None)
    rows: list[NamedTuple]
    names: tuple[str, ...]
    if soak_hours is not None:
        rows, names = list(_soaked(soak_hours, soft)), SOAK_NAMES
    else:
        checks.within("--seconds", seconds, 1, 3600)
        with progress() as bar:
            bar.line("two processes over loopback, idle and loaded")
            rows, names = list(periods(seconds, load, calibration)), PERIOD_NAMES
    if as_json:
        print_json({"soak" if soak_hours is not None else "rows": [row._asdict() for row in rows]})
        return
    from rich.table import Table

    table = Table()
    for name in names:
        table.add_column(name)
    for row in rows:
        table.add_row(*(f"{value:.3f}" if isinstance(value, float) else str(value) for value in row))
    show_table(table)


PERIOD_NAMES = ("end", "busy", "periods", "missed", "work p50, ms", "p99.9", "of which CPU p50", "p99.9", "round trip")
SOAK_NAMES = ("end", "periods", "s", "MB at the end", "MB more an hour", "±", "blocks more an hour", "±")


def _soaked(hours: float, soft) -> "list[SoakRow]":
    from papilla.studies.telepresence.soak import soak
    from papilla.telepresence.texture import GratingTexture
    from papilla.telepresence.touch import Touch

    rows = []
    for side in ("sensor", "display"):
        with progress() as bar:
            bar.line(f"{side}: {hours:g} h of periods without waiting")
            rows.append(soak(side, hours, Touch(GratingTexture(1.2), soft=soft), progress=bar.steps))
    return rows
