"""How large the packages are: lines of code and literal numbers, a row a room.

`python benchmarks/size.py [--root DIR] [--per-file]`

A line of code is one that holds a token which is neither comment nor docstring. A literal number is one in a function,
a class or a module, but 0, 1, -1, 2 and 1/2; those of `references`, `units`, `materials` and of tables of published
values are counted apart, for they are what these modules are there for.
"""

import argparse
import ast
import io
import tokenize
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path

PLAIN = (0, 1, -1, 2, 0.5)
"""Numbers that need no reason."""

REFERENCE = ("references", "units.py", "materials.py", "published")
"""Rooms and parts of file names whose numbers are constants of nature, units or printed values."""

PACKAGES = ("papilla", "papilla_papers", "benchmarks")

SILENT = (tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER)


def code_lines(source: str) -> int:
    """Lines of a module's source that are neither blank nor comment nor docstring."""
    lines = {
        line
        for token in tokenize.generate_tokens(io.StringIO(source).readline)
        if token.type not in SILENT
        for line in range(token.start[0], token.end[0] + 1)
    }
    return len(lines - {line for text in _docstrings(ast.parse(source)) for line in text})


def literals(source: str) -> int:
    """Literal numbers of a module's source that are not `PLAIN`."""
    numbers = (node.value for node in ast.walk(ast.parse(source)) if isinstance(node, ast.Constant))
    return sum(type(value) in (int, float, complex) and value not in PLAIN for value in numbers)


def room_of(parts: Sequence[str]) -> str:
    """The room of a file or module: a folder of papilla, papilla for what stands beside them, or another package."""
    return parts[1] if parts[0] == "papilla" and len(parts) > 2 else parts[0]


def _docstrings(tree: ast.AST) -> Iterator[range]:
    """Lines of every string that stands alone: docstrings, and the sentences below constants."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            yield range(node.lineno, (node.end_lineno or node.lineno) + 1)


def main() -> None:
    """Count and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--root", type=Path, default=Path(__file__).parents[1])
    parser.add_argument("--per-file", action="store_true", help="a row a file")
    options = parser.parse_args()
    files, lines, numbers, apart = Counter[str](), Counter[str](), Counter[str](), Counter[str]()
    paths = sorted(path for package in PACKAGES for path in (options.root / package).rglob("*.py"))
    for path in paths:
        inside, source = path.relative_to(options.root), path.read_text(encoding="utf-8")
        room = str(inside) if options.per_file else room_of(inside.parts)
        files[room] += 1
        lines[room] += code_lines(source)
        known = any(part in str(inside) for part in REFERENCE)
        (apart if known else numbers)[room] += literals(source)
    print(f"{'room':<44} {'files':>5} {'code':>6} {'literals':>8} {'of tables':>9}")
    for room in sorted(files, key=lambda room: -lines[room]):
        print(f"{room:<44} {files[room]:>5} {lines[room]:>6} {numbers[room]:>8} {apart[room]:>9}")
    whole = (sum(count.values()) for count in (files, lines, numbers, apart))
    print("{:<44} {:>5} {:>6} {:>8} {:>9}".format("in all", *whole))


if __name__ == "__main__":
    main()
