"""README's Python examples run as printed, and its commands exist."""

import re
from pathlib import Path

import pytest

README = (Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8")


EXAMPLES = re.findall(r"```python\n(.*?)```", README, re.DOTALL)


def test_the_examples_are_short():
    assert EXAMPLES and all(len(example.splitlines()) <= 25 for example in EXAMPLES)


@pytest.mark.slow
def test_the_examples_run_as_printed_one_after_the_other(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    names = {"__name__": "__main__"}
    for example in EXAMPLES:
        exec(compile(example, "README.md", "exec"), names)
        assert capsys.readouterr().out.strip()


def test_the_commands_exist():
    from papilla.cli.main import app

    known = {command.callback.__name__.replace("_", "-") for command in app.registered_commands}
    known |= {group.name for group in app.registered_groups}
    blocks = "".join(re.findall(r"```\n(.*?)```", README, re.DOTALL))
    named = set(re.findall(r"^papilla ([\w-]+)", blocks, re.MULTILINE))
    assert named and named <= known
