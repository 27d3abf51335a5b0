"""`papilla estimate`: the estimators over a log, one row of answers per row of the log."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from papilla.cli.output import print_json, progress, say
from papilla.errors import InputError

if TYPE_CHECKING:
    from papilla.calibration import Calibration
    from papilla.estimators import Pipeline
    from papilla.logs import TimeLog

GAUGE_NOISE_FLOOR, FORCE_NOISE_FLOOR_N = 0.1, 1e-4
"""Noise (microstrain, N) that is assumed where a log shows less: a computed log has none."""
BLOCK = 2000
"""Rows between two steps of the progress bar."""


def estimate(
    log: Annotated[Path, typer.Argument(help="Time log (CSV): t_s, g1, ..., force_N, ...", metavar="LOG.csv")],
    out: Annotated[Path, typer.Option(help="Table of estimates to write (CSV).")],
    calibration: Annotated[Path | None, typer.Option(help="Calibration file (JSON); without it no modulus.")] = None,
    wavelength_range: Annotated[
        tuple[float, float] | None,
        typer.Option(
            metavar="LO HI",
            help="Wavelengths (mm) that are looked for; without it 0.4 to 6 row by row, and in the summary all.",
        ),
    ] = None,
    saturation: Annotated[float | None, typer.Option(help="|reading| from which a gauge is saturated.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Estimate softness, wavelength and friction row by row of a log, and list the spectral lines of the whole."""
    from papilla.cli.estimate_output import print_summary, summary_of
    from papilla.files import check_writable
    from papilla.logs import read_time_log
    from papilla.tables import write_table

    wavelengths = _checked_range(wavelength_range)
    recorded = read_time_log(log)
    record = _load(calibration, recorded, log) if calibration else None
    noise = _noise(recorded)
    pipeline = _pipeline(recorded, record, noise, wavelengths, saturation)
    check_writable(out.parent)
    columns = _run(pipeline, recorded)
    write_table(out, {"t_s": recorded.t_s, **columns})

    summary = summary_of(recorded, columns, pipeline.messages, wavelengths)
    used = noise if "modulus" not in pipeline.off else dict.fromkeys(noise)
    names = {"gauge_sigma": "gauge_noise_microstrain", "force_sigma_N": "force_noise_N"}
    summary |= {names[name]: value for name, value in used.items()} | {"estimates": str(out)}
    for message in summary["messages"]:
        say(message)
    if as_json:
        print_json(summary)
    else:
        print_summary(summary)


def _checked_range(wavelength_range: tuple[float, float] | None) -> tuple[float, float] | None:
    from papilla import checks

    if wavelength_range is None:
        return None
    low, high = (checks.positive("--wavelength-range (mm)", value) for value in wavelength_range)
    if low >= high:
        raise InputError(f"--wavelength-range must rise from LO to HI, got {low:g} and {high:g} mm")
    return low, high


def _load(path: Path, recorded: "TimeLog", log: Path) -> "Calibration":
    """The calibration, of as many gauges as the log has."""
    from papilla.calibration import Calibration

    record = Calibration.load(path)
    if len(record.gauges) != len(recorded.gauge_names):
        count = len(recorded.gauge_names)
        raise InputError(f"{log} has {count} gauges, the calibration {path} was made for {len(record.gauges)}")
    return record


def _noise(recorded: "TimeLog") -> dict[str, float | None]:
    """Noise of the worst gauge and of the force, as the log shows it."""
    from papilla.logs import white_noise

    gauges = [noise for noise in map(white_noise, recorded.readings.T) if noise == noise]
    force = float("nan") if recorded.force_N is None else white_noise(recorded.force_N)
    return {
        "gauge_sigma": max([*gauges, GAUGE_NOISE_FLOOR]),
        "force_sigma_N": max(force, FORCE_NOISE_FLOOR_N) if force == force else FORCE_NOISE_FLOOR_N,
    }


def _pipeline(recorded: "TimeLog", record, noise, wavelengths, saturation) -> "Pipeline":
    from papilla.estimators import Pipeline
    from papilla.logs import TIME_OPTIONAL

    options = {} if wavelengths is None else {"wavelength_range_mm": wavelengths}
    if saturation is not None:
        options["saturation"] = saturation
    return Pipeline(
        record,
        gauges=recorded.gauge_names,
        columns=tuple(name for name in TIME_OPTIONAL if getattr(recorded, name) is not None),
        sample_rate_Hz=recorded.sample_rate_Hz,
        **noise,
        **options,
    )


def _first_stage(pipeline: "Pipeline", rate_Hz: float) -> str:
    """What the first block waits for: where the trackers are not compiled yet, that takes far longer than the rows."""
    from papilla.estimators.pipeline.parts import TRACKER_RATE_HZ
    from papilla.estimators.tracking import blind_kernel, compiled, tracker_kernel

    kernels = blind_kernel.COMPILED if "wavelength" in pipeline.off else tracker_kernel.KERNELS
    if rate_Hz < TRACKER_RATE_HZ or not compiled.numba_available() or compiled.kernel_cache(kernels).exists():
        return "estimating"
    return "compiling the trackers; this is kept for the next time"


def _run(pipeline: "Pipeline", recorded: "TimeLog") -> dict:
    """The columns of the pipeline's answers to the whole log."""
    import numpy as np

    given = pipeline.columns[1 + len(recorded.gauge_names) :]
    table = np.column_stack([recorded.t_s, recorded.readings, *(getattr(recorded, name) for name in given)])
    answers = []
    with progress() as bar:
        bar.line(_first_stage(pipeline, recorded.sample_rate_Hz))
        for begin in range(0, len(table), BLOCK):
            answers.append(pipeline.process(table[begin : begin + BLOCK]))
            bar.line("estimating")
            bar.steps(min(begin + BLOCK, len(table)), len(table))
    names = answers[0]._fields
    columns = {name: np.concatenate([getattr(answer, name) for answer in answers]) for name in names[:-1]}
    return columns | {"status": [sentence for answer in answers for sentence in answer.status]}
