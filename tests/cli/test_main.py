"""Help, version, exit codes: every way in which a command can end."""

import errno
import os
import shlex
import subprocess
import sys

import pytest

from papilla.cli import main
from papilla.core import seams
from papilla.core.errors import PapillaError


@pytest.mark.parametrize("arguments", [[], ["--help"], ["-h"]])
def test_help_names_every_command(papilla, arguments):
    answer = papilla(*arguments)
    assert answer.code == 0 and answer.err == ""
    for command in main.app.registered_commands:
        assert f" {command.callback.__name__.replace('_', '-')} " in answer.out


@pytest.mark.parametrize("command", main.app.registered_commands, ids=lambda command: command.callback.__name__)
def test_every_command_explains_itself_and_speaks_json(papilla, command):
    answer = papilla(command.callback.__name__.replace("_", "-"), "--help")
    assert answer.code == 0
    assert "--json" in answer.out


def test_help_shows_defaults_that_are_words(papilla):
    shown = " ".join(papilla("press", "--help").out.replace("│", " ").split())
    for words in ("[default: default]", "[default: unknown, stick most likely]", "of the finger, else 10]"):
        assert words in shown


@pytest.mark.parametrize(
    "asked",
    [
        {"_PAPILLA_COMPLETE": "complete_bash", "COMP_WORDS": "papilla view --scr", "COMP_CWORD": "2"},
        {"_PAPILLA_COMPLETE": "complete_zsh", "_TYPER_COMPLETE_ARGS": "papilla view --scr"},
    ],
    ids=["bash", "zsh"],
)
def test_a_shell_completes_options(asked):
    done = run(env={**os.environ, **asked})
    assert done.returncode == 0 and "--screenshot" in done.stdout, done.stderr


def test_version(papilla):
    from papilla import __version__

    assert papilla("--version").out == f"papilla {__version__}\n"


@pytest.fixture
def ending(monkeypatch, papilla, tmp_path):
    """Let a command end with an error at the moment when its file is put in its place."""

    def call(error: BaseException):
        def fail(source, target):
            raise error

        (tmp_path / "log.csv").write_text("t_s,g1\n0,1\n1,2\n2,3\n")
        monkeypatch.setattr(seams, "replace", fail)
        answer = papilla("log", "map", "log.csv", "--out", "m.toml", "--json")
        assert [path.name for path in tmp_path.iterdir()] == ["log.csv"], "nothing is half-written"
        return answer

    return call


@pytest.mark.parametrize(
    "error, code, line",
    [
        (PapillaError("first\nsecond"), 2, "papilla: first second\n"),
        (MemoryError("no 9 GiB"), 2, "papilla: not enough memory for this job (no 9 GiB)\n"),
        (MemoryError(), 2, "papilla: not enough memory for this job (no detail)\n"),
        (OSError(errno.ENOSPC, "No space left"), 2, "papilla: cannot write m.toml: No space left\n"),
        (KeyboardInterrupt(), 130, "papilla: interrupted\n"),
        (SystemExit(1), 141, ""),
    ],
)  # fmt: skip
def test_every_end_has_its_code_and_line(ending, error, code, line):
    answer = ending(error)
    assert (answer.code, answer.out, answer.err.splitlines(keepends=True)[-1:]) == (code, "", [line] if line else [])


def test_a_fault_of_papilla_itself_is_one_line_and_a_code_of_its_own(ending, monkeypatch):
    answer = ending(ZeroDivisionError("division by zero"))
    assert (answer.code, answer.out) == (70, "")
    last = answer.err.splitlines()[-1]
    assert last.startswith("papilla: internal error: ZeroDivisionError: division by zero (test_main.py, line ")
    monkeypatch.setenv(main.TRACEBACK_VARIABLE, "1")
    assert "Traceback (most recent call last)" in ending(ZeroDivisionError()).err


def run(*arguments, **options) -> subprocess.CompletedProcess:
    """The command line in a process of its own."""
    options = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True, "encoding": "utf-8"} | options
    return subprocess.run([sys.executable, "-m", "papilla", *map(str, arguments)], **options)


def in_shell(line, folder):
    """The command line in a process of its own, with streams as a POSIX shell sets them up."""
    command = ["sh", "-c", f"{shlex.quote(sys.executable)} -m papilla {line}"]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True)


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="streams of a POSIX shell")
@pytest.mark.parametrize("closed", ["<&-", ">&-", "2>&-", ">&- 2>&-", "<&- >&- 2>&-"])
def test_closed_streams_are_an_error_only_for_an_answer_that_they_should_take(tmp_path, closed):
    for arguments, code in (("--version", 2 if ">&-" in closed.replace("2>&-", "") else 0), ("dance", 2)):
        done = in_shell(f"{arguments} {closed}", tmp_path)
        assert done.returncode == code, done.stderr
        assert len(done.stderr.splitlines()) == (code == 2 and "2>&-" not in closed), done.stderr


@pytest.mark.slow
@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs a device that is always full")
@pytest.mark.parametrize("lost", [">&-", "> /dev/full"])
@pytest.mark.parametrize("asked", ["--out -", "--out e.csv --json", "--out e.csv"])
def test_an_answer_that_standard_output_does_not_take_is_one_line(tmp_path, asked, lost):
    (tmp_path / "log.csv").write_text("t_s,g1\n" + "".join(f"{k / 1e3},{k % 7}\n" for k in range(300)))
    done = in_shell(f"estimate log.csv {asked} {lost}", tmp_path)
    assert done.returncode == 2 and done.stdout == ""
    (line,) = [line for line in done.stderr.splitlines() if line.startswith("papilla:")]
    assert ("standard output is closed" if lost == ">&-" else "No space left on device") in line
    assert "Traceback" not in done.stderr and "Exception ignored" not in done.stderr


@pytest.mark.skipif(os.name != "posix", reason="streams of a POSIX shell")
def test_a_closed_stdout_does_not_lead_into_a_file(tmp_path):
    """The first file that is opened would get the number of stdout, and what is printed would go into it."""
    (tmp_path / "log.csv").write_text("t_s,g1\n0,1\n1,2\n")
    written = {}
    for lost in ("", ">&-"):
        in_shell(f"log map log.csv --out map.toml {lost}", tmp_path)
        written[lost] = (tmp_path / "map.toml").read_bytes()
    assert written[">&-"] == written[""]


def test_control_characters_do_not_reach_the_terminal(capsys):
    from papilla.cli import output

    hostile = "a\x1b[31m\x9b2J\u202e[bold]b[/]  c\r\nd"
    output.say(hostile)
    output.tell(hostile)
    output.print_table([(hostile, "1", "")])
    shown = capsys.readouterr()
    for text in (shown.err, *shown.out.splitlines()):
        assert all(sign.isprintable() or sign == "\n" for sign in text)
    assert shown.err == "a\\x1b[31m\\x9b2J\\u202e[bold]b[/]  c d\n" == shown.out.splitlines(keepends=True)[0]
    assert "[bold]b[/]" in shown.out.splitlines()[1 if "[bold]" in shown.out.splitlines()[1] else 2]


def test_a_nul_in_an_argument_is_one_line(refused):
    assert "NUL" in refused("press", "--modulus", 1, "--force", 1, "--finger", "a\0b")


@pytest.mark.skipif(os.name != "posix", reason="pipes of a POSIX shell")
def test_a_reader_that_leaves_early_is_no_error():
    read, write = os.pipe()
    os.close(read)
    done = subprocess.run(
        [sys.executable, "-m", "papilla", "--version"], stdout=write, stderr=subprocess.PIPE, text=True
    )
    os.close(write)
    assert (done.returncode, done.stderr) == (141, "")
