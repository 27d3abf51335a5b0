"""`papilla identify` on a log over time: loading alone, the loops, and how the silicone relaxes."""

from pathlib import Path
from typing import TYPE_CHECKING

from papilla.cli.output import print_table, tell
from papilla.errors import InputError

if TYPE_CHECKING:
    from papilla.calibrate.identification import Identification
    from papilla.logs import PressLog


def loops_of(log: "PressLog") -> dict:
    """The loops of a log as plain values; nothing where there are none."""
    return {"loops": [vars(one) for one in log.loops]} if log.loops else {}


def relaxation_of(path: Path, found: "Identification", terms: str | None, log_map: Path | None) -> tuple[dict, dict]:
    """The Prony terms of the longest touch of a log, by the identified finger, as plain values, and what its table
    `[identified]` keeps of them; nothing where none are asked for. By its indentations where there are any, else by
    S_d."""
    import numpy as np

    from papilla.calibrate.relaxation import crept, fit_relaxation
    from papilla.logs import read_presses
    from papilla.logs.loading import touches

    if terms is None:
        return {}, {}
    if found.problem.log.stated_sd is not None or len(found.problem.log.specimens) > 1:
        raise InputError(f"{path}: --relaxation needs readings, of presses on one specimen")
    log = read_presses(path, whole=True, mixed=found.problem.shapes[0].specimen, log_map=log_map)
    time = log.t_s
    assert time is not None, "identify refuses"
    rows = max(touches(log.modulus_MPa), key=lambda one: float(np.ptp(time[one])))
    problem, values = found.problem, found.values
    layers = values["outer_modulus_MPa"], values["inner_modulus_MPa"]
    gauges = [gauge.name for gauge in problem.finger.gauges]
    mix = np.array([[values[f"{name}.{one}"] for one in gauges] for name in ("gain", "lever_mm")])
    zeros = np.array([values[f"zero_microstrain.{one}"] for one in gauges])
    response, modulus = problem.shapes[0].responses[0], float(log.modulus_MPa[rows[0]])

    def elastic(force: np.ndarray) -> np.ndarray:
        felt = response.felt(force, np.full(len(force), modulus), *layers)
        return felt.indentation if deep else np.einsum("nqg,qg->ng", felt.values, mix).std(axis=1)

    deep = log.indentation_mm is not None
    seen = log.indentation_mm if log.indentation_mm is not None else (log.readings - zeros).std(axis=1)
    fitted = fit_relaxation(time[rows], log.force_N[rows], seen[rows], terms=int(terms), elastic=elastic)
    shares, times = fitted.prony.shares, fitted.prony.times_s
    kept = {"relaxation_shares": shares, "relaxation_times_s": times, "crept": crept(fitted.prony, log)}
    summary = {
        "relaxation": {
            "modulus_MPa": modulus,
            "by": "indentation" if deep else "S_d",
            "terms": [
                {"share": share, "share_sigma": one, "time_s": time, "time_relative_sigma": other}
                for share, one, time, other in zip(
                    fitted.prony.shares, fitted.share_sigma, fitted.prony.times_s, fitted.time_sigma, strict=True
                )
            ],
            "rms": fitted.rms,
            "loading_rate_per_s": list(fitted.rate_per_s),
            "crept": list(kept["crept"]),
            "doubts": list(fitted.doubts),
        }
    }
    return summary, kept


def print_relaxation(summary: dict) -> None:
    """Show the relaxation of a summary."""
    if "relaxation" not in summary:
        return
    fitted = summary["relaxation"]
    tell(f"Relaxation of the silicone, one factor for both layers, by {fitted['by']} on {fitted['modulus_MPa']:g} MPa:")
    print_table(
        [
            (f"term {number}", f"{one['share']:.3g} ± {one['share_sigma']:.2g} at {one['time_s']:.3g}", "s")
            for number, one in enumerate(fitted["terms"], start=1)
        ]
    )
    for doubt in fitted["doubts"]:
        tell(f"Doubt: {doubt}.")
