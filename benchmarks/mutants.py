"""Do the tests notice? Seeded faults in the code, one at a time, each against the tests of its package.

Run with `python benchmarks/mutants.py fem mesh --count 25`: prints the share of mutants that a quick test killed, with
`--slow` any test, and those that survived. `--list` shows the mutants.

Every mutant runs in a copy of the tree, against the tests that reach its function, the quickest first, until one
fails or they have taken `SHARE_S`; a mutant that is not found by then counts as survived. First all tests of the
package run without a fault, traced: this gives the functions that a test reaches, its time, and a cache of results that
later runs start from. A second run, the quickest first, is the control: it must pass. A result is cached under the code
that computes it, so a mutant of this code computes it again. Meshes are the exception (their key has no code): every
run makes them again. A run that takes far longer than without the fault is stopped; it counts as killed, and the
summary says how many. All times are processor times, so that other work on the machine changes nothing.
"""

import argparse
import ast
import copy
import cProfile
import json
import math
import multiprocessing
import os
import random
import re
import resource
import shutil
import signal
import sys
import tempfile
import threading
from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import accumulate
from pathlib import Path
from types import CodeType

import pytest

ROOT = Path(__file__).parents[1]
TREE = (
    "papilla",
    "papilla_papers",
    "tests",
    "benchmarks",
    "examples",
    "notebooks",
    "docs",
    "Makefile",
    *(file.name for file in ROOT.glob("*.*") if file.is_file()),
)
TESTS = {"papilla_papers": ("tests/papers",), "mesh": ("tests/mesh", "tests/fem/sliding/test_section_mesh.py")}
"""Tests of a room, where they are not simply `tests/<room>`."""

FLIPPED = {ast.Lt: ast.GtE, ast.GtE: ast.Lt, ast.Gt: ast.LtE, ast.LtE: ast.Gt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq,
           ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn, ast.NotIn: ast.In}  # fmt: skip
SWAPPED = {ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.And: ast.Or, ast.Or: ast.And}
OPPOSITE = {"min": "max", "max": "min", "minimum": "maximum", "maximum": "minimum", "any": "all", "all": "any",
            "argmin": "argmax", "argmax": "argmin", "floor": "ceil", "ceil": "floor"}  # fmt: skip

CACHE = "papilla-cache"  # The folder of tests/conftest.py that keeps results for a session

SHARE_S = 30.0  # Processor time (s) of the tests that a mutant runs against
LIMIT_S, LIMIT_TIMES = 60.0, 3.0
"""Tests are stopped after this processor time (s), and so many times the time they take without a fault, traced. The
first leaves room for cached results that are computed anew; a loop without end should not take an hour."""

WAIT_TIMES = 10.0  # Tests that only wait are stopped after so many times this limit

PROCESSES = multiprocessing.get_context("forkserver")
"""Processes that begin with the libraries imported, but not papilla."""

PROCESSES.set_forkserver_preload(
    ["numpy", "scipy.interpolate", "scipy.optimize", "scipy.signal", "scipy.sparse.linalg", "scipy.spatial",
     "scipy.stats", "skfem", "pydantic", "msgspec", "meshio", "matplotlib.pyplot", "typer", "rich.console", "pytest"]
)  # fmt: skip

STARTERS = ("papilla/mesh/child.py", "papilla/core/workers.py")  # They start processes, in which nothing is traced
EVERY = "tests/conftest.py"  # A file that all tests reach

OPTIONS = ("-x", "-q", "-p", "no:cacheprovider")

EQUIVALENT: dict[tuple[str, str, str], str] = {
    ("papilla/calibration/surface.py", "0.5", "0.55"): "where a safeguarded root search starts or bisects",
    ("papilla/calibration/surface.py", "1.0", "1.1"): "a bracket that is wider than it need be",
    ("papilla/calibration/surface.py", "1e-16", "1.1e-16"): "below the rounding at which a search stops",
    ("papilla/calibration/fitting/sweep.py", "np.geomspace(0.02, 5.0, 40)", "np.geomspace(5.0, 0.02, 40)"): "sorted",
    ("papilla/identification/one_touch.py", "1e-9", "1.1e-09"): "any ratio next to 1 keeps two times of a series apart",
    ("papilla_papers/methods/window.py", "place + count", "(place - count)"): "counted from the other end",
    ("papilla_papers/methods/softness.py", "101", "102"): "where a range in tens ends",
    ("papilla_papers/methods/wavelet/cross.py", "6", "7"): "zeros behind where a wavelet has died away",
    ("papilla_papers/methods/wavelet/cross.py", "1e-6", "1.1e-06"): "a bracket that is wider than it need be",
    ("papilla_papers/methods/wavelet/cross.py", "cross_threshold(ones, twos, sample_rate_Hz, a.frequency_Hz)",
     "cross_threshold(twos, ones, sample_rate_Hz, a.frequency_Hz)"): "symmetric",
    ("papilla_papers/methods/roughness/spectra.py", "2 * self._lines", "(2 / self._lines)"): "two ways",
    ("papilla/estimators/wavelength/refine.py", "self._place - self._place[-1]", "(self._place + self._place[-1])"):
     "the mean of each stroke is taken away",
    ("papilla/estimators/wavelength/refine.py", "1e-9", "1.1e-09"): "of a scaled matrix: keeps its inverse finite",
    ("papilla/estimators/wavelength/refine.py", "1e-12", "1.1e-12"): "below any step of a path, or next to no prior",
    ("papilla/estimators/wavelength/motion_fit.py", "1e-10", "1.1e-10"): "of a scaled matrix: keeps its inverse finite",
    ("papilla/estimators/softness/touch_start.py", "hs[1] - hs[0]", "(hs[1] + hs[0])"): "the first is 0",
    ("papilla/estimators/softness/touch_start.py", "1.0", "1.1"):
     "how far a step goes, and when the steps are short enough",
    ("papilla/telepresence/loop.py", "2**SESSION_BITS + number", "(2 ** SESSION_BITS - number)"):
     "any two large numbers will do",
    ("papilla/mesh/section.py", "across[:-1] + across[1:] < 0", "(across[:-1] + across[1:] >= 0)"):
     "the other diagonal of each cell: mirrored as well, and no worse",
    ("papilla/fem/reduction/patch.py", "np.cross(ends[:, 1] - ends[:, 0], ends[:, 2] - ends[:, 0])",
     "np.cross(ends[:, 2] - ends[:, 0], ends[:, 1] - ends[:, 0])"): "its length and |z| alone are used",
    ("papilla/fem/reduction/patch.py", "1e-12", "1.1e-12"): "below the rounding of any gap",
    ("papilla/fem/reduction/patch.py", "points * image", "(points / image)"): "signs",
    ("papilla/fem/reduction/compliance.py", "12", "13"): "the next grid of points that is tried",
    ("papilla/fem/reduction/compliance.py", "points[checked] * image", "(points[checked] / image)"): "signs",
    ("papilla/fem/reduction/gauges.py", "np.linspace(-0.5, 0.5, n)", "np.linspace(0.5, -0.5, n)"): "another order",
    ("papilla/fem/sliding/section.py", "ddot(sym_grad(u), sym_grad(v))", "ddot(sym_grad(v), sym_grad(u))"):
     "symmetric",
    ("papilla/fem/fields.py", "np.outer(signs, mirror)", "np.outer(mirror, signs)"): "one is a multiple of the other",
    ("papilla/fem/fields.py", "cell_pressure[cell_number[here]] * signs[2]",
     "(cell_pressure[cell_number[here]] / signs[2])"): "a sign",
    ("papilla/fem/pressing/off_apex.py", "1.0", "1.1"): "where the slope of the skin is differenced",
    ("papilla/fem/pressing/contact.py", "math.log(specimen.modulus) / ORDER_STEP",
     "(math.log(specimen.modulus) * ORDER_STEP)"): "the step is 1",
    ("papilla/fem/pressing/contact.py", "1.0", "1.1"): "which order of nodes is tried first",
    ("papilla/fem/pressing/contact.py", "1.05", "1.155"): "how far a path is computed beyond what is asked",
    ("papilla/fem/pressing/contact_path.py", "24", "25"): "with how many nodes a path begins, and when it gives up",
    ("papilla/fem/pressing/contact_step.py", "4", "5"): "when single nodes begin to change sets",
    ("papilla/scenes/parts.py", "np.clip(1 + depth * waver, least, None)", "np.clip(least, 1 + depth * waver, None)"):
     "the greater of two",
    ("papilla/view/plots.py", "_nearest(moduli, modulus)", "_nearest(modulus, moduli)"): "a distance",
    ("papilla_papers/claims/experiments/softness.py", "1e-9", "1.1e-09"): "above the rounding of two same answers",
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
    lines = [line.encode() for line in text.splitlines(keepends=True)]
    for node in _code(ast.parse(text)):
        for changed in _changed(node):
            assert isinstance(node, ast.expr | ast.stmt) and node.end_lineno and node.end_col_offset
            after = ast.unparse(ast.fix_missing_locations(changed))
            if isinstance(node, ast.BinOp | ast.BoolOp | ast.Compare | ast.UnaryOp):
                after = f"({after})"
            span = (node.lineno, node.col_offset, node.end_lineno, node.end_col_offset)
            first, start, last, end = span
            part = [*lines[first - 1 : last - 1], lines[last - 1][:end]]
            before = b"".join([part[0][start:], *part[1:]]).decode()
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
    new = copy.copy(node)
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
            new.func = ast.Name(OPPOSITE[name], ast.Load())
            yield new
        case ast.Call(func=ast.Attribute(attr=name)) if name in OPPOSITE:
            new.func = ast.Attribute(new.func.value, OPPOSITE[name], ast.Load())
            yield new
        # A hypotenuse has no first side.
        case ast.Call(args=[first, second, *rest]) if ast.dump(first) != ast.dump(second) and _name(new) != "hypot":
            if not any(isinstance(one, ast.Starred) for one in (first, second)):
                new.args = [second, first, *rest]
                yield new
        case ast.Return(value=ast.Tuple(elts=[first, second, *rest])) if ast.dump(first) != ast.dump(second):
            new.value = ast.Tuple([second, first, *rest], ast.Load())
            yield new


def _name(call: ast.Call) -> str:
    return getattr(call.func, "attr", getattr(call.func, "id", ""))


def _text(node: ast.AST) -> bool:
    texts = (part for part in ast.walk(node) if isinstance(part, ast.JoinedStr | ast.Constant))
    return any(isinstance(part, ast.JoinedStr) or isinstance(part.value, str) for part in texts)


def drawn(package: str, count: int, seed: int) -> list[Mutant]:
    """`count` mutants of a package, the same for the same seed and code, without those known to change nothing."""
    source = ROOT / package if (ROOT / package / "__init__.py").exists() else ROOT / "papilla" / package
    files = sorted(source.rglob("*.py")) if source.is_dir() else [source.with_suffix(".py")]
    every = [one for path in files for one in mutants_of(path) if (one.file, one.before, one.after) not in EQUIVALENT]
    return random.Random(f"{package} {seed}").sample(every, min(count, len(every)))


class Reached:
    """A plugin of pytest: which functions of the tree each test calls, itself or in its fixtures, and for how long.

    A profiler in C notes the calls of the main thread (a trace function in Python makes tests several times slower),
    a trace function those of the other threads.
    """

    def __init__(self, tree: Path):
        self.own: dict[str, dict[int, CodeType]] = {}
        self.fixtures: dict[str, dict[int, CodeType]] = {}
        self.lasted: dict[str, float] = {}
        self.tests: list[tuple[float, str, set[str]]] = []
        self.source, self.now, self.profile = f"{tree}{os.sep}", dict[int, CodeType](), cProfile.Profile(builtins=False)

    def see(self, frame, event, _):
        """As a trace function: notes each call."""
        self.now[id(frame.f_code)] = frame.f_code

    def follow(self, now: dict[int, CodeType]) -> dict[int, CodeType]:
        """Notes the calls from here on in `now`; returns what noted them until now."""
        self.profile.disable()
        self.now |= {id(one.code): one.code for one in self.profile.getstats() if not isinstance(one.code, str)}
        before, self.now = self.now, now
        self.profile.clear()
        self.profile.enable()
        return before

    def pytest_runtest_protocol(self, item):
        """Notes what follows for this test."""
        self.own[item.nodeid] = {}
        self.follow(self.own[item.nodeid])

    @pytest.hookimpl(wrapper=True)
    def pytest_fixture_setup(self, fixturedef):
        """Notes what a fixture calls for all tests that use it, and the time."""
        test = self.follow(self.fixtures.setdefault(fixturedef.argname, {}))
        started = worked_s()
        try:
            return (yield)
        finally:
            self.follow(test)
            self.lasted[fixturedef.argname] = worked_s() - started

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_call(self, item):
        """Notes the time."""
        started = worked_s()
        try:
            return (yield)
        finally:
            self.tests.append((worked_s() - started, item.nodeid, set(item.fixturenames)))

    def by_function(self) -> dict[str, list[tuple[float, str]]]:
        """Each "file:line" of a function, and each file -> seconds and names of its tests, the quickest first.

        The first test that uses a fixture pays for it.
        """
        self.follow({})
        self.profile.disable()
        found: dict[str, list[tuple[float, str]]] = {}
        paid: dict[str, set[str]] = {}
        for _, cost, test, names in sorted(
            (cost + sum(self.lasted.get(name, 0.0) for name in names), cost, test, names)
            for cost, test, names in self.tests
        ):
            called = [code for part in (self.own[test], *(self.fixtures.get(name, {}) for name in names))
                      for code in part.values() if code.co_filename.startswith(self.source)]  # fmt: skip
            files = {code.co_filename[len(self.source) :] for code in called}
            for place in files | {f"{code.co_filename[len(self.source) :]}:{code.co_firstlineno}" for code in called}:
                known = paid.setdefault(place, set())
                fixtures = sum(self.lasted.get(name, 0.0) for name in names - known)
                found.setdefault(place, []).append((cost + fixtures, test))
                known |= names
        return found


def worked_s() -> float:
    """Processor time (s) of this process and of those that it has started and that have ended."""
    return sum(os.times()[:4])


class Warm:
    """A plugin of pytest: the cache of the session starts with what the run without a fault has left."""

    def __init__(self, kept: Path):
        self.kept = kept

    @pytest.hookimpl(tryfirst=True)
    def pytest_fixture_setup(self, fixturedef, request):
        """Copies it just before the fixture of tests/conftest.py opens it."""
        if fixturedef.argname == "cache_folder":
            base = request.getfixturevalue("tmp_path_factory").getbasetemp()
            shutil.copytree(self.kept, base / CACHE, copy_function=os.link)


def run_tests(tree: Path, tests: list[str], limit_s: float | None, traced: bool) -> None:
    """Run tests in a copy of the tree, as the job of a process of its own, which ends with pytest's exit code."""
    os.setsid()  # What the tests start ends with them
    if limit_s is not None:
        resource.setrlimit(resource.RLIMIT_CPU, (math.ceil(limit_s), math.ceil(limit_s) + 1))
    os.chdir(tree)
    os.environ["PYTHONPATH"] = str(tree)
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    sys.dont_write_bytecode = False  # Compiling all modules takes seconds of each run
    sys.path.insert(0, str(tree))
    with open("output.txt", "w") as output:
        os.dup2(output.fileno(), 1)
        os.dup2(output.fileno(), 2)
    base = f"--basetemp={tree / 'tmp'}"
    if not traced:
        sys.exit(pytest.main([*OPTIONS, base, *tests], [Warm(tree / CACHE)]))
    plugin = Reached(tree)
    threading.settrace(plugin.see)
    failed = pytest.main([*OPTIONS, base, *tests], [plugin])
    Path("reached.json").write_text(json.dumps(plugin.by_function()))
    sys.exit(failed)


def outcome(tree: Path, tests: list[str], limit_s: float | None = None, traced: bool = False) -> int | None:
    """Exit code of tests in a copy of the tree; None where they took longer than the limit."""
    process = PROCESSES.Process(target=run_tests, args=(tree, tests, limit_s, traced))
    process.start()
    process.join(None if limit_s is None else WAIT_TIMES * limit_s)
    if process.exitcode is None:
        os.killpg(process.pid, signal.SIGKILL)
        process.join()
        return None
    return None if process.exitcode in (-signal.SIGXCPU, -signal.SIGKILL) else process.exitcode


def reached(package: str, tree: Path) -> dict[str, list[tuple[float, str]]]:
    """Time (s) and name of each test that reaches a function, the quickest first; ends here where they fail without
    any fault."""
    known = TESTS.get(package, (f"tests/{package}",))
    places = [place for place in known if (ROOT / place).exists()]
    if outcome(tree, places, traced=True) != 0:
        raise SystemExit(f"{package}: its tests fail without a fault\n{(tree / 'output.txt').read_text()[-2000:]}")
    shutil.rmtree(tree / CACHE, ignore_errors=True)
    shutil.copytree(tree / "tmp" / CACHE, tree / CACHE, ignore=shutil.ignore_patterns("mesh", "*.lock"))
    found = json.loads((tree / "reached.json").read_text())
    if outcome(tree, [test for _, test in found[EVERY]]) != 0:
        raise SystemExit(f"{package}: the quickest first, its tests fail\n{(tree / 'output.txt').read_text()[-2000:]}")
    return found


def tests_of(mutant: Mutant, tests: dict[str, list[tuple[float, str]]], tree: Path) -> list[tuple[float, str]]:
    """The tests that reach the mutant's function. Of what stands outside of functions, or runs only when a module is
    imported or in another process: those that reach a file in which its name occurs, or that starts processes. The copy
    `tree` is read, because the checkout may change while this runs."""
    line, body = mutant.span[0], ast.parse((tree / mutant.file).read_text())
    inside = [
        (min([node.lineno, *(one.lineno for one in node.decorator_list)]), node.name)
        for node in ast.walk(body)
        if isinstance(node, ast.FunctionDef) and node.body[0].lineno <= line <= (node.end_lineno or 0)
    ]
    if inside and (found := tests.get(f"{mutant.file}:{max(inside)[0]}")):
        return found
    top = next(node for node in body.body if node.lineno <= line <= (node.end_lineno or 0))
    stored = (node.id for node in ast.walk(top) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store))
    names = {max(inside)[1]} if inside else {*stored, getattr(top, "name", Path(mutant.file).stem)}
    named = re.compile(rf"\b({'|'.join(names)})\b")
    texts = {file: (tree / file).read_text() for file in tests if file.endswith(".py")}
    files = [file for file, text in texts.items() if named.search(text) or file in STARTERS]
    users = {test for file in files for _, test in tests[file]}
    return [one for one in tests[EVERY] if one[1] in users]


def verdict(mutant: Mutant, tests: list[tuple[float, str]], tree: Path) -> str:
    """What these tests say to the fault in the copy `tree`, which is as before afterwards."""
    if not tests:
        return "SURVIVED"
    costs = list(accumulate(cost for cost, _ in tests))
    count = max(1, bisect_right(costs, SHARE_S))
    target = tree / mutant.file
    sound = target.read_text()
    target.write_text(mutant.applied(sound))
    _forget_compiled(target)
    try:
        code = outcome(tree, [test for _, test in tests[:count]], LIMIT_S + LIMIT_TIMES * costs[count - 1])
    finally:
        target.write_text(sound)
        _forget_compiled(target)
    return "killed by time" if code is None else "killed" if code else "SURVIVED"


def _forget_compiled(file: Path) -> None:
    # Python may take a compiled file for that of a text of the same length that is written in the same second
    for compiled in (file.parent / "__pycache__").glob(f"{file.stem}.*"):
        compiled.unlink()


def main() -> None:
    """Draw, run, and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("packages", nargs="*", default=["fem", "mesh", "calibrate", "calibration"])
    parser.add_argument("--count", type=int, default=25, help="mutants of each package")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--slow", action="store_true", help="run the slow tests, too")
    parser.add_argument("--list", action="store_true", help="show the mutants and run nothing")
    chosen = parser.parse_args()
    os.environ |= {name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "RAYON_NUM_THREADS")}
    os.environ["PYTEST_ADDOPTS"] = "" if chosen.slow else "-m 'not slow'"
    os.environ.pop("PAPILLA_TEST_CACHE", None)  # Each fault has a cache of its own
    for package in chosen.packages:
        plan = drawn(package, chosen.count, chosen.seed)
        if chosen.list:
            print(*(f"{package}: {one}" for one in plan), sep="\n")
            continue
        with tempfile.TemporaryDirectory() as folder:
            tree = copied(Path(folder).resolve() / "tree")
            tests, found = reached(package, tree), []
            for one in plan:
                found.append(verdict(one, tests_of(one, tests, tree), tree))
                print(f"{package}: {found[-1]}  {one}", flush=True)
        alive, late = found.count("SURVIVED"), found.count("killed by time")
        share = f"{len(found) - alive} of {len(found)} killed ({100 * (1 - alive / len(found)):.0f} %)"
        print(f"{package}: {share}, {late} of them by time", flush=True)


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
