"""`papilla telepresence simulate`: remote touch over a simulated link with delay and loss."""

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from papilla.cli.options import SceneOption, about, option, ready
from papilla.cli.output import CommandResult, print_table, progress, say, tell
from papilla.core.errors import InputError
from papilla.core.units import PER_CENT
from papilla.telepresence.cli.options import (
    GRATING_OPTIONS,
    MESSAGE_QUANTITY_COLUMNS,
    QUANTITY_COLUMNS,
    DisplayOptions,
    GratingOptions,
    HandOptions,
    OutOption,
    RateOption,
    SoftOptions,
    quantity_row,
    refuse_with_log,
    word,
)

if TYPE_CHECKING:
    from papilla.telepresence.link import LinkModel
    from papilla.telepresence.local_model import LocalModel
    from papilla.telepresence.motion import HandMotion
    from papilla.telepresence.record import LoopRecord
    from papilla.telepresence.touch import ReadingSource, Soft

SIMULATED_DISPLAYS = ("local", "direct")
"""The displays that are simulated: the local model, and direct feedback."""
SUMMARY_ROWS = (
    ("lag_ms", "lag behind the hand", 1, ".1f", "ms", "not known at a steady speed"),
    ("wavelength_error", "wavelength error", PER_CENT, ".2f", "%", "nothing is displayed"),
    ("silent", "silent", PER_CENT, ".1f", "%", ""),
    ("bytes_per_s", "sent down", 1, ".0f", "bytes/s", ""),
    ("stale_ms", "old texture stays", 1, ".0f", "ms", ""),
    ("change_ms", "new texture after", 1, ".0f", "ms", ""),
)
"""Rows of the printed table: key, name, factor, format, unit, and words for NaN; without words there is then no row."""


@dataclass(frozen=True)
class LinkOptions:
    """Properties of the link."""

    round_trip_ms: float = option(120.0, "Mean delay hand - sensor - display.")
    round_trip_sd_ms: float = option(40.0, "Its standard deviation; a new value is drawn five times a second.")
    uplink_share: float = option(0.0, "Share of the delay on the way to the sensor; the paper has all on the way back.")
    jitter_ms: float = option(0.0, "Standard deviation of the extra wait of each datagram, one way.")
    loss: float = option(0.0, "Share of datagrams that are lost, each way (0 to 1).")
    reordering: float = option(0.0, "Share that may be overtaken, each way.")
    duplication: float = option(0.0, "Share that arrive twice, each way.")
    bandwidth: float | None = option(None, "Bytes a second, headers included, that fit each way; unlimited by default.")

    def ways(self) -> "tuple[LinkModel, LinkModel]":
        """Both ways of the link, up and down, each with its share of the round trip; raises `InputError`."""
        from papilla.core import checks
        from papilla.telepresence.link import LinkModel

        up = checks.within("--uplink-share", self.uplink_share, 0, 1)
        mean = checks.within("--round-trip-ms", self.round_trip_ms, 0, 10_000)
        sd = checks.within("--round-trip-sd-ms", self.round_trip_sd_ms, 0, 10_000)
        more = {name: getattr(self, name) for name in ("jitter_ms", "loss", "reordering", "duplication")}
        if self.bandwidth is not None:
            more["bandwidth_bytes_s"] = checks.positive("--bandwidth", self.bandwidth)
        uplink, downlink = (LinkModel(share * mean, share**0.5 * sd, **more) for share in (up, 1 - up))
        return uplink, downlink


def simulate(
    context: typer.Context,
    grating: GratingOptions,
    link: LinkOptions,
    hand: HandOptions,
    display: DisplayOptions,
    specimen: SoftOptions,
    second_wavelength: float | None = option(None, "Wavelength (mm) of a second grating that the hand comes onto."),
    log: Path | None = option(None, "Recorded texture instead: a time log with g1 and position_mm or velocity_mm_s."),
    seconds: float = option(8.0, "How long to simulate."),
    parameters_rate: RateOption = 50.0,
    seed: int = option(0, "Of noise and links.", min=0),
    scene: SceneOption = None,
    out: OutOption = None,
    html: Path | None = option(None, "Page to play with: finger, grating, sliders (HTML)."),
) -> CommandResult:
    """Simulate hand, link, sensor and display, with the local model and with direct feedback on the same signals.

    Direct feedback displays the sensor's signal when it arrives, one round trip late. The local model is sent the
    texture's wavelength and amplitude, and makes the vibration of the hand's own motion, so it is not late; what it
    shows of a new texture is. By default the hand, the delay and the rates are those of Okamoto et al. 2011.

    lag_ms: delay of each display behind the hand, measured in its output; not known at a steady speed.
    wavelength_error: RMS error, over windows of 0.25 s, of the displayed wavelength relative to the hand's own motion,
    as a fraction. With --second-wavelength, stale_ms and change_ms: time for which the old texture is still displayed,
    and time until the new one is, as medians over the crossings. The sensor must measure the new one first: some
    periods of it, 0.2 to 0.5 s besides the delay.

    With --calibration a soft specimen lies under the texture and the finger presses while it slides: modulus, friction
    and contact area are sent, too, each with its standard deviation and status.
    """
    from papilla.telepresence.direct import DirectFeedback
    from papilla.telepresence.loop import Set, run

    written = [path for path in (out, html) if path is not None]
    ready([scene, log, display.curve, specimen.calibration, specimen.sweep], written)
    refuse_with_log(context, log, *GRATING_OPTIONS, "calibration")
    (up, down), motion, soft, (model, described) = link.ways(), hand.motion(), specimen.soft(), display.model()
    _check_force(soft, hand.force)
    texture, start = _texture(grating, second_wavelength, log, motion, seconds)
    noise = grating.noise if log is None else 0.0
    simulated = Set(
        texture, motion, seconds, up, down, noise, display.components, parameters_rate, seed, start, soft
    )  # fmt: skip
    with progress() as bar:
        record = run(simulated, model, DirectFeedback(model.actuator), progress=bar)
    summary = _summary(record, simulated) | {"display": described}
    if out is not None:
        _write(out, record)
        summary["table"] = str(out)
    if html is not None:
        _write_page(html, simulated, record, model, link.round_trip_ms)
        summary["page"] = str(html)
    return CommandResult(summary, partial(_print, summary))


def _check_force(soft: "Soft | None", force: float) -> None:
    from papilla.telepresence.motion import PRESS_SWING

    if soft is None:
        return
    most = soft.calibration.domain["force_N"][1] / (1 + PRESS_SWING)
    if not force <= most:
        raise InputError(f"--force must be at most {most:.3g}, as it swings within the calibration, got {force:g}")


def _texture(
    grating: GratingOptions, second: float | None, log: Path | None, motion: "HandMotion", seconds: float
) -> "tuple[ReadingSource, float]":
    """The texture of the options, and the place (mm) on it where the hand starts."""
    from papilla.estimators.wavelength.trackers import DEFAULT_WAVELENGTHS_MM
    from papilla.telepresence.touch import GratingTexture, RecordedTexture, SideBySide

    needed = motion.length_mm if motion.strokes_Hz else motion.peak_mm_s * seconds
    if log is not None:
        from papilla.logs import read_time_log

        with about(log):
            texture = RecordedTexture.of_log(read_time_log(log))
        low, high = texture.reach_mm
        if needed > high - low:
            raise InputError(
                f"the hand needs {needed:.3g} mm of texture, {log} has {high - low:.3g} mm: lower --speed or "
                "--seconds, or raise --strokes"
            )
        return texture, low + 0.5 * (high - low - needed)
    first = GratingTexture(grating.wavelength, grating.amplitude)
    second_grating = None if second is None else GratingTexture(second, grating.amplitude)
    low, high = DEFAULT_WAVELENGTHS_MM
    for wavelength in (grating.wavelength, second):
        if wavelength is not None and not low <= wavelength <= high:
            say(f"a wavelength of {wavelength:g} mm is not looked for: estimators look from {low:g} to {high:g} mm")
    # The border lies where the hand passes it in the middle of a stroke, or of the time.
    return (first if second_grating is None else SideBySide(first, second_grating, 0.5 * needed)), 0.0


def _summary(record: "LoopRecord", scene) -> dict:
    """Plain values of a run; times in ms, errors as fractions."""
    felt = {name: record.felt(name) for name in SIMULATED_DISPLAYS}
    return {
        "lag_ms": {**{name: record.lag_ms(name) for name in SIMULATED_DISPLAYS}, "round_trip": record.late_ms},
        "bytes_per_s": record.bytes_per_s,
        "bytes_per_s_with_headers": record.with_headers,
        "wavelength_error": {name: wavelengths.error for name, wavelengths in felt.items()},
        "silent": {name: wavelengths.silent for name, wavelengths in felt.items()},
        "change_ms": {name: record.change_ms(name) for name in SIMULATED_DISPLAYS},
        "stale_ms": {name: record.stale_ms(name) for name in SIMULATED_DISPLAYS},
        "lost": record.lost,
        "status": {name: record.statuses(name) for name in SIMULATED_DISPLAYS},
        "told": _last_message(record, scene),
        "seconds": scene.seconds,
        "seed": scene.seed,
    }


def _last_message(record: "LoopRecord", scene) -> dict[str, dict]:
    """The last message that arrived: for each quantity value, sigma, status, and the true value."""
    message, soft = record.messages[-1], scene.soft
    if message is None:
        return {}
    truths: dict[str, Any] = {}
    if soft is not None:
        truths = {"modulus": soft.modulus_MPa, "mu_kinetic": soft.friction, "mu_static": soft.friction}
        if soft.area is not None and message.force is not None and message.force.value is not None:
            truths["area"] = soft.area(message.force.value, soft.modulus_MPa)[0]
    quantities = [
        (names[0], getattr(message, name), truths.get(name)) for name, names in MESSAGE_QUANTITY_COLUMNS.items()
    ]
    if message.lines:
        quantities.append(("wavelength_mm", message.lines[0].wavelength, float(record.truth_mm[-1])))
    return {
        name: {"value": quantity.value, "sigma": quantity.sigma, "status": word(quantity), "true": truth}
        for name, quantity, truth in quantities
        if quantity is not None
    }


def _print(summary: dict) -> None:
    rows = [("round trip", f"{summary['lag_ms']['round_trip']:.1f}", "ms")]
    for key, what, factor, form, unit, unknown in SUMMARY_ROWS:
        for name in SIMULATED_DISPLAYS:
            value = summary[key][name]
            if value == value:
                rows.append((f"{what}, {name}", f"{factor * value:{form}}", unit))
            elif unknown:
                rows.append((f"{what}, {name}", unknown, ""))
    for name, quantity in summary["told"].items():
        if quantity["value"] is not None:
            value = f"{quantity['value']:.4g} ± {quantity['sigma'] or float('nan'):.2g} ({quantity['status']})"
            truth = quantity["true"]
            rows.append((name, value, "" if truth is None or truth != truth else f"true {truth:.4g}"))
    print_table(rows)
    for name, shares in summary["status"].items():
        for sentence, share in shares.items():
            if sentence != "ok":
                say(f"{name}, {PER_CENT * share:.1f} % of the time: {sentence}")
    for key_of_file in ("table", "page"):
        if key_of_file in summary:
            tell(f"Wrote {summary[key_of_file]}")


def _write(path: Path, record: "LoopRecord") -> None:
    from papilla.core.tables import table_writer

    names = (
        "t_s", "position_mm", "local_um", "direct_um", "local_wavelength_mm", "direct_wavelength_mm",
        "true_wavelength_mm", "round_trip_ms",
    )  # fmt: skip
    columns = [record.time_s, record.hand_mm, record.local_um, record.direct_um, record.wavelength_mm]
    columns += [record.direct_mm, record.truth_mm, record.round_trip_ms]
    with table_writer(path, (*names, *QUANTITY_COLUMNS)) as write:
        write([*columns, *zip(*map(quantity_row, record.messages), strict=True)])


def _write_page(path: Path, scene, record: "LoopRecord", model: "LocalModel", round_trip_ms: float) -> None:
    """Write the page, with wavelength, motion, delay and loss of the run, and the last displayed output."""
    from papilla.telepresence.motion import HAND_RATE_HZ
    from papilla.telepresence.page import settings, write_page

    wavelength = scene.texture.wavelength(scene.start_mm)
    if not wavelength > 0:
        raise InputError("the recorded texture has no significant line, so there is no grating for --html")
    displayed = (
        model.rule(line.wavelength_mm, line.amplitude_microstrain)
        for message in reversed(record.messages)
        if message is not None
        for line in message.components[:1]
    )
    amplitude = next((value for value in displayed if value == value), None)
    if amplitude is None:
        raise InputError("no line was displayed, so there is nothing for --html: is the wavelength looked for?")
    begin = settings(
        scene.motion,
        wavelength_mm=wavelength,
        round_trip_ms=round_trip_ms,
        loss=scene.downlink.loss,
        amplitude_um=amplitude,
        bytes_local=record.bytes_per_s["local"] / scene.parameters_Hz,
        bytes_direct=record.bytes_per_s["direct"] / HAND_RATE_HZ,
        actuator=model.actuator,
    )
    write_page(path, begin)
