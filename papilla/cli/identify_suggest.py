"""`papilla identify --suggest`: what to press next, after a log or for a finger of which nothing is known."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from papilla.checks import positive
from papilla.cli.output import print_json, print_table, progress, tell
from papilla.errors import InputError

if TYPE_CHECKING:
    from papilla.calibrate.identification import Identification, Noise
    from papilla.calibrate.suggest import Suggestion
    from papilla.finger import Finger
    from papilla.specimen import Specimen

SuggestOption = Annotated[
    int | None, typer.Option(help="Suggest the next N presses; without a log, all of them.", metavar="N")
]
ModuliOption = Annotated[
    str | None,
    typer.Option(help="Moduli of the specimens that are there, MPa.  [default: those of the log]", metavar="E,E,..."),
]
PlacesOption = Annotated[
    str | None,
    typer.Option(
        help="Where presses may be suggested: pairs x,y in mm, such as '0,0 3,0 0,3'.  [default: the apex]",
        metavar="'X,Y X,Y ...'",
    ),
]
CriterionOption = Annotated[
    Literal["I", "D"], typer.Option(help="Suggest for the least variance of E (I) or of the parameters (D).")
]


def read_moduli(text: str | None) -> list[float]:
    """The moduli (MPa) of the option's text, none where it is not given; raises `InputError`."""
    found = []
    for part in (text or "").split(",") if text is not None else []:
        try:
            found.append(positive("--moduli (MPa)", float(part)))
        except ValueError as error:
            said = str(error) if isinstance(error, InputError) else f"--moduli must be numbers in MPa, got {part!r}"
            raise InputError(said) from error
    return found


def read_places(text: str | None) -> list[tuple[float, float]]:
    """The places (x, y in mm) of the option's text, the apex where it is not given; raises `InputError`."""
    found = []
    for part in (text if text is not None else "0,0").split():
        try:
            x, y = map(float, part.split(","))
        except ValueError as error:
            raise InputError(f"--places must be pairs x,y in mm with spaces between, got {part!r}") from error
        found.append((x, y))
    return found


def refuse_unfit(
    log: Path | None, suggest: int | None, moduli: str | None, places: str | None, **given: object
) -> None:
    """Refuse options that do not go together: those of a fit without a log, a fit of which nothing is kept."""
    if log is None and suggest is None:
        raise InputError("Missing argument 'LOG.csv': only --suggest, a protocol from nothing, needs none")
    if log is None and (asked := [name for name, value in given.items() if value is not None]):
        raise InputError(f"--{asked[0]} needs a log of presses: a protocol from nothing fits nothing")
    if suggest is not None and suggest < 1:
        raise InputError(f"--suggest must be at least 1, got {suggest}")
    if suggest is None and given["out"] is None:
        raise InputError("Missing option '--out': the design file of the identified finger")
    for name, text in (("moduli", moduli), ("places", places)):
        if suggest is None and text is not None:
            raise InputError(f"--{name} goes with --suggest")


def print_protocol(
    design: "Finger",
    count: int,
    moduli: list[float],
    places: list[tuple[float, float]],
    specimen: "Specimen",
    noise: "Noise",
    criterion,
    as_json: bool,
) -> None:
    """Suggest presses for a finger of which nothing is known but its design."""
    from papilla.calibrate.suggest import suggest

    if not moduli:
        raise InputError("a protocol from nothing needs --moduli: those of the specimens that are there, in MPa")
    with progress() as shown:
        shown.line("what each press would tell")
        found = suggest(design, count, moduli, places=places, specimen=specimen, criterion=criterion, noise=noise)
    summary = {"finger": design.name, **suggested(found)}
    if as_json:
        print_json(summary)
    else:
        print_suggestion(summary)


def after(
    found: "Identification", count: int | None, moduli: list[float], places: list[tuple[float, float]], criterion
) -> dict:
    """The presses that tell most after those of an identification, on its specimens unless others are there, as plain
    values; nothing where none are asked for."""
    from papilla.calibrate.suggest import suggest

    if count is None:
        return {}
    there = moduli or sorted({float(one) for one in found.problem.log.modulus_MPa})
    return suggested(suggest(found, count, there, places=places, criterion=criterion))


def suggested(found: "Suggestion") -> dict:
    """A suggestion as plain values."""
    presses = zip(found.force_N, found.modulus_MPa, found.place_mm, strict=True)
    return {
        "suggested": [{"force_N": f, "modulus_MPa": e, "x_mm": x, "y_mm": y} for f, e, (x, y) in presses],
        "criterion": found.criterion,
        "expected_sigma_ln_E": {"before": found.sigma_before, "after": found.sigma_after},
    }


def print_suggestion(summary: dict) -> None:
    """Show what a summary suggests, the most telling press first."""
    if "suggested" not in summary:
        return
    at_apex = not any(one["x_mm"] or one["y_mm"] for one in summary["suggested"])
    tell(f"Press next{', at the apex' if at_apex else ''}:")
    print_table(
        [
            (
                f"press {number}",
                f"{one['force_N']:.3g} N on {one['modulus_MPa']:g}",
                "MPa" if at_apex else f"MPa at {one['x_mm']:g}, {one['y_mm']:g} mm",
            )
            for number, one in enumerate(summary["suggested"], start=1)
        ]
    )
    sigma = summary["expected_sigma_ln_E"]
    tell(
        f"What is not known of the finger then leaves E uncertain by {_factor(sigma['after'])} over 20-100 gf and "
        f"0.05-0.72 MPa, now {_factor(sigma['before'])}."
    )


def _factor(sigma: float) -> str:
    return f"{100 * sigma:.2g} %" if sigma < 1 else "more than a factor of two"
