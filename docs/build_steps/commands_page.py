"""The page of commands, made of the commands themselves: usage, what each does, its options and their defaults."""

import re
from pathlib import Path
from typing import Any

import typer
from pages import code, table
from pages import write as write_page

from papilla.cli.main import app

OPENING = """# Commands

`papilla COMMAND --help` shows the same in a terminal. With `--json` a command prints one JSON object on stdout and
nothing else there; messages and progress go to stderr. Exit codes: 0 done, 1 a check failed, 2 bad input (one line says
what, where and what was expected), 70 an error of papilla itself, 130 interrupted, 143 terminated.

"""


def write(folder: Path) -> None:
    """Write commands.md."""
    parts = [_of(command, f"papilla {name}") for name, command in _all(typer.main.get_command(app))]
    write_page(folder / "commands.md", OPENING + "\n".join(parts))


def _all(group: Any, before: str = "") -> list[tuple[str, Any]]:
    found = []
    for name, command in group.commands.items():
        inner = getattr(command, "commands", None)
        found += _all(command, f"{before}{name} ") if inner else [(before + name, command)]
    return found


def _of(command: Any, name: str) -> str:
    context = command.make_context(command.name, [], resilient_parsing=True)
    arguments = [one for one in command.params if one.param_type_name == "argument"]
    options = [one for one in command.params if one.param_type_name == "option" and not one.hidden]
    usage = [name, *(piece for one in arguments for piece in one.get_usage_pieces(context)), "[OPTIONS]"]
    rows = [(code(" ".join(one.get_usage_pieces(context))), "", _help(one)) for one in arguments]
    rows += [(" ".join(map(code, one.opts)), _takes(one, context), _help(one)) for one in options]
    listed = table(("option", "value", "meaning"), rows)
    return f"## {name}\n\n```text\n{' '.join(usage)}\n```\n\n{_plain(command.help)}\n\n{listed}"


def _plain(text: str | None) -> str:
    """A help text without the backslashes that keep rich from reading its brackets as markup."""
    return re.sub(r"\\(\[)", r"\1", text or "").replace("  [default", " [default")


def _takes(option: Any, context: Any) -> str:
    return "" if option.is_flag else code(option.metavar or option.display_type(ctx=context))


def _help(option: Any) -> str:
    said, default = _plain(option.help), option.default
    if option.required:
        return f"{said} **Required.**" if option.param_type_name == "option" else said
    unsaid = callable(default) or default in (None, False, (), [], "") or "[default" in said
    return said if unsaid else f"{said} [default: {default}]"
