"""The command line in this process: exit code, stdout and stderr of one call."""

from typing import NamedTuple

import pytest


class Answer(NamedTuple):
    """What one call of the command line left behind."""

    code: int
    out: str
    err: str


@pytest.fixture
def papilla(capsys, monkeypatch, tmp_path):
    """Call the command line: `papilla("press", "--modulus", 0.5)`; the working directory is `tmp_path`."""
    from papilla.cli.main import run

    monkeypatch.chdir(tmp_path)

    def call(*arguments) -> Answer:
        with pytest.raises(SystemExit) as end:
            run([str(argument) for argument in arguments])
        captured = capsys.readouterr()
        return Answer(end.value.code, captured.out, captured.err)

    return call


@pytest.fixture
def refused(papilla, tmp_path):
    """Call the command line with bad input: exit 2, one line on stderr, nothing on stdout, nothing written."""

    def call(*arguments) -> str:
        before = sorted(tmp_path.rglob("*"))
        answer = papilla(*arguments)
        lines = answer.err.splitlines()
        assert (answer.code, answer.out) == (2, "") and len(lines) == 1 and lines[0].startswith("papilla: "), answer
        assert sorted(tmp_path.rglob("*")) == before
        return lines[0]

    return call
