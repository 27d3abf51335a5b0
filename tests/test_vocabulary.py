"""One word has one meaning (docs/glossary.md): names of classes and constants in all rooms, and locals that say what
they are.

Other libraries of the field have 0.2 % (scikit-fem) and 0.3 % (lmfit) vague locals.
"""

import ast
import re
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
TREES = {
    path.relative_to(ROOT).as_posix(): ast.parse(path.read_text(encoding="utf-8"))
    for room in ("papilla", "papilla_papers")
    for path in sorted((ROOT / room).rglob("*.py"))
}
VAGUE = frozenset((
    "found", "own", "told", "said", "known", "given", "one", "other", "each", "here", "there", "made", "kept",
    "left", "whole", "part", "done", "want", "shown", "held", "thing", "beside", "state", "row", "kind"
))  # fmt: skip
"""Words that do not say what a local is."""
MOST_VAGUE_SHARE = 0.015
"""Share of all locals and parameters that may have such a name."""
FIXED = frozenset({"OK"})
"""Constants of one word that are what files and users read."""


def defined(tree: ast.Module) -> Iterator[tuple[type, str]]:
    """Each public class, and each constant, of a module: the type of its definition and its name."""
    for node in tree.body:
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
            yield ast.ClassDef, node.name
        targets = (
            node.targets if isinstance(node, ast.Assign) else [node.target] if isinstance(node, ast.AnnAssign) else []
        )
        for name in (name for target in targets for name in ast.walk(target) if isinstance(name, ast.Name)):
            if re.fullmatch(r"[A-Z][A-Z0-9_]+", name.id):
                yield ast.Assign, name.id


def modules_by_name(definition: type) -> dict[str, set[str]]:
    """Name of a class or constant -> modules that define one of this name."""
    modules = defaultdict(set)
    for path, tree in TREES.items():
        for what, name in defined(tree):
            if what is definition:
                modules[name].add(path)
    return modules


def local_names() -> Iterator[str]:
    """The name of each local and parameter of each function, once a function."""
    for function in (node for tree in TREES.values() for node in ast.walk(tree)):
        if isinstance(function, ast.FunctionDef | ast.AsyncFunctionDef):
            names = {node.arg for node in ast.walk(function) if isinstance(node, ast.arg)}
            names |= {n.id for n in ast.walk(function) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)}
            yield from names


@pytest.mark.parametrize("definition", [ast.ClassDef, ast.Assign], ids=["class", "constant"])
def test_a_name_has_one_meaning(definition):
    assert {name: sorted(paths) for name, paths in modules_by_name(definition).items() if len(paths) > 1} == {}


def test_a_constant_says_quantity_and_unit():
    """Two words at least: what it is, and of what or in which unit."""
    bare = {name: sorted(paths) for name, paths in modules_by_name(ast.Assign).items() if "_" not in name}
    assert {name: paths for name, paths in bare.items() if name not in FIXED} == {}


def test_locals_say_what_they_are():
    names = list(local_names())
    assert sum(name in VAGUE for name in names) <= MOST_VAGUE_SHARE * len(names)
