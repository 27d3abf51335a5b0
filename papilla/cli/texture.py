"""`papilla texture train | classify`: recognises textures over the path, at any speed."""

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from papilla.cli.options import MapOption, argument, keep_inputs, option
from papilla.cli.output import CommandResult, print_table, tell
from papilla.core.errors import InputError

if TYPE_CHECKING:
    import numpy as np


def train(
    logs: list[str] = argument(..., "Logs and what they are of.", metavar="LABEL=LOG.csv ..."),
    out: Path = option(..., "Model file to write (JSON)."),
    window: float = option(100.0, "Path (mm) that one answer takes."),
    wavelengths: tuple[float, float] = option((1.0, 50.0), "Wavelengths (mm) that count.", metavar="LO HI"),
    bands: int = option(8, "Bands of wavelength."),
    log_map: MapOption = None,
) -> CommandResult:
    """Train on logs with velocity or position, at least two for each label: at two speeds, or two repetitions."""
    from papilla.estimators.texture import Features, train

    named = [_named(text) for text in logs]
    keep_inputs([log_map, *(path for _, path in named)], [out])
    how = Features(window_mm=window, shortest_mm=wavelengths[0], longest_mm=wavelengths[1], bands=bands)
    runs = [(label, *_run(path, log_map)) for label, path in named]
    groups, left_out = _groups([(label, speed) for label, speed, *_ in runs])
    model = train([(run[0], group, *run[2:]) for run, group in zip(runs, groups, strict=True)], features=how)
    model.save(out)
    facts = {"model": str(out), "labels": list(model.labels), "left_out": left_out, "accuracy": model.accuracy}

    def show() -> None:
        shares = model.accuracy.items()
        print_table([(f"{name}, {left_out} left out", f"{share:.3f}", "right") for name, share in shares])
        tell(f"Wrote {out}")

    return CommandResult(facts, show)


def classify(
    log: Path = argument(..., "Log with velocity or position.", metavar="LOG.csv"),
    model: Path = option(..., "Model file of `papilla texture train`."),
    log_map: MapOption = None,
) -> CommandResult:
    """Classify a log, window by window and as a whole; "unknown" if it resembles no training texture."""
    from papilla.estimators.texture import TextureModel

    texture_model = TextureModel.load(model)
    labels, distances = texture_model.classify(*_run(log, log_map)[1:])
    most = max(sorted(set(labels)), key=labels.count)
    facts = {"label": most, "share": labels.count(most) / len(labels), "windows": labels}
    facts |= {"squared_distance": distances.min(axis=1).tolist(), "limit": texture_model.limit}
    rows = [("texture", most, ""), ("share of windows", f"{facts['share']:.2f}", f"of {len(labels)}")]
    return CommandResult(facts, partial(print_table, rows))


def _named(text: str) -> tuple[str, Path]:
    label, _, path = text.partition("=")
    if not (label and path):
        raise InputError(f"logs must be LABEL=LOG.csv, got {text!r}")
    return label, Path(path)


def _run(path: Path, log_map: Path | None) -> tuple[float, "np.ndarray", "np.ndarray"]:
    """Median speed in mm/s, position (n,) and readings (n, channels) of a log."""
    import numpy as np

    from papilla.estimators.wavelength.lines import travelled
    from papilla.logs import read_time_log

    log = read_time_log(path, log_map=log_map)
    place = log.position_mm
    if place is None and log.velocity_mm_s is not None:
        place = travelled(log.t_s, np.nan_to_num(log.velocity_mm_s))
    if place is None or not log.gauge_names:
        raise InputError(f"{path}: textures need gauges, and position_mm or velocity_mm_s")
    with np.errstate(divide="ignore", invalid="ignore"):
        speeds = np.abs(np.diff(place) / np.diff(log.t_s))
    speeds = speeds[np.isfinite(speeds) & (speeds > 0)]
    if not len(speeds):
        raise InputError(f"{path}: the finger does not move")
    return float(np.median(speeds)), place, log.readings


def _groups(runs: list[tuple[str, float]]) -> tuple[list[str], str]:
    """Groups that are left out in turn: a speed (within a tenth) if every label has two speeds, else a repetition."""
    import math

    speeds = [f"{math.exp(round(math.log(speed) / 0.2) * 0.2):.3g} mm/s" for _, speed in runs]
    if all(
        len({own_speed for (name, _), own_speed in zip(runs, speeds, strict=True) if name == label}) > 1
        for label, _ in runs
    ):
        return speeds, "a speed"
    labels = [label for label, _ in runs]
    return [str(labels[:number].count(label)) for number, label in enumerate(labels)], "a repetition"
