"""`papilla identify --suggest`: proposes the next presses, after a log or for a finger of which only the design is
known."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from papilla.checks import positive
from papilla.cli.options import number, option
from papilla.cli.output import print_table, progress, tell
from papilla.errors import InputError
from papilla.units import PER_CENT

if TYPE_CHECKING:
    from papilla.calibrate.identification import Identification, Noise
    from papilla.calibrate.suggest import Suggestion
    from papilla.finger import Finger
    from papilla.specimen import Specimen


@dataclass(frozen=True)
class SuggestOptions:
    """Number and kind of the suggested presses."""

    suggest: int | None = option(None, "Suggest the next N presses; without a log, all of them.", metavar="N")
    moduli: str | None = option(
        None, "Moduli of the specimens at hand, MPa.  [default: those of the log]", metavar="E,E,..."
    )
    places: str | None = option(
        None,
        "Where presses may be suggested, mm: '0,0 3,0 0,3'.  [default: the apex]",
        metavar="'X,Y X,Y ...'",
    )
    criterion: Literal["I", "D"] = option("I", "Suggest for the least variance of E (I) or of the parameters (D).")

    def check(self, log: Path | None, **fit: object) -> None:
        """Refuse unusable options and combinations: options `fit` of a fit without a log, and a fit whose result is not
        written; raises `InputError`."""
        self.read_moduli(), self.read_places()
        if log is None and self.suggest is None:
            raise InputError("Missing argument 'LOG.csv': only --suggest, a protocol without a log, needs none")
        if log is None and (asked := [name for name, value in fit.items() if value is not None]):
            raise InputError(f"--{asked[0]} needs a log of presses: a protocol without a log has no fit")
        if self.suggest is not None:
            if self.suggest < 1:
                raise InputError(f"--suggest must be at least 1, got {self.suggest}")
            return
        if fit["out"] is None:
            raise InputError("Missing option '--out': the design file of the identified finger")
        for name in ("moduli", "places"):
            if getattr(self, name) is not None:
                raise InputError(f"--{name} goes with --suggest")

    def read_moduli(self) -> list[float]:
        """The moduli (MPa), empty if not given; raises `InputError`."""
        texts = [] if self.moduli is None else self.moduli.split(",")
        return [positive("--moduli (MPa)", number("--moduli must be numbers in MPa", text)) for text in texts]

    def read_places(self) -> list[tuple[float, float]]:
        """The places (x, y in mm), the apex if not given; raises `InputError`."""
        what, found = "--places must be pairs x,y in mm with spaces between", []
        for text in ("0,0" if self.places is None else self.places).split():
            x, comma, y = text.partition(",")
            if not comma:
                raise InputError(f"{what}, got {text!r}")
            found.append((number(what, x), number(what, y)))
        return found

    def protocol(self, design: "Finger", specimen: "Specimen", noise: "Noise") -> dict:
        """The first presses for a finger of which only the design is known, as plain values."""
        moduli = self.read_moduli()
        if not moduli:
            raise InputError("a protocol without a log needs --moduli: those of the available specimens, in MPa")
        with progress() as shown:
            shown.line("what each press would tell")
            return {"finger": design.name, **self._found(design, moduli, specimen=specimen, noise=noise)}

    def after(self, found: "Identification") -> dict:
        """The most informative presses after those of an identification, on its specimens unless others are given, as
        plain values; empty if none are requested."""
        moduli = self.read_moduli() or sorted({float(one) for one in found.problem.log.modulus_MPa})
        return {} if self.suggest is None else self._found(found, moduli)

    def _found(self, known: "Finger | Identification", moduli: list[float], **bench: Any) -> dict:
        from papilla.calibrate.suggest import suggest_presses

        places: Any = self.read_places()
        return suggested(
            suggest_presses(known, self.suggest or 1, moduli, places=places, criterion=self.criterion, **bench)
        )


def suggested(found: "Suggestion") -> dict:
    """A suggestion as plain values."""
    presses = zip(found.force_N, found.modulus_MPa, found.place_mm, strict=True)
    return {
        "suggested": [{"force_N": f, "modulus_MPa": e, "x_mm": x, "y_mm": y} for f, e, (x, y) in presses],
        "criterion": found.criterion,
        "expected_sigma_ln_E": {"before": found.sigma_before, "after": found.sigma_after},
    }


def print_suggestion(summary: dict) -> None:
    """Print the suggestion of a summary, the most informative press first."""
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
        f"The uncertainty of the finger then makes E uncertain by {_factor(sigma['after'])} over 20-100 gf and "
        f"0.05-0.72 MPa, now {_factor(sigma['before'])}."
    )


def _factor(sigma: float) -> str:
    return f"{PER_CENT * sigma:.2g} %" if sigma < 1 else "more than a factor of two"
