"""`papilla estimate`: the estimators over a log, one row of answers per row of the log."""

from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from papilla.cli.output import print_json, print_table, say
from papilla.errors import InputError

if TYPE_CHECKING:
    from papilla.calibration import Calibration
    from papilla.logs import TimeLog

UNANSWERED = ("frequency_Hz", "wavelength_mm", "wavelength_sigma_mm", "mu_kinetic", "mu_static")
"""Documented columns that no estimator of this version fills; they stay empty."""

GAUGE_NOISE_FLOOR, FORCE_NOISE_FLOOR_N = 0.1, 1e-4
"""Noise (microstrain, N) that is assumed where a log shows less: a computed log has none."""


def estimate(
    log: Annotated[Path, typer.Argument(help="Time log (CSV): t_s, g1, ..., force_N.", metavar="LOG.csv")],
    out: Annotated[Path, typer.Option(help="Table of estimates to write (CSV).")],
    calibration: Annotated[Path | None, typer.Option(help="Calibration file (JSON); without it no modulus.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Estimate the softness of what the finger touches, row by row of a log."""
    from papilla.files import check_writable
    from papilla.logs import read_time_log
    from papilla.tables import write_table

    recorded = read_time_log(log)
    record = _load(calibration, recorded, log) if calibration else None
    check_writable(out.parent)
    columns, settings = _softness(recorded, record)
    empty = [float("nan")] * len(recorded)
    status = columns.pop("status")
    write_table(out, {"t_s": recorded.t_s, **columns, **dict.fromkeys(UNANSWERED, empty), "status": status})

    summary = _summary(recorded, columns, status) | settings | {"estimates": str(out)}
    for message in summary["messages"]:
        say(message)
    if as_json:
        print_json(summary)
    else:
        _print(summary)


def _load(path: Path, recorded: "TimeLog", log: Path) -> "Calibration":
    """The calibration, of as many gauges as the log has."""
    from papilla.calibration import Calibration

    record = Calibration.load(path)
    if len(record.gauges) != len(recorded.gauge_names):
        count = len(recorded.gauge_names)
        raise InputError(f"{log} has {count} gauges, the calibration {path} was made for {len(record.gauges)}")
    return record


def _softness(recorded: "TimeLog", record: "Calibration | None") -> tuple[dict, dict]:
    """Columns of modulus, sigma and status; and the noise that was assumed."""
    if record is None or recorded.force_N is None:
        missing = "the log has no column force_N" if recorded.force_N is None else "no calibration was given"
        nothing = [float("nan")] * len(recorded)
        status = [f"no modulus: {missing}"] * len(recorded)
        silent = {"gauge_noise_microstrain": None, "force_noise_N": None}
        return {"modulus_MPa": nothing, "modulus_sigma_MPa": nothing, "status": status}, silent

    import numpy as np

    from papilla.estimators import Softness
    from papilla.logs import white_noise

    gauge_noise = max([white_noise(readings) for readings in recorded.readings.T] + [GAUGE_NOISE_FLOOR])
    force_noise = max(white_noise(recorded.force_N), FORCE_NOISE_FLOOR_N)
    estimator = Softness(
        record, gauge_sigma=gauge_noise, force_sigma_N=force_noise, sample_rate_Hz=recorded.sample_rate_Hz
    )
    answer = estimator.process(np.column_stack([recorded.readings, recorded.force_N]))
    columns = {
        "modulus_MPa": answer.modulus_MPa,
        "modulus_sigma_MPa": answer.modulus_sigma_MPa,
        "status": answer.sentence,
    }
    return columns, {"gauge_noise_microstrain": gauge_noise, "force_noise_N": force_noise}


def _summary(recorded: "TimeLog", columns: dict, status: list[str]) -> dict:
    report = recorded.report
    messages = [f"not estimated by this version: {', '.join(UNANSWERED)}"]
    messages += [f"ignored columns: {', '.join(report.ignored)}"] if report.ignored else []
    answered = [row for row, value in enumerate(columns["modulus_MPa"]) if value == value]
    last = answered[-1] if answered else None
    return {
        "rows": report.rows,
        "answered_rows": len(answered),
        "status": dict(Counter(status).most_common()),
        "last_answer": None
        if last is None
        else {
            "t_s": float(recorded.t_s[last]),
            "modulus_MPa": float(columns["modulus_MPa"][last]),
            "modulus_sigma_MPa": float(columns["modulus_sigma_MPa"][last]),
        },
        "nan_rows": report.nan_rows,
        "nan_cells": report.nan_cells,
        "gaps": report.gaps,
        "duplicates": report.duplicates,
        "sample_rate_Hz": recorded.sample_rate_Hz,
        "messages": messages,
    }


def _print(summary: dict) -> None:
    last = summary["last_answer"]
    rows = [
        ("rows", str(summary["rows"]), ""),
        *((status, str(count), "rows") for status, count in summary["status"].items()),
        ("rows without a number in a cell", str(summary["nan_rows"]), ""),
        ("gaps", str(summary["gaps"]), ""),
        ("repeated times", str(summary["duplicates"]), ""),
        ("sampling rate", f"{summary['sample_rate_Hz']:.5g}", "Hz"),
    ]
    if summary["force_noise_N"] is not None:
        rows += [
            ("noise of a gauge", f"{summary['gauge_noise_microstrain']:.3g}", "µε"),
            ("noise of the force", f"{summary['force_noise_N']:.2g}", "N"),
        ]
    if last is not None:
        found = f"{last['modulus_MPa']:.4g} ± {last['modulus_sigma_MPa']:.2g}"
        rows.append((f"modulus at {last['t_s']:.4g} s", found, "MPa"))
    print_table(rows)
    print("Wrote", summary["estimates"])
