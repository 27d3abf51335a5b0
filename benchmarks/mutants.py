"""Do the tests notice? Seeded faults in the code, one at a time, each against the quick tests of its package.

Run with `python benchmarks/mutants.py fem mesh --count 25`: prints the share of mutants that a test killed, and those
that survived. Every mutant runs in a copy of the tree, against the tests that reach its function, the quickest
first; a run that hangs counts as killed. `--list` shows the mutants.
"""

import argparse
import ast
import copy
import json
import os
import random
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from queue import Queue

import pytest

ROOT = Path(__file__).parents[1]
TREE = (
    "papilla",
    "tests",
    "benchmarks",
    "examples",
    "notebooks",
    "docs",
    "Makefile",
    *(file.name for file in ROOT.glob("*.*")),
)
TESTS = {
    "fem": ("tests/fem", "tests/fem_finite", "tests/fem_sliding"),
    "logs": ("tests/test_logs.py", "tests/test_logs_torque.py", "tests/test_log_map.py", "tests/logs"),
    "calibration": ("tests/test_calibration.py", "tests/calibration", "tests/calibrate/test_compact.py"),
}
"""Tests of a package, where they are not simply `tests/<package>`."""

FLIPPED = {ast.Lt: ast.GtE, ast.GtE: ast.Lt, ast.Gt: ast.LtE, ast.LtE: ast.Gt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq,
           ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn, ast.NotIn: ast.In}  # fmt: skip
SWAPPED = {ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.And: ast.Or, ast.Or: ast.And}
OPPOSITE = {"min": "max", "max": "min", "minimum": "maximum", "maximum": "minimum", "any": "all", "all": "any",
            "argmin": "argmax", "argmax": "argmin", "floor": "ceil", "ceil": "floor"}  # fmt: skip

QUICK = ("-x", "-q", "-m", "not slow", "-p", "no:cacheprovider")

EQUIVALENT: dict[tuple[str, str, str], str] = {
    ("papilla/calibration/surface.py", "0.5", "0.55"): "where a safeguarded root search starts or bisects",
    ("papilla/calibration/surface.py", "1.0", "1.1"): "a bracket that is wider than it need be",
    ("papilla/calibrate/press_table.py", "np.geomspace(0.02, 5.0, 40)", "np.geomspace(5.0, 0.02, 40)"): "sorted there",
    ("papilla/estimators/published/window.py", "place + count", "(place - count)"): "counted from the other end",
    ("papilla/estimators/published/softness.py", "101", "102"): "where a range in tens ends",
    ("papilla/estimators/published/wavelet/transform.py", "6", "7"): "zeros behind where a wavelet has died away",
    ("papilla/estimators/published/wavelet/cross.py", "cross_threshold(ones, twos, sample_rate_Hz, a.frequency_Hz)",
     "cross_threshold(twos, ones, sample_rate_Hz, a.frequency_Hz)"): "symmetric",
    ("papilla/estimators/published/roughness/stft.py", "2 * self._lines", "(2 / self._lines)"): "two ways",
    ("papilla/estimators/tracking/line_search.py", "self._place - self._place[-1]", "(self._place + self._place[-1])"):
     "the mean of each stroke is taken away",
    ("papilla/estimators/tracking/line_search.py", "1e-9", "1.1e-09"): "below any time step: keeps a quotient finite",
    ("papilla/estimators/tracking/line_search.py", "1e-12", "1.1e-12"): "below any step of a path, or next to no prior",
    ("papilla/estimators/tracking/refine.py", "1e-9", "1.1e-09"): "of a scaled matrix: keeps its inverse finite",
    ("papilla/estimators/tracking/refine.py", "1e-12", "1.1e-12"): "below any step of a path",
    ("papilla/estimators/tracking/motion_fit.py", "1e-10", "1.1e-10"): "of a scaled matrix: keeps its inverse finite",
    ("papilla/estimators/tracking/motion_fit.py", "1e-12", "1.1e-12"): "keeps a quotient finite that is cut at 1",
    ("papilla/estimators/softness/start.py", "hs[1] - hs[0]", "(hs[1] + hs[0])"): "the first is 0",
    ("papilla/estimators/softness/start.py", "1.0", "1.1"): "how far a step goes, and when the steps are short enough",
    ("papilla/fem/reduction/patch.py", "np.cross(ends[:, 1] - ends[:, 0], ends[:, 2] - ends[:, 0])",
     "np.cross(ends[:, 2] - ends[:, 0], ends[:, 1] - ends[:, 0])"): "its length and |z| alone are used",
}  # fmt: skip
"""(file, code before, code after) -> why no test could tell the two apart."""


@dataclass(frozen=True)
class Mutant:
    """One fault: the text of lines and columns `span` of a file, and what stands there instead."""

    file: str
    span: tuple[int, int, int, int]
    before: str
    after: str

    def __str__(self) -> str:
        return f"{self.file}:{self.span[0]}: {self.before}  ->  {self.after}"

    def applied(self, text: str) -> str:
        """The source with the fault in it."""
        first, start, last, end = self.span
        lines = [line.encode() for line in text.splitlines(keepends=True)]
        replaced = lines[first - 1][:start] + self.after.encode() + lines[last - 1][end:]
        return b"".join([*lines[: first - 1], replaced, *lines[last:]]).decode()


def mutants_of(path: Path) -> Iterator[Mutant]:
    """Every mutant of a file."""
    text = path.read_text()
    for node in _code(ast.parse(text)):
        for changed in _changed(node):
            before = ast.get_source_segment(text, node) or ""
            assert isinstance(node, ast.expr | ast.stmt) and node.end_lineno and node.end_col_offset
            after = ast.unparse(ast.fix_missing_locations(changed))
            if isinstance(node, ast.BinOp | ast.BoolOp | ast.Compare | ast.UnaryOp):
                after = f"({after})"
            span = (node.lineno, node.col_offset, node.end_lineno, node.end_col_offset)
            yield Mutant(path.relative_to(ROOT).as_posix(), span, before, after)


def _code(node: ast.AST, free: tuple[str, ...] = ()) -> Iterator[ast.AST]:
    """The nodes that say what is done: no annotations, imports, texts, and nothing that only raises or prints."""
    if isinstance(node, ast.Import | ast.ImportFrom | ast.JoinedStr | ast.Raise | ast.Assert):
        return
    if isinstance(node, ast.keyword) and node.arg == "strict":
        return  # a check of lengths, as an assertion is
    if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
        return
    if isinstance(node, ast.Constant | ast.UnaryOp) and ast.unparse(node) in free:
        return
    yield node
    # NumPy takes any negative length for the one that is left
    free = ("-1",) if isinstance(node, ast.Call) and getattr(node.func, "attr", "") == "reshape" else ()
    for name, value in ast.iter_fields(node):
        if name in ("annotation", "returns", "decorator_list", "type_params"):
            continue
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.AST):
                yield from _code(child, free)


def _changed(node: ast.AST) -> Iterator[ast.AST]:
    if not isinstance(node, ast.expr | ast.Return):
        return
    new = copy.deepcopy(node)
    match new:
        case ast.Compare(ops=[only]) if type(only) in FLIPPED:
            new.ops = [FLIPPED[type(only)]()]
            yield new
        case ast.BinOp(op=op) | ast.BoolOp(op=op) if type(op) in SWAPPED and not _text(new):
            new.op = SWAPPED[type(op)]()
            yield new
        case ast.UnaryOp(op=ast.Not() | ast.USub()):
            yield new.operand
        case ast.Constant(value=bool()):
            new.value = not new.value
            yield new
        case ast.Constant(value=int()):
            new.value += 1
            yield new
        # What keeps a quotient finite, as 1e-300, does so a tenth greater as well.
        case ast.Constant(value=float()) if 1e-100 < new.value < 1e100:
            new.value = float(f"{1.1 * new.value:.12g}")
            yield new
        case ast.Call(func=ast.Name(id=name)) if name in OPPOSITE:
            new.func.id = OPPOSITE[name]
            yield new
        case ast.Call(func=ast.Attribute(attr=name)) if name in OPPOSITE:
            new.func.attr = OPPOSITE[name]
            yield new
        # A hypotenuse has no first side.
        case ast.Call(args=[first, second, *rest]) if ast.dump(first) != ast.dump(second) and _name(new) != "hypot":
            if not any(isinstance(one, ast.Starred) for one in (first, second)):
                new.args = [second, first, *rest]
                yield new
        case ast.Return(value=ast.Tuple(elts=[first, second, *rest])) if ast.dump(first) != ast.dump(second):
            new.value.elts = [second, first, *rest]
            yield new


def _name(call: ast.Call) -> str:
    return getattr(call.func, "attr", getattr(call.func, "id", ""))


def _text(node: ast.AST) -> bool:
    return any(isinstance(part, ast.JoinedStr) or isinstance(getattr(part, "value", None), str)
               for part in ast.walk(node) if isinstance(part, ast.JoinedStr | ast.Constant))  # fmt: skip


def drawn(package: str, count: int, seed: int) -> list[Mutant]:
    """`count` mutants of a package, the same for the same seed and code, without those known to change nothing."""
    source = ROOT / "papilla" / package
    files = sorted(source.rglob("*.py")) if source.is_dir() else [source.with_suffix(".py")]
    every = [one for path in files for one in mutants_of(path) if (one.file, one.before, one.after) not in EQUIVALENT]
    return random.Random(f"{package} {seed}").sample(every, min(count, len(every)))


class Reached:
    """A plugin of pytest: which functions of the tree each test calls, itself or in its fixtures, and for how long."""

    def __init__(self, tree: Path):
        self.own: dict[str, set[str]] = {}
        self.fixtures: dict[str, set[str]] = {}
        self.tests: list[tuple[float, str, list[str]]] = []
        self.source, self.now = f"{tree}{os.sep}", set[str]()

    def see(self, frame, event, _):
        """As a trace function: notes each call."""
        if (name := frame.f_code.co_filename).startswith(self.source):
            self.now.add(f"{name[len(self.source) :]}:{frame.f_code.co_firstlineno}")

    def pytest_runtest_protocol(self, item):
        """Notes what follows for this test."""
        self.now = self.own[item.nodeid] = set()

    @pytest.hookimpl(wrapper=True)
    def pytest_fixture_setup(self, fixturedef):
        """Notes what a fixture calls for all tests that use it."""
        test, self.now = self.now, self.fixtures.setdefault(fixturedef.argname, set())
        try:
            return (yield)
        finally:
            self.now = test

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_call(self, item):
        """Notes the time."""
        started = time.perf_counter()
        try:
            return (yield)
        finally:
            self.tests.append((time.perf_counter() - started, item.nodeid, list(item.fixturenames)))

    def by_function(self) -> dict[str, list[str]]:
        """Each "file:line" of a function, and each file -> the tests that reach it, the quickest first."""
        found: dict[str, list[str]] = {}
        for _, test, names in sorted(self.tests):
            functions = self.own[test].union(*(self.fixtures.get(name, ()) for name in names))
            for place in functions | {function.partition(":")[0] for function in functions}:
                found.setdefault(place, []).append(test)
        return found


def reached(package: str, tree: Path) -> dict[str, list[str]]:
    """The tests that reach each function of a package; ends here where they fail without any fault."""
    known = TESTS.get(package, (f"tests/{package}", f"tests/test_{package}.py"))
    places = [place for place in known if (ROOT / place).exists()]
    code = (
        "import json, sys, threading; sys.path.insert(0, 'benchmarks'); import pytest; from pathlib import Path; "
        "from mutants import QUICK, Reached; plugin = Reached(Path.cwd()); "
        "sys.settrace(plugin.see); threading.settrace(plugin.see); "
        "failed = pytest.main([*QUICK, *sys.argv[1:]], [plugin]); sys.settrace(None); "
        "Path('reached.json').write_text(json.dumps(plugin.by_function())); sys.exit(failed)"
    )
    done = subprocess.run([sys.executable, "-c", code, *places], cwd=tree, env=_environment(tree), capture_output=True)
    if done.returncode:
        raise SystemExit(f"{package}: its tests fail without a fault\n{done.stdout.decode()[-2000:]}")
    return {"": places} | json.loads((tree / "reached.json").read_text())


def tests_of(mutant: Mutant, tests: dict[str, list[str]]) -> list[str]:
    """The tests that reach the mutant's function, or, of a constant, its file; all where none does (a child's code)."""
    inside = [
        min([node.lineno, *(one.lineno for one in node.decorator_list)])
        for node in ast.walk(ast.parse((ROOT / mutant.file).read_text()))
        if isinstance(node, ast.FunctionDef) and node.body[0].lineno <= mutant.span[0] <= (node.end_lineno or 0)
    ]
    place = f"{mutant.file}:{max(inside)}" if inside else mutant.file
    return tests.get(place, tests[""])


def _environment(tree: Path) -> dict[str, str]:
    one_thread = {name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "RAYON_NUM_THREADS")}
    return os.environ | one_thread | {"PYTHONPATH": str(tree), "PYTHONDONTWRITEBYTECODE": "1"}


def survives(mutant: Mutant, tests: list[str], tree: Path, timeout: float) -> bool:
    """Whether all of these tests pass with the fault in the copy `tree`, which is as before afterwards."""
    target = tree / mutant.file
    sound = target.read_text()
    target.write_text(mutant.applied(sound))
    try:
        done = subprocess.run([sys.executable, "-m", "pytest", *QUICK, *tests], cwd=tree, env=_environment(tree),
                              timeout=timeout, capture_output=True)  # fmt: skip
        return done.returncode == 0
    except subprocess.TimeoutExpired:
        return False
    finally:
        target.write_text(sound)


def main() -> None:
    """Draw, run, and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("packages", nargs="*", default=["fem", "mesh", "calibrate", "calibration"])
    parser.add_argument("--count", type=int, default=25, help="mutants of each package")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--workers", type=int, default=1, help="copies of the tree that are tested at a time")
    parser.add_argument("--timeout", type=float, default=600.0, help="seconds")
    parser.add_argument("--list", action="store_true", help="show the mutants and run nothing")
    chosen = parser.parse_args()
    plan = [(package, one) for package in chosen.packages for one in drawn(package, chosen.count, chosen.seed)]
    if chosen.list:
        for package, one in plan:
            print(f"{package}: {one}")
        return
    with tempfile.TemporaryDirectory() as folder:
        trees: Queue[Path] = Queue()
        for number in range(chosen.workers):
            trees.put(copied(Path(folder) / str(number)))

        tests = {package: reached(package, Path(folder) / "0") for package in chosen.packages}

        def run(item: tuple[str, Mutant]) -> bool:
            tree = trees.get()
            try:
                alive = survives(item[1], tests_of(item[1], tests[item[0]]), tree, chosen.timeout)
            finally:
                trees.put(tree)
            print(f"{item[0]}: {'SURVIVED' if alive else 'killed'}  {item[1]}", flush=True)
            return alive

        with ThreadPoolExecutor(chosen.workers) as pool:
            alive = dict(zip(plan, pool.map(run, plan), strict=True))
    for package in chosen.packages:
        own = [alive[item] for item in plan if item[0] == package]
        print(f"{package}: {own.count(False)} of {len(own)} killed ({100 * own.count(False) / len(own):.0f} %)")


def copied(tree: Path) -> Path:
    """A copy of what the tests need, without the compiled files."""
    tree.mkdir()
    for name in TREE:
        if (ROOT / name).is_dir():
            shutil.copytree(ROOT / name, tree / name, ignore=shutil.ignore_patterns("__pycache__"))
        elif (ROOT / name).exists():
            shutil.copy(ROOT / name, tree / name)
    return tree


if __name__ == "__main__":
    main()
