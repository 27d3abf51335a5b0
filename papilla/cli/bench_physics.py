"""`papilla bench --physics`: what a bench has and the calibration does not know, as a table or JSON."""

from pathlib import Path

from papilla.cli.output import print_json, progress, show_table, tell

SHORT_MM = 2.0
"""Element size of --short: light presses are rough on it."""


def bench_physics(finger: Path | None, short: bool, as_json: bool) -> None:
    """Press with each effect and without, and show what that does to S_d and to the modulus read from it."""
    from rich.table import Table

    from papilla.finger import Finger
    from papilla.mesh import DEFAULT_SIZE_MM
    from papilla.studies.physics import FORCES_GF, MODELLED, MODULI_MPA, physics

    design = Finger.load(finger or "default")
    with progress() as shown:
        found = physics(design, SHORT_MM if short else DEFAULT_SIZE_MM, shown.line)
    if as_json:
        print_json(
            {
                "finger": design.name,
                "forces_gf": list(FORCES_GF),
                "moduli_MPa": list(MODULI_MPA),
                "effects": [effect.to_json() for effect in found],
            }
        )
        return
    loads = ", ".join(f"{gf:g}" for gf in FORCES_GF)
    table = Table(title=f"change in %, at {loads} gf; worst first")
    table.add_column("effect", min_width=28)
    table.add_column("modelled by", min_width=16)
    for quantity in ("S_d", "E"):
        for modulus in MODULI_MPA:
            table.add_column(f"{quantity}, {modulus:g} MPa", justify="right", no_wrap=True)
    for effect in found:
        cells = [_changes(ratios[:, j]) for ratios in (effect.sd_ratio, effect.modulus_ratio) for j in (0, 1)]
        by = effect.modelled_by or ("not modelled" if effect.worst >= MODELLED else "below 1 %")
        table.add_row(f"{effect.name}: {effect.size}", by, *cells)
    show_table(table)
    tell("E: what is read from S_d by presses without the effect; - where the press or the modulus is out of range")


def _changes(ratios) -> str:
    return "  ".join("-" if ratio != ratio else f"{100 * (ratio - 1):+.1f}" for ratio in ratios)
