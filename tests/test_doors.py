"""Tests go through doors: no private name, no fake of papilla's own classes, no replaced name of papilla's own.

What a test cannot bring about from outside has a seam in `papilla.core.seams`: the clock, the free memory, other
processes and faults of a disk. A test may replace these four, and nothing else.
"""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

TESTS = Path(__file__).parent
FILES = sorted(TESTS.rglob("*.py"))
FAKES = ("SimpleNamespace", "Mock", "MagicMock", "create_autospec", "namedtuple")
"""What fakes of classes are made of."""
REPLACING = ("setattr", "delattr", "setitem", "delitem")
"""Methods of pytest's `monkeypatch` that replace what a program uses; `setenv`, `chdir` change what surrounds it."""
PUBLIC = ("_repr_html_", "_fields", "_replace", "_asdict")
"""Names with an underscore that others document for all: notebooks, and tuples with names."""
SEAMS = "seams"
"""Module of `papilla.core` whose names may be replaced."""


def walls(code: str) -> Iterator[str]:
    """Each place in a test that holds a wall: line and what it touches."""
    tree = ast.parse(code)
    own = {node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef | ast.ClassDef)}
    own |= {
        name.id
        for node in ast.walk(tree)
        if isinstance(node, ast.Assign)
        for name in ast.walk(node)
        if isinstance(name, ast.Name)
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("papilla"):
            yield from (f"{node.lineno} imports {alias.name}" for alias in node.names if private(alias.name))
        elif isinstance(node, ast.Attribute) and private(node.attr):
            root = node.value.id if isinstance(node.value, ast.Name) else ""
            if root not in ("self", "cls"):
                yield f"{node.lineno} touches {node.attr}"
        elif isinstance(node, ast.Call):
            name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
            if name in FAKES:
                yield f"{node.lineno} fakes a class by {name}"
            elif name in REPLACING and isinstance(node.func, ast.Attribute) and not of_a_seam(node):
                yield f"{node.lineno} replaces a name by {name}"


def private(name: str) -> bool:
    """Whether a name begins with one underscore, and no one documents it."""
    return name not in PUBLIC and name.startswith("_") and not name.startswith("__")


def of_a_seam(call: ast.Call) -> bool:
    """Whether a call replaces a name of the module of seams or of `sys`, such as an absent package in `sys.modules`."""
    target = call.args[0] if call.args else None
    if isinstance(target, ast.Attribute):
        target = target.value
    if isinstance(target, ast.Constant):
        return str(target.value).startswith(f"papilla.core.{SEAMS}.")
    return isinstance(target, ast.Name) and target.id in (SEAMS, "sys")


def test_tests_go_through_doors():
    found = [f"{path.relative_to(TESTS)}:{wall}" for path in FILES for wall in walls(path.read_text(encoding="utf-8"))]
    assert found == []


@pytest.mark.parametrize(
    "code",
    [
        "from papilla.fem import _press", "finger._area", "module._step()", "SimpleNamespace(a=1)", "Mock()",
        "monkeypatch.setattr(fem, 'press', f)", "monkeypatch.setattr('papilla.fem.press', f)", "patch.delattr(a, 'b')",
    ],
)  # fmt: skip
def test_the_count_finds_each_kind(code):
    assert len([*walls(code)]) == 1


@pytest.mark.parametrize(
    "code",
    [
        "monkeypatch.setenv('A', 'b')",
        "monkeypatch.setattr(seams, 'now_ns', f)",
        "self._kept = 1",
        "finger.area",
        "x.__name__",
    ],
)
def test_it_leaves_the_rest(code):
    assert [*walls(code)] == []
