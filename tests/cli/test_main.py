"""Help, version, exit codes: every way in which a command can end."""

import errno
import os
import subprocess
import sys

import pytest

from papilla.cli import main
from papilla.errors import PapillaError


@pytest.fixture
def ending(monkeypatch, papilla):
    """Let the application end with an error, and see what becomes of it."""

    def call(error: BaseException):
        def fail(*_, **__):
            raise error

        monkeypatch.setattr(main, "app", fail)
        return papilla()

    return call


@pytest.mark.parametrize("arguments", [[], ["--help"], ["-h"]])
def test_help_names_every_command(papilla, arguments):
    answer = papilla(*arguments)
    assert answer.code == 0 and answer.err == ""
    for command in main.app.registered_commands:
        assert f" {command.callback.__name__} " in answer.out


@pytest.mark.parametrize("command", main.app.registered_commands, ids=lambda command: command.callback.__name__)
def test_every_command_explains_itself_and_speaks_json(papilla, command):
    answer = papilla(command.callback.__name__, "--help")
    assert answer.code == 0
    assert "--json" in answer.out


def test_version(papilla):
    from papilla import __version__

    assert papilla("--version").out == f"papilla {__version__}\n"


@pytest.mark.parametrize(
    "arguments, message",
    [
        (["dance"], "No such command 'dance'"),
        (["press", "--modulos", "1"], "No such option: --modulos"),
        (["press"], "Missing option '--modulus'"),
        (["press", "--modulus", "soft"], "Invalid value for '--modulus'"),
    ],
)
def test_usage_errors_are_one_line(refused, arguments, message):
    assert message in refused(*arguments)


@pytest.mark.parametrize(
    "error, line",
    [
        (PapillaError("first\nsecond"), "papilla: first second\n"),
        (MemoryError("cannot allocate 9 GiB"), "papilla: not enough memory for this job (cannot allocate 9 GiB)\n"),
        (OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), "out.csv"), "papilla: out.csv: No space left on device\n"),
    ],
)
def test_expected_errors_are_one_line_and_exit_2(ending, error, line):
    answer = ending(error)
    assert (answer.code, answer.out, answer.err) == (2, "", line)


def test_interrupted_is_130(ending):
    assert ending(KeyboardInterrupt()).code == 130


def test_a_fault_of_papilla_itself_is_not_disguised(monkeypatch):
    def fail(*_, **__):
        raise ZeroDivisionError

    monkeypatch.setattr(main, "app", fail)
    with pytest.raises(ZeroDivisionError):
        main.run([])


@pytest.mark.skipif(os.name != "posix", reason="pipes of a POSIX shell")
def test_a_reader_that_leaves_early_is_no_error():
    read, write = os.pipe()
    os.close(read)
    done = subprocess.run(
        [sys.executable, "-m", "papilla", "--version"], stdout=write, stderr=subprocess.PIPE, text=True
    )
    os.close(write)
    assert (done.returncode, done.stderr) == (141, "")


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs a device that is always full")
def test_a_full_output_is_one_line():
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            [sys.executable, "-m", "papilla", "--version"], stdout=full, stderr=subprocess.PIPE, text=True
        )
    assert done.returncode == 2
    assert done.stderr == "papilla: input or output: No space left on device\n"
