"""`papilla telepresence simulate | sensor | display`: remote touch over a delayed link."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from papilla.cli.options import about, keep_inputs
from papilla.cli.output import print_json, print_table, progress, say, tell
from papilla.cli.telepresence_options import (
    GRATING,
    TOLD,
    TOLD_COLUMNS,
    ActuatorOption,
    AmplitudeOption,
    CalibrationOption,
    ComponentsOption,
    CurveOption,
    ForceOption,
    FrictionOption,
    JsonOption,
    ModulusOption,
    NoiseOption,
    RateOption,
    RuleOption,
    SpeedOption,
    StrokeOption,
    StrokesOption,
    SweepOption,
    ThicknessOption,
    WavelengthOption,
    make_model,
    make_soft,
    refuse_with_log,
    told_row,
    word,
)
from papilla.errors import InputError

if TYPE_CHECKING:
    from papilla.telepresence.link import LinkModel
    from papilla.telepresence.local_model import LocalModel
    from papilla.telepresence.loop import Record
    from papilla.telepresence.texture import Texture
    from papilla.telepresence.touch import Soft

telepresence = typer.Typer(
    help="Remote touch over a delayed link: what a texture is travels, not its signal; the display makes touch of it.",
    no_args_is_help=True,
)
LogOption = Annotated[
    Path | None, typer.Option(help="Recorded texture instead: a time log with g1 and position_mm or velocity_mm_s.")
]
SecondOption = Annotated[
    float | None, typer.Option(help="Wavelength (mm) of a second grating beside it, which the hand comes onto.")
]
RoundTripOption = Annotated[float, typer.Option(help="Mean delay hand - sensor - display.")]
SdOption = Annotated[float, typer.Option(help="Its standard deviation, drawn anew five times a second.")]
ShareOption = Annotated[
    float, typer.Option(help="Share of the delay on the way to the sensor; the paper has all on the way back.")
]
JitterOption = Annotated[float, typer.Option(help="What each datagram waits besides, one way.")]
LossOption = Annotated[float, typer.Option(help="Share of datagrams that are lost, each way (0 to 1).")]
ReorderingOption = Annotated[float, typer.Option(help="Share that may be overtaken, each way.")]
DuplicationOption = Annotated[float, typer.Option(help="Share that arrive twice, each way.")]
BandwidthOption = Annotated[
    float | None, typer.Option(help="Bytes a second, headers included, that fit each way; unlimited by default.")
]


@telepresence.command()
def simulate(
    context: typer.Context,
    wavelength: WavelengthOption = 1.2,
    second_wavelength: SecondOption = None,
    log: LogOption = None,
    amplitude: AmplitudeOption = 50.0,
    noise: NoiseOption = 3.5,
    round_trip_ms: RoundTripOption = 120.0,
    round_trip_sd_ms: SdOption = 40.0,
    uplink_share: ShareOption = 0.0,
    jitter_ms: JitterOption = 0.0,
    loss: LossOption = 0.0,
    reordering: ReorderingOption = 0.0,
    duplication: DuplicationOption = 0.0,
    bandwidth: BandwidthOption = None,
    speed: SpeedOption = 197.0,
    strokes: StrokesOption = 1.07,
    force: ForceOption = 0.5,
    seconds: Annotated[float, typer.Option(help="How long to simulate.")] = 8.0,
    components: ComponentsOption = 1,
    parameters_rate: RateOption = 50.0,
    seed: Annotated[int, typer.Option(help="Of noise and links.", min=0)] = 0,
    actuator: ActuatorOption = "piezo",
    stroke_um: StrokeOption = None,
    rule: RuleOption = "measured",
    curve: CurveOption = None,
    calibration: CalibrationOption = None,
    sweep: SweepOption = None,
    modulus: ModulusOption = None,
    friction: FrictionOption = None,
    thickness: ThicknessOption = None,
    out: Annotated[Path | None, typer.Option(help="Table of what was displayed, a row per ms (CSV).")] = None,
    html: Annotated[Path | None, typer.Option(help="Page to play with: finger, grating, sliders (HTML).")] = None,
    as_json: JsonOption = False,
) -> None:
    """Simulate hand, link, sensor and display, with the local model and with direct feedback on the same signals.

    Direct feedback displays the sensor's signal when it arrives, one round trip late. The local model is sent the
    texture's wavelength and amplitude, and makes the vibration of the hand's own motion, so it is not late; what it
    shows of a new texture is. By default the hand, the delay and the rates are those of Okamoto et al. 2011.

    lag_ms: how late each display is behind the hand, measured on what it displays; none at a steady speed, where
    nothing tells it. wavelength_error: RMS over windows of 0.25 s of the wavelength that the display has for the hand's
    own motion, as a fraction. With --second-wavelength, stale_ms and change_ms: for how long the old texture is still
    displayed, and after how long the new one is, medians over the crossings. The new one has to be felt first: some
    periods of it, 0.2 to 0.5 s beyond the delay.

    With --calibration a soft specimen lies under the texture and the finger presses while it slides: modulus, friction
    and contact area travel too, each with its standard deviation and status.
    """
    from papilla.telepresence.direct import DirectFeedback
    from papilla.telepresence.loop import Motion, Set, run

    _check_files([log, curve, calibration, sweep], [path for path in (out, html) if path is not None])
    disturbed = {"jitter_ms": jitter_ms, "loss": loss, "reordering": reordering, "duplication": duplication}
    up, down = _ways(uplink_share, round_trip_ms, round_trip_sd_ms, bandwidth, disturbed)
    refuse_with_log(context, log, *GRATING, "calibration")
    motion = Motion(speed, strokes, press_N=force)
    model, shown_by = make_model(components, actuator, stroke_um, rule, curve)
    soft = make_soft(calibration, sweep, modulus, friction, thickness)
    _check_soft(soft, force)
    texture, start = _texture(wavelength, second_wavelength, amplitude, log, motion, seconds)
    own = noise if log is None else 0.0
    scene = Set(texture, motion, seconds, up, down, own, components, parameters_rate, seed, start, soft)
    with progress() as bar:
        bar.line("simulating")
        record = run(scene, model, DirectFeedback(model.actuator), progress=bar.steps)
    found = _summary(record, scene) | {"display": shown_by}
    if out is not None:
        _write(out, record)
        found["table"] = str(out)
    if html is not None:
        _write_page(html, scene, record, model, round_trip_ms)
        found["page"] = str(html)
    print_json(found) if as_json else _print(found)


def _check_files(inputs: list[Path | None], outputs: list[Path]) -> None:
    from papilla.files import check_writable

    keep_inputs(inputs, outputs)
    if len({path.resolve() for path in outputs}) < len(outputs):
        raise InputError(f"--out and --html must be two files, got {outputs[0]} twice")
    for path in outputs:
        check_writable(path.parent)


def _check_soft(soft: "Soft | None", force: float) -> None:
    from papilla.telepresence.loop import PRESS_SWING

    if soft is None:
        return
    most = soft.calibration.domain["force_N"][1] / (1 + PRESS_SWING)
    if not force <= most:
        raise InputError(f"--force must be at most {most:.3g}, as it swings within the calibration, got {force:g}")


def _ways(
    uplink_share: float, round_trip_ms: float, round_trip_sd_ms: float, bandwidth: float | None, disturbed: dict
) -> "tuple[LinkModel, LinkModel]":
    """Both ways of the link, up and down, each with its share of the round trip."""
    from papilla import checks
    from papilla.telepresence.link import LinkModel

    checks.within("--uplink-share", uplink_share, 0, 1)
    mean = checks.within("--round-trip-ms", round_trip_ms, 0, 10_000)
    sd = checks.within("--round-trip-sd-ms", round_trip_sd_ms, 0, 10_000)
    cap = float("inf") if bandwidth is None else checks.positive("--bandwidth", bandwidth)
    up, down = (
        LinkModel(one_way_ms=share * mean, one_way_sd_ms=share**0.5 * sd, bandwidth_bytes_s=cap, **disturbed)
        for share in (uplink_share, 1 - uplink_share)
    )
    return up, down


def _texture(wavelength, second, amplitude, log, motion, seconds) -> "tuple[Texture, float]":
    """The texture of the options, and the place on it where the hand begins."""
    from papilla.estimators.tracking.trackers import DEFAULT_RANGE_MM
    from papilla.telepresence.texture import GratingTexture, RecordedTexture, SideBySide

    if log is not None:
        from papilla.logs import read_time_log

        with about(log):
            texture = RecordedTexture.of_log(read_time_log(log))
        low, high = texture.reach_mm
        needed = motion.length_mm if motion.strokes_Hz else motion.peak_mm_s * seconds
        if needed > high - low:
            raise InputError(
                f"the hand needs {needed:.3g} mm of texture, {log} has {high - low:.3g} mm: lower --speed or "
                "--seconds, or raise --strokes"
            )
        return texture, low + 0.5 * (high - low - needed)
    first = GratingTexture(wavelength, amplitude)
    other = None if second is None else GratingTexture(second, amplitude)
    for one in (wavelength, second):
        if one is not None and not DEFAULT_RANGE_MM[0] <= one <= DEFAULT_RANGE_MM[1]:
            say(
                f"a wavelength of {one:g} mm is not looked for: estimators look from {DEFAULT_RANGE_MM[0]:g} to "
                f"{DEFAULT_RANGE_MM[1]:g} mm"
            )
    if other is None:
        return first, 0.0
    # The border lies where the hand passes it in the middle of a stroke, or of the time.
    border = 0.5 * (motion.length_mm if motion.strokes_Hz else motion.peak_mm_s * seconds)
    return SideBySide(first, other, border), 0.0


def _summary(record: "Record", scene) -> dict:
    """What is told of a run; times in ms, errors as fractions."""
    both = ("local", "direct")
    felt = {name: record.felt(name) for name in both}
    return {
        "lag_ms": {**{name: record.lag_ms(name) for name in both}, "round_trip": record.late_ms},
        "bytes_per_s": record.bytes_per_s,
        "bytes_per_s_with_headers": record.with_headers,
        "wavelength_error": {name: own.error for name, own in felt.items()},
        "silent": {name: own.silent for name, own in felt.items()},
        "change_ms": {name: record.change_ms(name) for name in both},
        "stale_ms": {name: record.stale_ms(name) for name in both},
        "lost": record.lost,
        "status": {name: record.statuses(name) for name in both},
        "told": _told(record, scene),
        "seconds": scene.seconds,
        "seed": scene.seed,
    }


def _told(record: "Record", scene) -> dict[str, dict]:
    """The last message that arrived: of each quantity value, sigma, status, and what is true."""
    message, soft = record.told[-1], scene.soft
    if message is None:
        return {}
    truths = {}
    if soft is not None:
        truths = {"modulus": soft.modulus_MPa, "mu_kinetic": soft.friction, "mu_static": soft.friction}
        if soft.area is not None and message.force is not None and message.force.value is not None:
            truths["area"] = soft.area(message.force.value, soft.modulus_MPa)[0]
    found = {
        names[0]: {"value": one.value, "sigma": one.sigma, "status": word(one), "true": truths.get(name)}
        for name, names in TOLD.items()
        if (one := getattr(message, name)) is not None
    }
    if message.lines:
        line = message.lines[0].wavelength
        truth = float(record.truth_mm[-1])
        found["wavelength_mm"] = {"value": line.value, "sigma": line.sigma, "status": word(line), "true": truth}
    return found


def _print(found: dict) -> None:
    lag, error = found["lag_ms"], found["wavelength_error"]
    steady = "not told at a steady speed"
    print_table(
        [
            ("round trip", f"{lag['round_trip']:.1f}", "ms"),
            *(
                (
                    f"lag behind the hand, {name}",
                    *((f"{lag[name]:.1f}", "ms") if lag[name] == lag[name] else (steady, "")),
                )
                for name in ("local", "direct")
            ),
            *((f"wavelength error, {name}", f"{100 * error[name]:.2f}", "%") for name in ("local", "direct")),
            *((f"silent, {name}", f"{100 * found['silent'][name]:.1f}", "%") for name in ("local", "direct")),
            *((f"sent down, {name}", f"{found['bytes_per_s'][name]:.0f}", "bytes/s") for name in ("local", "direct")),
            *(
                (f"{what}, {name}", f"{value:.0f}", "ms")
                for key, what in (("stale_ms", "old texture stays"), ("change_ms", "new texture after"))
                for name, value in found[key].items()
                if value == value
            ),
            *(
                (
                    name,
                    f"{one['value']:.4g} ± {one['sigma'] or float('nan'):.2g} ({one['status']})",
                    _truth(one["true"]),
                )
                for name, one in found["told"].items()
                if one["value"] is not None
            ),
        ]
    )
    for name, shares in found["status"].items():
        for sentence, share in shares.items():
            if sentence != "ok":
                say(f"{name}, {100 * share:.1f} % of the time: {sentence}")
    for kind in ("table", "page"):
        if kind in found:
            tell(f"Wrote {found[kind]}")


def _truth(value: float | None) -> str:
    return "" if value is None or value != value else f"true {value:.4g}"


def _write(path: Path, record: "Record") -> None:
    from papilla.tables import table_writer

    names = (
        "t_s", "position_mm", "local_um", "direct_um", "local_wavelength_mm", "direct_wavelength_mm",
        "true_wavelength_mm", "round_trip_ms",
    )  # fmt: skip
    columns = [record.time_s, record.hand_mm, record.local_um, record.direct_um, record.wavelength_mm]
    columns += [record.direct_mm, record.truth_mm, record.round_trip_ms]
    with table_writer(path, (*names, *TOLD_COLUMNS)) as write:
        write([*columns, *zip(*map(told_row, record.told), strict=True)])


def _write_page(path: Path, scene, record: "Record", model: "LocalModel", round_trip_ms: float) -> None:
    """The page, which begins with the wavelength, motion, delay and loss of the run, and what was displayed last."""
    from papilla.telepresence.loop import RATE_HZ
    from papilla.telepresence.page import settings, write_page

    wavelength = scene.texture.wavelength(scene.start_mm)
    if not wavelength > 0:
        raise InputError("the recorded texture has no significant line, so there is no grating for --html")
    displayed = (
        model.rule(one.wavelength_mm, one.amplitude_microstrain)
        for told in reversed(record.told)
        if told is not None
        for one in told.components[:1]
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
        bytes_direct=record.bytes_per_s["direct"] / RATE_HZ,
        actuator=model.actuator,
    )
    write_page(path, begin)
