"""Structure: imports only go down (lazy ones counted), modules and functions stay small, no machine paths."""

import ast
import importlib
import inspect
import pkgutil
import re
import subprocess
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGE, PAPERS = ROOT / "papilla", ROOT / "papilla_papers"
MODULES = sorted(path for folder in (PACKAGE, PAPERS) for kind in ("*.py", "*.pyi") for path in folder.rglob(kind))
FLOORS = (
    ("core",), ("references",), ("model",), ("logs", "mesh"), ("fem",), ("view", "scenes"), ("calibration",),
    ("estimators", "identification"), ("design", "verify"), ("cli",), ("telepresence",), ("papilla_papers",),
)  # fmt: skip
"""Rooms by floor, from the ground: a room imports rooms of lower floors alone."""
FLOOR = {room: number for number, rooms in enumerate(FLOORS) for room in rooms}
ABOVE_ALL = ("__init__", "__main__", "verbs")
"""Modules of papilla that are no room: the curated names, the entry point, the three verbs."""
HOUSE = ("papilla.", "papilla_papers", "benchmarks")
RECORD = sorted(path for path in (PACKAGE / "calibration").glob("*.py") if path.stem != "__init__")
"""The modules of the calibration's record, which estimators import."""
MAX_LINES, MAX_FUNCTION_LINES = 450, 75  # As CONTRIBUTING.md says
BARE_ERRORS = {"Exception", "ValueError", "TypeError", "RuntimeError", "OSError", "KeyError", "FileNotFoundError"}
HEAVY = ("numpy", "scipy", "skfem", "pyvista", "vtk", "matplotlib", "pydantic", "meshio", "pytetwild", "rslab")


def name_of(path: Path) -> str:
    """The dotted name of a module."""
    return ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


NAMES = {name_of(path): path for path in MODULES if path.suffix == ".py"}


def room(module: str) -> str:
    """The room that a module belongs to; its own name for what stands above all rooms."""
    package, _, inside = module.partition(".")
    return package if package != "papilla" else inside.partition(".")[0] or "__init__"


def imports(tree: ast.AST, path: Path):
    """Every imported module of a file, whether at the top or inside a function, with its line.

    A name that a lazy package gives stands for the module that defines it.
    """
    folder = path.relative_to(ROOT).parts[:-1]
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from ((alias.name, node.lineno) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            above = ".".join(folder[: len(folder) - node.level + 1]) if node.level else ""
            module = ".".join(filter(None, (above, node.module)))
            yield from ((home(module, alias.name), node.lineno) for alias in node.names)
        elif isinstance(node, ast.Call) and getattr(node.func, "attr", getattr(node.func, "id", "")) == "import_module":
            literal = [item.value for item in node.args if isinstance(item, ast.Constant)]
            yield from ((str(name), node.lineno) for name in literal)


def home(module: str, name: str) -> str:
    """The module that is loaded for a name of another module."""
    return f"{module}.{name}" if f"{module}.{name}" in NAMES else lazy(module).get(name, module)


@cache
def lazy(module: str) -> dict[str, str]:
    """Name -> defining module, of a package with a stub."""
    stub = (ROOT / module.replace(".", "/")) / "__init__.pyi"
    if not stub.exists():
        return {}
    nodes = [node for node in ast.parse(stub.read_text()).body if isinstance(node, ast.ImportFrom)]
    given = [(f"{module}.{node.module}", alias.name) for node in nodes if node.module for alias in node.names]
    return {name: home(place, name) for place, name in given}


def faults(tree: ast.AST, path: Path) -> list[str]:
    own = room(name_of(path))
    used = [(module, line) for module, line in imports(tree, path) if module.startswith(HOUSE)]
    above = [(module, line) for module, line in used if FLOOR.get(room(module), len(FLOORS)) >= FLOOR[own]]
    return [f"{path.name}:{line} imports {module}" for module, line in above if room(module) != own]


def reached(path: Path) -> set[str]:
    """All modules of the house that a module imports, directly or not, lazy imports counted."""
    found: set[str] = set()
    waiting = [path]
    while waiting:
        here = waiting.pop()
        named = {module for module, _ in imports(ast.parse(here.read_text()), here)} & NAMES.keys()
        waiting += [NAMES[module] for module in named - found]
        found |= named
    return found


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(ROOT)))
def test_imports_only_go_down(path):
    if room(name_of(path)) in ABOVE_ALL:
        pytest.skip("the curated names, the entry point and the verbs stand above all rooms")
    assert room(name_of(path)) in FLOOR, f"{room(name_of(path))} has no floor: add it to FLOORS"
    assert faults(ast.parse(path.read_text()), path) == []


@pytest.mark.parametrize(
    "code, name",
    [
        ("import papilla.fem", "papilla/references/hertz.py"),
        ("def f():\n    from papilla.estimators import Softness", "papilla/fem/press.py"),
        ("from papilla import view", "papilla/fem/press.py"),
        ("from ..fem import press", "papilla/mesh/build.py"),
        ("from importlib import import_module\nimport_module('papilla.cli.main')", "papilla/calibration/sweep.py"),
        ("import benchmarks.peers", "papilla/cli/bench.py"),
        ("from papilla import press", "papilla/view/pictures.py"),
    ],
)
def test_the_walk_sees_an_import_that_goes_up(code, name):
    assert len(faults(ast.parse(code), ROOT / name)) == 1


def test_estimators_and_the_record_need_no_finite_elements_and_the_walk_sees_some():
    for path in (*RECORD, *(PACKAGE / "estimators").rglob("*.py")):
        assert not {module for module in reached(path) if room(module) in ("fem", "mesh")}, path.name
    assert "papilla.fem.discrete.solver" in reached(PACKAGE / "calibration" / "fitting" / "job.py")


def test_no_circle_of_files():
    """No module imports, at its top or in a function, what imports it, but for types; packages only pass names on."""
    needed = {}
    for name, path in NAMES.items():
        tree = ast.parse(path.read_text())
        for node in ast.walk(tree):
            if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
                node.body = [ast.Pass()]
        if path.stem != "__init__":
            needed[name] = {module for module, _ in imports(tree, path)} & NAMES.keys() - {name}
    assert len(list(TopologicalSorter(needed).static_order())) > 200


@pytest.mark.parametrize(
    "path", [path for path in MODULES if path.parent.name == "cli"], ids=lambda path: str(path.relative_to(ROOT))
)
def test_command_files_import_nothing_heavy_at_the_top(path):
    tree = ast.parse(path.read_text())
    top = [node for node in tree.body if isinstance(node, ast.Import | ast.ImportFrom)]
    names = [name for node in top for name, _ in imports(ast.Module([node], []), path)]
    light = tuple(f"papilla.core.{name}" for name in ("errors", "checks", "units", "seams", "progress"))
    heavy = [name for name in names if name.split(".")[0] in HEAVY]
    ours = [name for name in names if name.startswith("papilla") and not (name.startswith(light) or ".cli" in name)]
    assert heavy + ours == []


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(ROOT)))
def test_modules_are_small_and_documented_and_raise_errors_of_papilla(path):
    text = path.read_text()
    nodes, body = [*ast.walk(ast.parse(text))], ast.parse(text).body
    assert text.count("\n") <= MAX_LINES and ast.get_docstring(ast.parse(text))
    functions = [node for node in nodes if isinstance(node, ast.FunctionDef)]
    assert [node.name for node in functions if node.end_lineno - node.lineno >= MAX_FUNCTION_LINES] == []
    public = [node for node in body if isinstance(node, ast.FunctionDef | ast.ClassDef) and node.name[0] != "_"]
    members = [item for node in public if isinstance(node, ast.ClassDef) for item in node.body]
    public += [item for item in members if isinstance(item, ast.FunctionDef) and item.name[0] != "_"]
    bare = [node for node in public if not ast.get_docstring(node)]
    assert [node.name for node in bare if "setter" not in "".join(map(ast.unparse, node.decorator_list))] == []
    raised = [node.exc.func for node in nodes if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call)]
    assert BARE_ERRORS.isdisjoint(map(ast.unparse, raised)), "it would reach the user as a traceback"


def test_a_public_name_is_not_both_function_and_module():
    """`papilla.fem.press` would be the one or the other, by what was imported before."""
    found = set()
    for folder in [path.parent for package in (PACKAGE, PAPERS) for path in package.rglob("__init__.py")]:
        package = importlib.import_module(".".join(folder.relative_to(ROOT).parts))
        modules = {module.name for module in pkgutil.iter_modules([str(folder)])}
        public = modules & {*getattr(package, "__all__", ()), *(name for name in vars(package) if name[0] != "_")}
        found |= {name for name in public if not inspect.ismodule(getattr(package, name))}
    assert found == set()


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
