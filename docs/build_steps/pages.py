"""What the generated pages share: docstrings as Markdown, tables, and files that change only if their text does."""

import inspect
import re
from collections.abc import Iterable, Sequence
from pathlib import Path

_NAMES = r"\*{0,2}[A-Za-z]\w*(?:, \*{0,2}[A-Za-z]\w*)*"
_ITEM = re.compile(rf"^({_NAMES}) : ", re.MULTILINE)
_NEXT_ITEM = re.compile(rf"(?<=[.;)]) (?={_NAMES} : )")
_RULED = re.compile(r"^(\w[\w ]*)\n-{3,}\n", re.MULTILINE)
_EXAMPLE = re.compile(r"((?:^(?:>>>|\.\.\.) .*\n?)+)", re.MULTILINE)


def markdown(docstring: str | None) -> str:
    """A docstring as Markdown: "name : text" is an item of a list, an underlined word a bold one, ">>> " an example."""
    text = _RULED.sub(r"**\1**\n\n", inspect.cleandoc(docstring or ""))
    parts = [_items(part) if _ITEM.match(part) else part for part in text.split("\n\n")]
    return _EXAMPLE.sub(r"```python\n\1\n```\n", "\n\n".join(parts))


def _items(paragraph: str) -> str:
    """A paragraph of "name : text" as a list, whether each stands on its own line or follows a full stop."""
    starts = [found.start() for found in _ITEM.finditer(paragraph)]
    joined = [" ".join(paragraph[a:b].split()) for a, b in zip(starts, [*starts[1:], None], strict=True)]
    items = [item.split(" : ", 1) for line in joined for item in _NEXT_ITEM.split(line)]
    return "\n".join(f"- {', '.join(map(code, names.split(', ')))}: {said}" for names, said in items)


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A Markdown table; bars inside cells are escaped."""
    written = [head, ["---"] * len(head), *([_cell(one) for one in row] for row in rows)]
    return "\n".join("| " + " | ".join(row) + " |" for row in written) + "\n"


def _cell(text: str) -> str:
    return " ".join(str(text).split()).replace("|", r"\|")


def code(value: object) -> str:
    """Text in a code span, empty for none."""
    return f"`{value}`" if str(value) else ""


def write(path: Path, text: str) -> None:
    """Write a page if its text has changed, so that Sphinx reads again only what it must."""
    path.parent.mkdir(parents=True, exist_ok=True)
    if not path.is_file() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")
