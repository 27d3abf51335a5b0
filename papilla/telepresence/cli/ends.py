"""`papilla telepresence sensor | display`: the two ends of the real link, as processes."""

import gc
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from shutil import get_terminal_size
from typing import TYPE_CHECKING, Annotated, Any

import typer

from papilla.cli.options import SceneOption, about, keep_inputs, option
from papilla.cli.output import EXIT_INTERRUPTED, CommandResult, say, tell
from papilla.core.errors import InputError
from papilla.core.units import MS_PER_NS, MS_PER_S
from papilla.telepresence.cli.options import (
    GRATING_OPTIONS,
    QUANTITY_COLUMNS,
    ComponentsOption,
    DisplayOptions,
    GratingOptions,
    HandOptions,
    OutOption,
    RateOption,
    SoftOptions,
    quantity_row,
    refuse_with_log,
)

if TYPE_CHECKING:
    from papilla.telepresence.ends import FingerSource
    from papilla.telepresence.processes import Live, Report, TickGrid, TimeHistogram
    from papilla.telepresence.sensing import Sensing
    from papilla.telepresence.udp import Endpoint

WRITTEN_ROWS = 100
"""Number of rows that are written to a table at once, which takes less than a control period."""
AWAY_S = 5.0
"""Seconds between two live lines with the same state if stderr is not a terminal."""

SECONDS_OPTION = option(None, "Stop after this time; without it, at Ctrl-C.")
ListenOption = Annotated[str, typer.Option(help="Address at which this end listens.", metavar="HOST:PORT")]
PeerOption = Annotated[
    str, typer.Option(help="The other end: messages from any other address are dropped.", metavar="HOST:PORT")
]


@dataclass(frozen=True)
class SensorAddress:
    """Address of the sensor's end, and of its peer."""

    listen: ListenOption = "127.0.0.1:47001"
    peer: PeerOption = "127.0.0.1:47002"
    key_file: Path | None = option(
        None, "File with a secret of 16 bytes or more that both ends share; needed for other machines."
    )

    def endpoint(self) -> "Endpoint":
        """The endpoint; raises `InputError` and `FileAccessError`."""
        from papilla.core.outside import read_key
        from papilla.telepresence.udp import Address, Endpoint

        key = None if self.key_file is None else read_key(self.key_file)
        listen, peer = Address.of(self.listen, "--listen"), Address.of(self.peer, "--peer")
        if listen == peer:
            raise InputError(f"--listen and --peer must differ, got {listen} twice")
        with about(self.key_file):
            endpoint = Endpoint(listen, peer, key)
        if endpoint.leaves_machine:
            say(f"messages to {peer} are signed, not encrypted: whoever is on the way can read them")
        return endpoint


@dataclass(frozen=True)
class DisplayAddress(SensorAddress):
    """Address of the display's end, and of its peer."""

    listen: ListenOption = "127.0.0.1:47002"
    peer: PeerOption = "127.0.0.1:47001"


def sensor(
    context: typer.Context,
    address: SensorAddress,
    grating: GratingOptions,
    specimen: SoftOptions,
    log: Path | None = option(None, "Time log to play again, in place of the grating."),
    components: ComponentsOption = 1,
    parameters_rate: RateOption = 50.0,
    seconds: float | None = SECONDS_OPTION,
    seed: int = option(0, "Of the noise.", min=0),
    scene: SceneOption = None,
) -> CommandResult:
    """Follow a remote hand over a simulated grating, estimate its wavelength at 1 kHz, and send that.

    With --calibration the finger also presses as the hand does, on a soft specimen under the grating: modulus and
    friction are sent too, and with --sweep the contact area.

    With --log, the rows of a log are played again at their times instead: a modulus needs --calibration and a column
    force_N, friction tangential_N.

    Start `papilla telepresence display` on another machine or in another terminal, in any order; either may be stopped,
    killed and started again. The grating stands for finger, arm and board: examples/own_ends.py has the few lines with
    those.
    """
    from papilla.core import checks
    from papilla.telepresence.ends import TouchSource
    from papilla.telepresence.processes import run_sensor
    from papilla.telepresence.touch import GratingTexture, TouchLog

    checks.within("--parameters-rate", parameters_rate, 1, 1000)
    refuse_with_log(context, log, *GRATING_OPTIONS, "seed", "modulus", "friction")
    if log is not None:
        source, sensing = _of_log(log, specimen, components)
    else:
        touch = TouchLog(GratingTexture(grating.wavelength, grating.amplitude), grating.noise, specimen.soft())
        source, sensing = TouchSource(touch, seed), touch.sensing(components)
    with address.endpoint() as endpoint, _live() as report:
        how: Any = {"seconds": _time(seconds), "report": report, "parameters_Hz": parameters_rate}
        return _until_stopped(lambda period: run_sensor(endpoint, source, sensing, period=period, **how), endpoint)


def display(
    address: DisplayAddress,
    hand: HandOptions,
    shown_by: DisplayOptions,
    seconds: float | None = SECONDS_OPTION,
    scene: SceneOption = None,
    out: OutOption = None,
) -> CommandResult:
    """Move a simulated hand, send where it is, and display the texture under it from what the sensor sends back.

    The vibration is made here, of the hand's own motion, so it is not late however long the link is. When the link is
    silent for 0.5 s the output decays to zero within 0.3 s; it comes back within 0.1 s. examples/own_ends.py
    has the few lines with an encoder and an actuator.
    """
    from papilla.telepresence.processes import run_display

    keep_inputs([scene, address.key_file, shown_by.curve], [out] if out else [])
    motion, (model, _) = hand.motion(), shown_by.model()
    with ExitStack() as stack:
        endpoint = stack.enter_context(address.endpoint())
        how: Any = {"seconds": _time(seconds)}
        if out is not None:
            how["keep"] = stack.enter_context(_table_of_rows(out))
        how["report"] = stack.enter_context(_live())
        return _until_stopped(lambda period: run_display(endpoint, model, motion, period=period, **how), endpoint)


@contextmanager
def _table_of_rows(out: Path) -> Iterator[Callable[..., None]]:
    """Yields a function that keeps a row of the table; rows are written in groups."""
    from papilla.core.files import check_writable
    from papilla.core.tables import table_writer

    check_writable(out.parent)
    names = ("t_s", "position_mm", "displacement_um", "drive_V", "wavelength_mm", "gain", *QUANTITY_COLUMNS)
    rows: list[tuple] = []
    with table_writer(out, names) as write:

        def keep(now, place, output, message) -> None:
            rows.append((now, place, *output[:2], output.wavelength_mm, output.gain, *quantity_row(message)))
            if len(rows) >= WRITTEN_ROWS:
                write(zip(*rows, strict=True))
                rows.clear()

        yield keep
        if rows:
            write(zip(*rows, strict=True))


def _of_log(log: Path, specimen: SoftOptions, components: int) -> "tuple[FingerSource, Sensing]":
    """A replayed log and its estimators, with modulus and contact area if possible."""
    from papilla.calibration import Calibration
    from papilla.estimators import Doubts, Pipeline
    from papilla.logs import read_time_log
    from papilla.telepresence.ends import LogSource
    from papilla.telepresence.sensing import ContactArea, Sensing

    calibration, sweep, thickness = specimen.calibration, specimen.sweep, specimen.thickness
    if calibration is None and (sweep or thickness is not None):
        raise InputError("--sweep and --thickness need --calibration: they are of a force and a modulus")
    source = LogSource(read_time_log(log))
    with about(log):
        pipeline = Pipeline(
            None if calibration is None else Calibration.load(calibration),
            gauges=source.gauges,
            columns=source.columns,
            doubts=None if thickness is None else Doubts(thickness_mm=thickness),
        )
        area = None if sweep is None else ContactArea.load(sweep)
        return source, Sensing(pipeline, components=components, area=area)


def _time(seconds: float | None) -> float:
    from papilla.core import checks

    return float("inf") if seconds is None else checks.positive("--seconds", seconds)


@contextmanager
def _live() -> "Iterator[Report]":
    """Yields a function that shows a state on one line, which is overwritten; if stderr is not a terminal, a line every
    few seconds."""
    terminal, last, last_state = sys.stderr.isatty(), 0.0, ""

    def report(live: "Live") -> None:
        """Show this state."""
        nonlocal last, last_state
        counts, values = live.counts, f"{live.said}; " if live.said else ""
        line = f"{live.time_s:8.1f} s  {live.state}; {values}{counts.accepted} messages, {counts.dropped} dropped, "
        line += f"{live.period.missed} periods missed"
        if terminal:
            print(f"\r\x1b[2K{line[: get_terminal_size().columns - 1]}", end="", file=sys.stderr, flush=True)
        elif live.time_s - last >= AWAY_S or live.state != last_state:
            last, last_state = live.time_s, live.state
            say(line)

    try:
        yield report
    finally:
        if terminal:
            print(file=sys.stderr)


def _quantiles_ms(times: "TimeHistogram") -> dict[str, float]:
    return {"p50": MS_PER_S * times.quantile_s(0.5), "p99.9": MS_PER_S * times.quantile_s(0.999)}


def _until_stopped(work: "Callable[[TickGrid], object]", endpoint: "Endpoint") -> CommandResult:
    """Run until the time is over, Ctrl-C or SIGTERM; return the summary.

    Both signals act even if a script that started this in the background has them ignored.
    """
    from papilla.telepresence.processes import TickGrid

    period, code = TickGrid(), 0
    # Freeze the objects loaded so far: a full garbage collection of them takes 0.1 s, a hundred periods.
    gc.collect()
    gc.freeze()
    before = {stop: signal.signal(stop, signal.default_int_handler) for stop in (signal.SIGINT, signal.SIGTERM)}
    try:
        work(period)
    except KeyboardInterrupt:
        code = EXIT_INTERRUPTED
    finally:
        gc.unfreeze()
        for stop, handler in before.items():
            signal.signal(stop, handler)
    offset, counts = endpoint.gate.offset, endpoint.gate.counts
    summary: dict[str, Any] = {
        "periods": period.ticked,
        "missed": period.missed,
        "work_ms": _quantiles_ms(period.work),
        "busy_ms": _quantiles_ms(period.busy),
        "sent": endpoint.sent,
        "bytes_sent": endpoint.bytes_sent,
        "received": asdict(counts),
        "round_trip_ms": MS_PER_NS * offset.round_trip_ns,
        "clock_offset_ms": MS_PER_NS * offset.offset_ns,
    }
    trip = summary["round_trip_ms"]
    sentence = f"{period.ticked} periods, {period.missed} missed; {endpoint.sent} messages sent, "
    sentence += f"{counts.accepted} received, {counts.dropped} dropped"
    sentence += f"; shortest round trip {trip:.2f} ms" if trip == trip else ""
    return CommandResult(summary, partial(tell, sentence), code)
