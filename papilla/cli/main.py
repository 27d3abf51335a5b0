"""`papilla COMMAND`: the commands, and the one place where errors become one line and an exit code."""

import os
import sys
import warnings
from contextlib import suppress

import typer

from papilla.cli.bench import bench
from papilla.cli.calibrate import calibrate
from papilla.cli.estimate import estimate
from papilla.cli.press import press
from papilla.cli.verify import verify
from papilla.cli.view import view
from papilla.errors import PapillaError

BAD_INPUT, INTERRUPTED, BROKEN_PIPE = 2, 130, 141

app = typer.Typer(
    name="papilla",
    help="Design and calibration of a soft tactile finger, and softness from its gauges. Units: mm, N, MPa, s.",
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.command()(calibrate)
app.command()(press)
app.command()(estimate)
app.command()(view)
app.command()(verify)
app.command()(bench)


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
    """Run the command line and leave with its exit code: 0 done, 1 a check failed, 2 bad input (one line on stderr)."""
    with warnings.catch_warnings():
        warnings.showwarning = _warn
        code = _exit_code(sys.argv[1:] if arguments is None else arguments)
    sys.exit(code)


def _exit_code(arguments: list[str]) -> int:
    try:
        code = app(arguments, prog_name="papilla", standalone_mode=False)
        sys.stdout.flush()
        return code if isinstance(code, int) else 0
    except typer.TyperException as error:
        return _refuse(error.format_message())
    except PapillaError as error:
        return _refuse(str(error))
    except MemoryError as error:
        return _refuse(f"not enough memory for this job ({error or 'no detail'})")
    except (KeyboardInterrupt, typer.Abort):
        return INTERRUPTED
    except (BrokenPipeError, SystemExit):
        # The reader of our output has gone (typer leaves by SystemExit then).
        _drop_output()
        return BROKEN_PIPE
    except OSError as error:
        _drop_output()
        return _refuse(f"{error.filename or 'input or output'}: {error.strerror or error}")


def _drop_output() -> None:
    """Send what is still buffered for stdout nowhere, or it would fail again when the interpreter ends."""
    with suppress(OSError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _warn(message, *_place, **_more) -> None:
    print("papilla: warning:", " ".join(str(message).split()), file=sys.stderr)


def _refuse(message: str) -> int:
    print("papilla:", " ".join(message.split()), file=sys.stderr)
    return BAD_INPUT
