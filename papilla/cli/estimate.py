"""`papilla estimate`: the estimators over a log, one row of answers per row of the log."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from papilla.cli.options import JsonOption, MapOption, argument, keep_inputs, option
from papilla.cli.output import ShownProgress, progress
from papilla.core.errors import InputError
from papilla.core.progress import CountedStep

if TYPE_CHECKING:
    import numpy as np

    from papilla.calibration import Calibration
    from papilla.estimators import Pipeline, PipelineEstimate
    from papilla.logs import TimeLogFile
    from papilla.view.log_picture import LogPicture

Softness = Literal["gauges", "sd", "force-depth", "compact", "quadratic", "printed", "surface"]
GAUGE_NOISE_FLOOR, FORCE_NOISE_FLOOR_N = 0.1, 1e-4
"""Smallest noise (microstrain, N) that is assumed: a computed log has none."""
DEPTH_COLUMN = "indentation_mm"
SILENT_ROWS = 100_000
"""Number of rows between two lines of progress."""
SWEEP_FILE = "sweep.csv"
"""Name of the table of presses in the folder of a calibration, which contains their depths."""


@dataclass(frozen=True)
class EstimatorOptions:
    """What is known of finger, specimen and surface."""

    finger: Path | None = option(None, "Design (TOML, or a name that ships) for its ridges; a calibration has them.")
    wavelength_range: tuple[float, float] | None = option(
        None,
        "Range of wavelengths (mm) to search; default: 0.4 to 6 for the rows, all for the summary.",
        metavar="LO HI",
    )
    saturation: float | None = option(None, "|reading| from which a gauge is saturated.")
    thickness: float | None = option(None, "Thickness (mm) of the touched specimen; unknown unless stated.")
    softness: Softness = option(
        "gauges",
        "The modulus from all gauges, from S_d alone, or from force and depth (column indentation_mm, counted from "
        "contact); or, for comparison, by a regression of S_d: the calibration's compact form, or the published "
        "quadratic, which does not fit presses, with the calibration's coefficients or the printed ones. surface is "
        "the old name of gauges.",
    )
    friction_memory: float | None = option(
        None, "Path (mm) that friction is averaged over; without it 0.1 s of sliding."
    )

    def check(self) -> None:
        """Raise `InputError` for options that exclude each other, or a range that does not rise."""
        from papilla.core import checks

        if self.softness not in ("gauges", "surface", "sd") and self.thickness is not None:
            raise InputError(f"--thickness is for the calibrated surfaces: --softness {self.softness} knows none")
        if self.wavelength_range is not None:
            checks.rising("--wavelength-range", self.wavelength_range)

    def pipeline(self, record: "Calibration | None", recorded: "TimeLogFile", noise: dict[str, Any]) -> "Pipeline":
        """The pipeline for a log; raises `InputError`."""
        from papilla.estimators import Doubts, Pipeline
        from papilla.model.finger import Finger

        chosen: dict[str, Any] = {
            "wavelength_range_mm": self.wavelength_range,
            "saturation": self.saturation,
            "friction_memory_mm": self.friction_memory,
            "softness": self.softness,
            "ridge_pitch_mm": Finger.load(self.finger).ridge_pitch_mm if self.finger else None,
            "doubts": None if self.thickness is None else Doubts(thickness_mm=self.thickness),
        }
        if self.softness == "force-depth":
            record = chosen["softness"] = None
        return Pipeline(
            record,
            gauges=recorded.gauge_names,
            columns=tuple(name for name in recorded.optional if name != DEPTH_COLUMN),
            sample_rate_Hz=recorded.sample_rate_Hz,
            **noise,
            **{name: value for name, value in chosen.items() if value is not None},
        )


def estimate(
    estimators: EstimatorOptions,
    log: Path = argument(
        ..., "Time log (CSV, TSV, .gz, Parquet, ROS bag, MCAP); - for standard input.", metavar="LOG.csv"
    ),
    out: Path = option(..., "Table of estimates to write (CSV or Parquet); - for standard output."),
    calibration: Path | None = option(None, "Calibration file (JSON); without it no modulus."),
    lever_mm: float | None = option(None, "Of a column torque_Nmm: from the torque's axis to the skin, mm."),
    log_map: MapOption = None,
    plot: Path | None = option(None, "Picture of log and estimates to write as well (PNG, SVG or PDF)."),
    html: Path | None = option(None, "Page with this picture and the summary to write as well (HTML)."),
    as_json: JsonOption = False,
) -> None:
    """Estimate softness, wavelength and friction row by row of a log, and list the spectral lines of the whole."""
    from papilla.calibration import Calibration
    from papilla.calibration.document import read_calibration
    from papilla.cli.estimate_summary import Summary, show, write_pictures
    from papilla.core.files import check_writable
    from papilla.estimators.pipeline import PipelineEstimate
    from papilla.logs.frames import estimates_writer

    summary_path = _check_files([log, calibration, estimators.finger, log_map], out, [plot, html], as_json)
    estimators.check()
    more = (DEPTH_COLUMN,) if estimators.softness == "force-depth" else ()
    # Not `Calibration.load`, which warns of a changed file: the pipeline's messages do.
    record = read_calibration(Calibration, calibration) if calibration else None
    covered = record and record.domain["force_N"][1]
    with (
        progress() as bar,
        _opened(log, bar, lever_mm=lever_mm, log_map=log_map, more=more, covered_N=covered) as recorded,
    ):
        if record:
            _check_gauges(record, calibration, recorded)
        noise, zeros = _noise(recorded), _zeros(record)
        pipeline = estimators.pipeline(record, recorded, noise)
        by_depth = DepthModulus(calibration, recorded, pipeline) if more else None
        summary = Summary(recorded, pipeline)
        picture = _picture(recorded, pipeline, plot) if plot or html else None
        if summary_path:
            check_writable(out.parent)
        with estimates_writer(out, ("t_s", *PipelineEstimate._fields)) as write:
            bar("estimating")
            for block in recorded.blocks():
                block[:, 1 : 1 + len(zeros)] -= zeros
                answer = pipeline.process(block[:, : len(pipeline.columns)])
                answer = by_depth.added(block, answer) if by_depth else answer
                write([block[:, 0], *answer[:-1], summary.add(block, answer)])
                if picture:
                    picture.add(block, answer)
                bar(CountedStep("estimating", summary.rows, max(summary.rows, recorded.report.rows)))
            summary.check()
        facts = summary.finish(estimators.wavelength_range)
    used = noise if "modulus" not in pipeline.off else dict.fromkeys(noise)
    names = {"gauge_sigma": "gauge_noise_microstrain", "force_sigma_N": "force_noise_N"}
    facts |= {names[name]: value for name, value in used.items()}
    facts |= {"log": str(log), "estimates": str(out), "summary": str(summary_path) if summary_path else None}
    if picture:
        write_pictures(facts, recorded.report.notes, picture, summary.spectrum, plot, html)
    show(facts, recorded.report.notes, as_json)


def _picture(recorded: "TimeLogFile", pipeline: "Pipeline", plot: Path | None) -> "LogPicture":
    """Collects the rows for a picture; raises `InputError` for an unknown kind of file."""
    from papilla.view.log_picture import LogPicture
    from papilla.view.style import kind_of

    if plot is not None:
        kind_of(plot)
    return LogPicture(recorded.gauge_names, recorded.optional, pipeline.off)


def _check_files(inputs: list[Path | None], out: Path, pictures: list[Path | None], as_json: bool) -> Path | None:
    """Refuse impossible outputs; returns the path of the summary, None if standard output has the estimates."""
    from papilla.core.files import sidecar
    from papilla.core.pipes import PIPE_NAME

    if out == PIPE_NAME and as_json:
        raise InputError("--out - and --json both want standard output: give one of them")
    summary_path = None if out == PIPE_NAME else sidecar(out, "summary.json")
    keep_inputs(inputs, [path for path in (summary_path and out, summary_path, *pictures) if path is not None])
    return summary_path


def _opened(log: Path, bar: ShownProgress, **how: Any) -> "TimeLogFile":
    from papilla.logs import TimeLogFile

    def reading(rows: int) -> None:
        if rows > SILENT_ROWS:
            bar(f"reading the log, {rows:,} rows")

    return TimeLogFile(log, reading, **how)


def _check_gauges(record: "Calibration", path: Path | None, recorded: "TimeLogFile") -> None:
    """Raise `InputError` for a calibration of other gauges than the log has."""
    from papilla.logs.log_map import GAUGE_COLUMN

    recorded_names, made_for = recorded.gauge_names, tuple(gauge.name for gauge in record.gauges)
    if len(made_for) != len(recorded_names):
        raise InputError(
            f"{recorded.path} has {len(recorded_names)} gauges, the calibration {path} was made for {len(made_for)}"
        )
    # A design may use any names for its gauges; names with numbers like those of a log must agree with the log's.
    if made_for != recorded_names and all(GAUGE_COLUMN.fullmatch(name) for name in made_for):
        raise InputError(
            f"{recorded.path} is of {', '.join(recorded_names)}, "
            f"the calibration {path} was made for {', '.join(made_for)}"
        )


def _zeros(record: "Calibration | None") -> "np.ndarray":
    """Readings of the gauges in the air (microstrain), if the calibration is of a finger whose bench measured them."""
    import numpy as np

    zeros = None if record is None else record.finger.get("zeros_microstrain")
    if record is None or zeros is None:
        return np.zeros(0)
    numbers = isinstance(zeros, list) and all(type(value) in (int, float) for value in zeros)
    if not numbers or len(zeros) != len(record.gauges):
        raise InputError(f"the calibration's finger.zeros_microstrain must hold {len(record.gauges)} numbers")
    return np.array(zeros, float)


def _noise(recorded: "TimeLogFile") -> dict[str, Any]:
    """Noise of the worst gauge and of the force, from the log."""
    gauges = [recorded.noise[name] for name in recorded.gauge_names]
    force = recorded.noise.get("force_N", float("nan"))
    return {
        "gauge_sigma": max([*(noise for noise in gauges if noise == noise), GAUGE_NOISE_FLOOR]),
        "force_sigma_N": max(force, FORCE_NOISE_FLOOR_N) if force == force else FORCE_NOISE_FLOOR_N,
    }


class DepthModulus:
    """Fills the columns of the modulus, and tells the pipeline, which does not compute them, that they exist.

    calibration : its file, with `SWEEP_FILE` in the same folder. Raises `InputError` without a calibration, and for a
    log without a force."""

    def __init__(self, calibration: Path | None, recorded: "TimeLogFile", pipeline: "Pipeline"):
        from papilla.estimators.methods import depth_method
        from papilla.logs import read_presses

        if calibration is None or "force_N" not in recorded.optional:
            raise InputError(
                f"--softness force-depth needs --calibration with its {SWEEP_FILE}, and force_N in the log"
            )
        sweep = read_presses(calibration.with_name(SWEEP_FILE))
        if sweep.indentation_mm is None:
            raise InputError(f"{calibration.with_name(SWEEP_FILE)} has no column indentation_mm")
        self._model = depth_method("force-depth", sweep.force_N, sweep.modulus_MPa, sweep.indentation_mm)
        self._errors = self._model.errors_of(recorded.noise["indentation_mm"], recorded.noise["force_N"])
        names = ("t_s", *recorded.gauge_names, *recorded.optional)
        self._force, self._depth = names.index("force_N"), names.index("indentation_mm")
        self._legend = pipeline.legend["modulus"]
        del pipeline.off["modulus"]

    def added(self, block: "np.ndarray", answer: "PipelineEstimate") -> "PipelineEstimate":
        """The answers (n, columns) with the modulus of each row."""
        modulus, sigma, statuses = self._model.process(block[:, self._force], block[:, self._depth], self._errors)
        self._legend.pop("", None)
        self._legend.update({status.code: status.sentence for status in {*statuses}})
        codes = [status.code for status in statuses]
        return answer._replace(modulus_MPa=modulus, modulus_sigma_MPa=sigma, modulus_status=codes)
