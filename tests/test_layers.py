"""Structure: imports only go down (lazy ones counted), modules and functions stay small, no machine paths."""

import ast
import importlib
import inspect
import pkgutil
import re
import subprocess
from functools import cache
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
RECORD = sorted(path for path in (PACKAGE / "calibration").glob("*.py") if path.stem != "__init__")
"""The modules of the calibration's record, which estimators import."""
MAX_LINES, MAX_FUNCTION_LINES = 450, 75
"""As CONTRIBUTING.md says."""
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
    if f"{module}.{name}" in NAMES:
        return f"{module}.{name}"
    return lazy(module).get(name, module)


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
    return [
        f"{path.name}:{line} imports {module}"
        for module, line in imports(tree, path)
        if module.startswith(("papilla.", "papilla_papers", "benchmarks"))
        and room(module) != own
        and FLOOR.get(room(module), len(FLOORS)) >= FLOOR[own]
    ]


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
        ("from papilla.mesh import build", "papilla/model/finger.py"),
        ("from papilla import identification", "papilla/estimators/pipeline/pipeline.py"),
        ("from papilla_papers.methods import PrintedSoftness", "papilla/telepresence/cli/ends.py"),
        ("import benchmarks.peers", "papilla/cli/bench.py"),
        ("from papilla import press", "papilla/view/pictures.py"),
    ],
)
def test_the_walk_sees_an_import_that_goes_up(code, name):
    assert len(faults(ast.parse(code), ROOT / name)) == 1


LIGHT = [*RECORD, *sorted((PACKAGE / "estimators").rglob("*.py"))]


@pytest.mark.parametrize("path", LIGHT, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_estimators_and_the_record_need_no_finite_elements(path):
    assert not {module for module in reached(path) if room(module) in ("fem", "mesh")}


def test_references_need_no_finite_elements_and_the_walk_sees_some():
    for path in (PACKAGE / "references").rglob("*.py"):
        assert {room(module) for module in reached(path)} <= {"core", "references"}, path.name
    assert "papilla.fem.discrete.solver" in reached(PACKAGE / "calibration" / "fitting" / "job.py")


def test_no_circle_of_files():
    """No module imports, at its top or in a function, what imports it; packages only pass names on."""
    needed = {
        name: {module for module, _ in imports(_running(path), path)} & NAMES.keys() - {name}
        for name, path in NAMES.items()
        if path.stem != "__init__"
    }
    needed = {name: {module for module in modules if module in needed} for name, modules in needed.items()}
    assert any(needed.values())
    while leaves := [name for name, modules in needed.items() if not modules]:
        needed = {name: modules - {*leaves} for name, modules in needed.items() if name not in leaves}
    assert not needed, "these import each other, or what does"


def _running(path: Path) -> ast.AST:
    """The syntax tree of a file without what is for type checkers alone."""
    tree = ast.parse(path.read_text())
    for node in ast.walk(tree):
        if isinstance(body := getattr(node, "body", None), list):
            node.body = [line for line in body if not (isinstance(line, ast.If) and _for_types(line.test))]
    return tree


def _for_types(test: ast.expr) -> bool:
    return isinstance(test, ast.Name) and test.id == "TYPE_CHECKING"


def test_every_room_is_on_a_floor():
    rooms = {path.parent.name for path in PACKAGE.glob("*/__init__.py")}
    assert rooms | {"papilla_papers"} == FLOOR.keys()


COMMANDS = sorted(path for folder in (PACKAGE, PAPERS) for path in folder.rglob("cli/*.py"))


@pytest.mark.parametrize("path", COMMANDS, ids=lambda path: str(path.relative_to(ROOT)))
def test_command_files_import_nothing_heavy_at_the_top(path):
    tree = ast.parse(path.read_text())
    top = [node for node in tree.body if isinstance(node, ast.Import | ast.ImportFrom)]
    names = [name for node in top for name, _ in imports(ast.Module([node], []), path)]
    light = tuple(f"papilla.core.{name}" for name in ("errors", "checks", "units", "seams", "progress"))
    heavy = [name for name in names if name.split(".")[0] in HEAVY]
    ours = [name for name in names if name.startswith("papilla") and not (name.startswith(light) or ".cli" in name)]
    assert heavy + ours == []


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(ROOT)))
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
    for folder in [path.parent for package in (PACKAGE, PAPERS) for path in package.rglob("__init__.py")]:
        package = importlib.import_module(".".join(folder.relative_to(ROOT).parts))
        modules = {module.name for module in pkgutil.iter_modules([str(folder)])}
        public = modules & {*getattr(package, "__all__", ()), *(name for name in vars(package) if name[0] != "_")}
        found |= {name for name in public if not inspect.ismodule(getattr(package, name))}
    assert found == set()


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(ROOT)))
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
        own = entry.startswith("curvature") and path.stem == "specimen"
        if own or room(name_of(path)) in ("verify", "scenes", "view"):
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
