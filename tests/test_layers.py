"""Structure: imports only go down (lazy ones counted), modules and functions stay small, no machine paths."""

import ast
import importlib
import inspect
import pkgutil
import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "papilla"
MODULES = sorted([*PACKAGE.rglob("*.py"), *PACKAGE.rglob("*.pyi")])

TOP = frozenset(path.stem for path in PACKAGE.glob("*.py") if not path.stem.startswith("__"))
L0 = TOP | {"calibration", "logs", "references"}
MAY_IMPORT = {
    **{name: L0 for name in L0},
    "mesh": L0 | {"mesh"},
    "fem": L0 | {"mesh", "fem"},
    "view": L0 | {"mesh", "fem", "view"},
    "calibrate": L0 | {"mesh", "fem", "view", "calibrate"},
    "estimators": L0 | {"estimators"},
    "telepresence": L0 | {"estimators", "telepresence"},
}
MAY_IMPORT["studies"] = frozenset().union(*MAY_IMPORT.values()) | {"studies"}
MAY_IMPORT["design"] = MAY_IMPORT["calibrate"] | {"estimators", "design"}
MAY_IMPORT["cli"] = MAY_IMPORT["studies"] | {"design", "cli"}
MAX_LINES, MAX_FUNCTION_LINES = 450, 75
"""As CONTRIBUTING.md says."""
HEAVY = ("numpy", "scipy", "skfem", "pyvista", "vtk", "matplotlib", "pydantic", "meshio", "pytetwild", "rslab")


def part(path: Path) -> str:
    """The folder or top-level module of papilla that a file belongs to."""
    inside = path.relative_to(PACKAGE)
    return inside.parts[0] if len(inside.parts) > 1 else inside.stem


def imports(tree: ast.AST, path: Path):
    """Every imported module of a file, whether at the top or inside a function, with its line."""
    folder = ("papilla", *path.relative_to(PACKAGE).parts[:-1])
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from ((alias.name, node.lineno) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            above = ".".join(folder[: len(folder) - node.level + 1]) if node.level else ""
            module = ".".join(filter(None, (above, node.module)))
            if module == "papilla":
                yield from ((f"papilla.{alias.name}", node.lineno) for alias in node.names)
            else:
                yield module, node.lineno
        elif isinstance(node, ast.Call) and getattr(node.func, "attr", getattr(node.func, "id", "")) == "import_module":
            literal = [item.value for item in node.args if isinstance(item, ast.Constant)]
            yield from ((str(name), node.lineno) for name in literal)


def faults(tree: ast.AST, path: Path) -> list[str]:
    allowed = MAY_IMPORT[part(path)]
    return [
        f"{path.name}:{line} imports {module}"
        for module, line in imports(tree, path)
        if module.startswith("papilla.") and not module.startswith("papilla.__") and module.split(".")[1] not in allowed
    ]


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_imports_only_go_down(path):
    if part(path) in ("__init__", "__main__"):
        pytest.skip("the curated names and the entry point stand above all layers")
    assert part(path) in MAY_IMPORT, f"{part(path)} has no place in the layers: add it to MAY_IMPORT"
    assert faults(ast.parse(path.read_text()), path) == []


@pytest.mark.parametrize(
    "code, name",
    [
        ("import papilla.fem", "estimators/softness.py"),
        ("def f():\n    from papilla.estimators import Softness", "fem/press.py"),
        ("from papilla import view", "fem/press.py"),
        ("from ..fem import press", "mesh/build.py"),
        ("from importlib import import_module\nimport_module('papilla.cli.main')", "calibrate/sweep.py"),
        ("from papilla.mesh import build", "finger.py"),
    ],
)
def test_the_walk_sees_an_import_that_goes_up(code, name):
    assert len(faults(ast.parse(code), PACKAGE / name)) == 1


@pytest.mark.parametrize("path", sorted((PACKAGE / "cli").glob("*.py")), ids=lambda path: path.name)
def test_command_files_import_nothing_heavy_at_the_top(path):
    tree = ast.parse(path.read_text())
    top = [node for node in tree.body if isinstance(node, ast.Import | ast.ImportFrom)]
    names = [name for node in top for name, _ in imports(ast.Module([node], []), path)]
    light = ("papilla.cli", "papilla.core.errors", "papilla.core.checks", "papilla.core.units")
    heavy = [name for name in names if name.split(".")[0] in HEAVY]
    ours = [name for name in names if name.startswith("papilla") and not name.startswith(light)]
    assert heavy + ours == []


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_modules_and_functions_stay_small(path):
    text = path.read_text()
    assert text.count("\n") <= MAX_LINES
    long = [
        f"{node.name}: {node.end_lineno - node.lineno + 1} lines"
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.FunctionDef) and node.end_lineno - node.lineno >= MAX_FUNCTION_LINES
    ]
    assert long == []


def test_the_limits_are_those_of_the_map():
    said = (ROOT / "CONTRIBUTING.md").read_text()
    assert f"at most {MAX_LINES} lines; a function at most {MAX_FUNCTION_LINES}" in said


def test_a_public_name_is_not_both_function_and_module():
    """`papilla.fem.press` would be the one or the other, by what was imported before."""
    found = set()
    for folder in [PACKAGE, *(path.parent for path in PACKAGE.rglob("*/__init__.py"))]:
        package = importlib.import_module(".".join(folder.relative_to(ROOT).parts))
        modules = {module.name for module in pkgutil.iter_modules([str(folder)])}
        public = modules & {*getattr(package, "__all__", ()), *(name for name in vars(package) if name[0] != "_")}
        found |= {name for name in public if not inspect.ismodule(getattr(package, name))}
    assert found == set()


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_modules_classes_and_functions_of_the_api_are_documented(path):
    tree = ast.parse(path.read_text())
    assert ast.get_docstring(tree), "the module has no docstring"
    nodes = [*tree.body, *(item for node in tree.body if isinstance(node, ast.ClassDef) for item in node.body)]
    bare = [
        node.name
        for node in nodes
        if isinstance(node, ast.FunctionDef | ast.ClassDef)
        and not node.name.startswith("_")
        and not ast.get_docstring(node)
        and not any(getattr(item, "attr", "") == "setter" for item in node.decorator_list)
        and not _inside_private_class(tree, node)
    ]
    assert bare == []


def _inside_private_class(tree: ast.Module, node: ast.AST) -> bool:
    private = [item for item in tree.body if isinstance(item, ast.ClassDef) and item.name.startswith("_")]
    return any(node in item.body for item in private)


@pytest.mark.slow
def test_errors_are_raised_from_the_one_tree():
    """A bare builtin where a papilla error belongs would reach the user as a traceback."""
    builtin = {"Exception", "ValueError", "TypeError", "RuntimeError", "OSError", "KeyError", "FileNotFoundError"}
    found = [
        f"{path.relative_to(ROOT)}:{node.lineno}"
        for path in MODULES
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.Raise)
        and isinstance(node.exc, ast.Call)
        and isinstance(node.exc.func, ast.Name)
        and node.exc.func.id in builtin
    ]
    assert found == []


REGISTERED = {
    "curvature, what a gauge feels": ({"curvature"}, 3),
    "a sphere, a specimen": ({"sphere", "Sphere"}, 3),
    "Yeoh's rubber": ({"yeoh", "Yeoh"}, 1),
    "Ogden's rubber, with tangents of its own": ({"ogden", "Ogden"}, 2),
}
"""An entry of a registry: the strings and names that it goes by, and in how many files they may occur."""


@pytest.mark.parametrize("entry", REGISTERED)
def test_one_more_entry_of_a_registry_changes_few_files(entry):
    """Those that study or show an entry do not count: they need not know of the next one."""
    named, most = REGISTERED[entry]
    found = set()
    for path in PACKAGE.rglob("*.py"):
        # A specimen has a curvature, too
        if part(path) in ("studies", "view") or entry.startswith("curvature") and path.stem == "specimen":
            continue
        for node in ast.walk(ast.parse(path.read_text())):
            # A text, or the name of a class: a variable may be called like an entry
            word = node.value if isinstance(node, ast.Constant) else getattr(node, "id", getattr(node, "name", ""))
            if word in named and (isinstance(node, ast.Constant) or not word.islower()):
                found.add(path.relative_to(PACKAGE).as_posix())
    assert len(found) <= most, sorted(found)


def test_no_file_names_a_path_of_the_machine_that_made_it():
    listed = subprocess.run(["git", "ls-files", "-co", "--exclude-standard"], cwd=ROOT, capture_output=True, text=True)
    if listed.returncode:
        pytest.skip("not a git work tree")
    machine = re.compile(rf"(?<![\w.])/(?:{'|'.join(('home', 'root', 'work', 'tmp', 'Users', 'opt'))})/[\w.-]+")
    text_kinds = {".py", ".md", ".toml", ".lock", ".ipynb", ".html", ".csv", ".json", ""}
    found = []
    for name in listed.stdout.splitlines():
        path = ROOT / name
        if path.suffix in text_kinds and path.is_file():
            found += [f"{name}: {hit}" for hit in machine.findall(path.read_text(encoding="utf-8", errors="replace"))]
    assert found == []
