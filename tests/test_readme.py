"""README's Python example runs as printed, and its commands exist."""

import re
from pathlib import Path

import pytest

README = (Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8")


def example() -> str:
    """The first block of Python in the README."""
    return re.search(r"```python\n(.*?)```", README, re.DOTALL).group(1)


def test_the_example_is_short():
    assert len(example().splitlines()) <= 25


@pytest.mark.slow
def test_the_example_runs_as_printed(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    exec(compile(example(), "README.md", "exec"), {"__name__": "__main__"})
    assert capsys.readouterr().out.strip()


def test_the_commands_exist():
    from papilla.cli.main import app

    known = {command.callback.__name__ for command in app.registered_commands}
    blocks = "".join(re.findall(r"```\n(.*?)```", README, re.DOTALL))
    named = set(re.findall(r"^papilla (\w+)", blocks, re.MULTILINE))
    assert named and named <= known
