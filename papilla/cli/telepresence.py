"""`papilla telepresence simulate | sensor | display`: remote touch over a delayed link."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from papilla.cli.options import about, keep_inputs
from papilla.cli.output import print_json, print_table, progress, say, tell
from papilla.errors import InputError

if TYPE_CHECKING:
    from papilla.telepresence.link import LinkModel
    from papilla.telepresence.loop import Record
    from papilla.telepresence.texture import Texture

telepresence = typer.Typer(
    help="Remote touch over a delayed link: what a texture is travels, not its signal; the display makes touch of it.",
    no_args_is_help=True,
)
JsonOption = Annotated[bool, typer.Option("--json", help="Print one JSON object.")]
WavelengthOption = Annotated[float, typer.Option(help="Wavelength (mm) of the grating under the sensor.")]
AmplitudeOption = Annotated[float, typer.Option(help="Amplitude (microstrain) that a gauge reads of it.")]
NoiseOption = Annotated[float, typer.Option(help="Standard deviation (microstrain) of a reading.")]
ComponentsOption = Annotated[int, typer.Option(help="Wavelengths that are sent and displayed at most.", min=1, max=8)]
SpeedOption = Annotated[float, typer.Option(help="Greatest speed (mm/s) of the hand.")]
StrokesOption = Annotated[float, typer.Option(help="Strokes to and fro a second; 0: one at constant speed.")]
RateOption = Annotated[float, typer.Option(help="Messages with parameters a second.")]
SecondOption = Annotated[
    float | None, typer.Option(help="Wavelength (mm) of a second grating beside it, which the hand comes onto.")
]
LogOption = Annotated[
    Path | None, typer.Option(help="Recorded texture instead: a time log with g1 and position_mm or velocity_mm_s.")
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
    seconds: Annotated[float, typer.Option(help="How long to simulate.")] = 8.0,
    components: ComponentsOption = 1,
    parameters_rate: RateOption = 50.0,
    seed: Annotated[int, typer.Option(help="Of noise and links.", min=0)] = 0,
    out: Annotated[Path | None, typer.Option(help="Table of what was displayed, a row per ms (CSV).")] = None,
    html: Annotated[Path | None, typer.Option(help="Page to play with: finger, grating, sliders (HTML).")] = None,
    as_json: JsonOption = False,
) -> None:
    """Simulate hand, link, sensor and display, with the local model and with direct feedback on the same signals.

    Direct feedback displays the sensor's signal when it arrives, one round trip late. The local model is sent the
    texture's wavelength and amplitude, and makes the vibration of the hand's own motion, so it is not late; what it
    shows of a new texture is. By default the hand, the delay and the rates are those of Okamoto et al. 2011.

    lag_ms: how late each display is behind the hand, measured on what it displays. wavelength_error: RMS over windows
    of 0.25 s of the wavelength that the display has for the hand's own motion, as a fraction.
    """
    from papilla import checks
    from papilla.files import check_writable
    from papilla.telepresence.loop import Motion, Set, run

    outputs = [path for path in (out, html) if path is not None]
    keep_inputs([log], outputs)
    _different(outputs)
    checks.within("--uplink-share", uplink_share, 0, 1)
    common = {"jitter_ms": jitter_ms, "loss": loss, "reordering": reordering, "duplication": duplication}
    common["bandwidth_bytes_s"] = float("inf") if bandwidth is None else checks.positive("--bandwidth", bandwidth)
    up, down = (_way(share, round_trip_ms, round_trip_sd_ms, common) for share in (uplink_share, 1 - uplink_share))
    motion = Motion(speed, strokes)
    texture, start = _texture(wavelength, second_wavelength, amplitude, log, motion, seconds)
    for path in outputs:
        check_writable(path.parent)
    scene = Set(
        texture,
        motion,
        seconds,
        up,
        down,
        noise if log is None else 0.0,
        components,
        parameters_rate,
        seed,
        start,
    )
    with progress() as bar:
        bar.line("simulating")
        record = run(scene, progress=bar.steps)
    found = _summary(record, scene)
    if out is not None:
        _write(out, record)
        found["table"] = str(out)
    if html is not None:
        _write_page(html, scene, record, round_trip_ms)
        found["page"] = str(html)
    if as_json:
        print_json(found)
    else:
        _print(found)


def _different(outputs: list[Path]) -> None:
    if len({path.resolve() for path in outputs}) < len(outputs):
        raise InputError(f"--out and --html must be two files, got {outputs[0]} twice")


def _way(share: float, round_trip_ms: float, round_trip_sd_ms: float, common: dict) -> "LinkModel":
    """One way of the link, with its share of the round trip."""
    from papilla import checks
    from papilla.telepresence.link import LinkModel

    mean = share * checks.within("--round-trip-ms", round_trip_ms, 0, 10_000)
    sd = share**0.5 * checks.within("--round-trip-sd-ms", round_trip_sd_ms, 0, 10_000)
    return LinkModel(one_way_ms=mean, one_way_sd_ms=sd, **common)


def _texture(wavelength, second, amplitude, log, motion, seconds) -> "tuple[Texture, float]":
    """The texture of the options, and the place on it where the hand begins."""
    from papilla.estimators.tracking.trackers import DEFAULT_RANGE_MM
    from papilla.telepresence.texture import GratingTexture, RecordedTexture, SideBySide

    if log is not None:
        if second is not None:
            raise InputError("--second-wavelength is for gratings, not for a --log")
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
        "lost": record.lost,
        "status": {name: record.statuses(name) for name in both},
        "seconds": scene.seconds,
        "seed": scene.seed,
    }


def _print(found: dict) -> None:
    lag, error = found["lag_ms"], found["wavelength_error"]
    print_table(
        [
            ("round trip", f"{lag['round_trip']:.1f}", "ms"),
            *((f"lag behind the hand, {name}", f"{lag[name]:.1f}", "ms") for name in ("local", "direct")),
            *((f"wavelength error, {name}", f"{100 * error[name]:.2f}", "%") for name in ("local", "direct")),
            *((f"silent, {name}", f"{100 * found['silent'][name]:.1f}", "%") for name in ("local", "direct")),
            *((f"sent down, {name}", f"{found['bytes_per_s'][name]:.0f}", "bytes/s") for name in ("local", "direct")),
            *(
                (f"new texture displayed after, {name}", f"{value:.0f}", "ms")
                for name, value in found["change_ms"].items()
                if value == value
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


def _write(path: Path, record: "Record") -> None:
    from papilla.tables import table_writer

    names = (
        "t_s", "position_mm", "local_um", "direct_um", "local_wavelength_mm", "direct_wavelength_mm",
        "true_wavelength_mm", "round_trip_ms",
    )  # fmt: skip
    columns = [record.time_s, record.hand_mm, record.local_um, record.direct_um, record.wavelength_mm]
    with table_writer(path, names) as write:
        write([*columns, record.direct_mm, record.truth_mm, record.round_trip_ms])


def _write_page(path: Path, scene, record: "Record", round_trip_ms: float) -> None:
    """The page, which begins with the wavelength, motion, delay and loss of the run."""
    from papilla.telepresence.amplitude import Measured
    from papilla.telepresence.loop import RATE_HZ
    from papilla.telepresence.page import settings, write_page

    wavelength = scene.texture.wavelength(scene.start_mm)
    if not wavelength > 0:
        raise InputError("the recorded texture has no significant line, so there is no grating for --html")
    begin = settings(
        scene.motion,
        wavelength_mm=wavelength,
        round_trip_ms=round_trip_ms,
        loss=scene.downlink.loss,
        amplitude_um=Measured()(wavelength, 50.0),
        bytes_local=record.bytes_per_s["local"] / scene.parameters_Hz,
        bytes_direct=record.bytes_per_s["direct"] / RATE_HZ,
    )
    write_page(path, begin)
