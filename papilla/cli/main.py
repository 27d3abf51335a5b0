"""`papilla COMMAND`: the commands, and the conversion of errors to one line and an exit code."""

import errno
import os
import signal
import sys
import traceback
import warnings
from contextlib import suppress
from importlib.metadata import entry_points
from operator import attrgetter
from pathlib import Path
from typing import Any

import typer

from papilla.cli import output
from papilla.cli.bench import bench
from papilla.cli.calibrate import calibrate
from papilla.cli.compare import compare
from papilla.cli.design import design
from papilla.cli.doctor import doctor
from papilla.cli.estimate import estimate
from papilla.cli.export_c import export_c
from papilla.cli.identify import identify
from papilla.cli.log import map as map_log
from papilla.cli.new import new
from papilla.cli.options import grouped
from papilla.cli.output import CommandGroup
from papilla.cli.press import press
from papilla.cli.slide import slide
from papilla.cli.texture import classify, train
from papilla.cli.verify import verify
from papilla.cli.view import view
from papilla.core.errors import InputError, PapillaError

TRACEBACK_VARIABLE = "PAPILLA_TRACEBACK"
"""Environment variable that, if set, adds the traceback to the message of an internal error."""

app = typer.Typer(
    name="papilla",
    help="Design and calibration of a soft tactile finger, and softness from its gauges. Units: mm, N, MPa, s.",
    epilog="The environment variable PAPILLA_CACHE names the folder of cached results; papilla doctor shows which. "
    "papilla --install-completion completes commands and options in bash, zsh and fish.",
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
OWN_COMMANDS = (
    CommandGroup(
        "", (calibrate, identify, new, compare, press, slide, estimate, view, export_c, design, doctor, verify, bench)
    ),
    CommandGroup("log", (map_log,), "Logs of other programs: what their columns are."),
    CommandGroup("texture", (train, classify), "Classify textures: train on logs of known ones, classify others."),
)
"""Commands of this room."""


def _add(group: CommandGroup) -> None:
    target = typer.Typer(help=group.help, no_args_is_help=True) if group.name else app
    for command in group.commands:
        target.command()(grouped(command))
    if group.name:
        app.add_typer(target, name=group.name)


for _group in OWN_COMMANDS:
    _add(_group)
for _entry in sorted(entry_points(group=output.BROUGHT_COMMANDS_GROUP), key=attrgetter("name")):
    _add(_entry.load().command_group)


def _show_version(wanted: bool) -> None:
    if wanted:
        from papilla import __version__

        print(f"papilla {__version__}")
        raise typer.Exit


@app.callback(invoke_without_command=True)
def _papilla(
    context: typer.Context,
    version: bool = typer.Option(False, "--version", callback=_show_version, is_eager=True, help="Print the version."),
) -> None:
    if context.invoked_subcommand is None:
        context.get_help()


def run(arguments: list[str] | None = None) -> None:
    """Run the command line and exit with its exit code.

    0 done, 1 a check failed, 2 bad input, 70 an error of papilla's own (each one line on stderr), 130 interrupted.
    """
    from papilla.core.workers import THREAD_VARIABLES

    _open_what_is_closed()
    # A command's matrices are small: a second thread doubles the processor time of a press without saving time
    for name in THREAD_VARIABLES:
        os.environ.setdefault(name, "1")
    with suppress(ValueError):  # Only the main thread can handle signals
        signal.signal(signal.SIGTERM, _terminate)
    with warnings.catch_warnings():
        warnings.showwarning = _warn
        code = _exit_code(sys.argv[1:] if arguments is None else arguments)
    try:
        sys.stdout.flush()
    except OSError:  # Of an answer that was printed in part before a refusal
        _drop_output()
    sys.exit(code)


def _open_what_is_closed() -> None:
    """Open closed standard streams on the null device: otherwise the next file opened would receive what is printed.

    It cannot be written to in place of stdout: an answer that nobody can receive is an error, not a success.
    """
    for number, how in enumerate((os.O_RDONLY, os.O_RDONLY, os.O_WRONLY)):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, how)  # It gets the lowest number that is free
    for number, (name, mode) in enumerate((("stdin", "r"), ("stdout", "w"), ("stderr", "w"))):
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, open(number, mode, encoding="utf-8", closefd=False))  # noqa: SIM115
        elif mode == "w" and hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")


def _exit_code(arguments: list[str]) -> int:
    try:
        if any("\0" in argument for argument in arguments):
            raise InputError("an argument holds a NUL character, which no file name can")
        code = app(arguments, prog_name="papilla", standalone_mode=False)
        if code == output.EXIT_INTERRUPTED:
            raise KeyboardInterrupt
        sys.stdout.flush()
        return code if isinstance(code, int) else 0
    except typer.TyperException as error:
        return _refuse(error.format_message())
    except PapillaError as error:
        return _refuse(str(error))
    except MemoryError as error:
        return _refuse(f"not enough memory for this job ({str(error) or 'no detail'})")
    except (KeyboardInterrupt, typer.Abort):
        print("papilla: interrupted", file=sys.stderr)
        return output.EXIT_INTERRUPTED
    except _Terminated:
        print("papilla: terminated", file=sys.stderr)
        return output.EXIT_TERMINATED
    except (BrokenPipeError, SystemExit) as left:
        if isinstance(left, SystemExit) and not left.code:  # typer has printed the completion for a shell
            return 0
        # The reader of our output has ended (typer then raises SystemExit).
        _drop_output()
        return output.BROKEN_PIPE
    except OSError as error:
        _drop_output()
        if error.errno == errno.EBADF and not error.filename:
            return _refuse("standard output is closed: the answer is lost")
        return _refuse(f"{error.filename or 'input or output'}: {error.strerror or error}")
    except Exception as error:
        return _report_internal(error)


class _Terminated(BaseException):
    """The process was asked to end: half-written files are removed on the way out."""


def _terminate(*_signal: object) -> None:
    raise _Terminated


def _report_internal(error: Exception) -> int:
    """One line for an unexpected error and, on request, the traceback."""
    if os.environ.get(TRACEBACK_VARIABLE):
        traceback.print_exception(error)
    *_, last = traceback.extract_tb(error.__traceback__)
    what = f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
    place = f"{Path(last.filename).name}, line {last.lineno}"
    _refuse(f"internal error: {what} ({place}); please report it with what {TRACEBACK_VARIABLE}=1 adds to this line")
    return output.EXIT_INTERNAL


def _drop_output() -> None:
    """Discard buffered output for stdout, which would fail again when the interpreter ends."""
    with suppress(OSError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _warn(message: Warning | str, *_place: Any, **_more: Any) -> None:
    print("papilla: warning:", output.plain(str(message)), file=sys.stderr)


def _refuse(message: str) -> int:
    print("papilla:", output.plain(message), file=sys.stderr)
    return output.EXIT_BAD_INPUT
