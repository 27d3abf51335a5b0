"""`papilla bench --physics`: effects on a bench that the calibration does not contain, as a table or JSON."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from papilla.cli.output import Answer, progress, show_rows, tell
from papilla.units import PER_CENT

if TYPE_CHECKING:
    from papilla.studies.physics import Effect

SHORT_MM = 2.0
"""Element size of --short; light presses are inaccurate on it."""


def bench_physics(finger: Path | None, short: bool) -> Answer:
    """Press with and without each effect, and show the change of S_d and of the modulus that follows from it."""
    from papilla.finger import Finger
    from papilla.mesh import DEFAULT_SIZE_MM
    from papilla.studies.physics import FORCES_GF, MODULI_MPA, physics

    design = Finger.load(finger or "default")
    with progress() as shown:
        found = physics(design, SHORT_MM if short else DEFAULT_SIZE_MM, shown.line)
    facts = {"finger": design.name, "forces_gf": list(FORCES_GF), "moduli_MPa": list(MODULI_MPA)}
    return Answer(facts | {"effects": [effect.to_json() for effect in found]}, partial(_print, found))


def _print(found: "Sequence[Effect]") -> None:
    """Print a row for each effect, with its changes at all forces."""
    from papilla.studies.physics import FORCES_GF, MODELLED, MODULI_MPA

    rows = []
    for effect in found:
        by = effect.modelled_by or ("not modelled" if effect.worst >= MODELLED else "below 1 %")
        changes = [_changes(ratios[:, j]) for ratios in (effect.sd_ratio, effect.modulus_ratio) for j in (0, 1)]
        rows.append([f"{effect.name}: {effect.size}", by, *changes])
    heads = [f"{quantity}, {modulus:g} MPa" for quantity in ("S_d", "E") for modulus in MODULI_MPA]
    loads = ", ".join(f"{gf:g}" for gf in FORCES_GF)
    show_rows(["effect", "modelled by", *heads], rows, f"change in %, at {loads} gf; worst first")
    tell("E: what is read from S_d by presses without the effect; - where the press or the modulus is out of range")


def _changes(ratios) -> str:
    return "  ".join("-" if ratio != ratio else f"{PER_CENT * (ratio - 1):+.1f}" for ratio in ratios)
