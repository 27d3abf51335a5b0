"""Do tests hold private names? Names with one underscore, drawn at random and renamed everywhere in a copy.

`python benchmarks/renamed_names.py --count 30 --seed N [--rooms ROOM ...]` renames them in papilla and papilla_papers,
never in tests, runs the quick tests of the rooms that define them, and prints how many fail; 0 is the goal.
"""

import argparse
import ast
import io
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
import tokenize
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).parents[1]
TESTS = {"papilla_papers": "tests/papers"}  # Where they are not `tests/<room>`
PRIVATE_NAME = re.compile(r"_(?!(?:asdict|fields|make|replace)$)[A-Za-z0-9]\w*(?<!_)")  # But those of NamedTuple
DEFINING = (ast.FunctionDef, ast.ClassDef, ast.Store)
BY_NAME = ("getattr", "setattr", "hasattr", "delattr", "attrgetter")
FIELD = re.compile(r"(?<!\{)\{(?!\{)[^{}]*")  # What an f-string computes: one token before Python 3.12


def room_of(file: Path) -> str:
    """A folder or module of papilla, or papilla_papers."""
    return file.parts[0] if file.parts[0] != "papilla" else Path(file.parts[1]).stem


def private_names(source: str) -> set[str]:
    """Functions, classes, constants, variables and attributes with one underscore that a module defines."""
    stored = [node for node in ast.walk(ast.parse(source)) if isinstance(getattr(node, "ctx", node), DEFINING)]
    names = {getattr(node, field) for node in stored for field in ("name", "id", "attr") if hasattr(node, field)}
    return {name for name in names if PRIVATE_NAME.fullmatch(name)}


def _texts_of_names(source: str) -> set[tuple[int, int]]:
    """Line and column of the strings in `__slots__`, and in calls that look an attribute up by its name."""
    places, lines = set(), source.encode().splitlines()
    for node in ast.walk(ast.parse(source)):
        slots = isinstance(node, ast.Assign) and "__slots__" in map(ast.unparse, node.targets)
        called = isinstance(node, ast.Call) and ast.unparse(node.func).split(".")[-1] in BY_NAME
        texts = [text for text in ast.walk(node) if isinstance(text, ast.Constant)] if slots or called else []
        places |= {(text.lineno, len(lines[text.lineno - 1][: text.col_offset].decode())) for text in texts}
    return places


def renamed(source: str, names: dict[str, str]) -> str:
    """The source with other names (old -> new)."""
    texts, lines = _texts_of_names(source), source.splitlines(keepends=True)
    for token in reversed(list(tokenize.generate_tokens(io.StringIO(source).readline))):
        after = names.get(token.string, token.string)
        if token.type == tokenize.STRING and "f" in after[:2].lower():
            after = FIELD.sub(lambda part: re.sub(r"\w+", lambda word: names.get(word[0], word[0]), part[0]), after)
        elif token.type == tokenize.STRING and token.start in texts and (name := ast.literal_eval(after)) in names:
            after = repr(names[name])
        if after != token.string:
            (first, start), (last, end) = token.start, token.end
            lines[first - 1 : last] = [lines[first - 1][:start] + after + lines[last - 1][end:]]
    return "".join(lines)


def copied(tree: Path) -> list[Path]:
    """Copies the checkout's tracked files; returns the Python files of the packages in the copy."""
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, check=True, capture_output=True, text=True).stdout
    names = [name for name in listed.split("\0") if (ROOT / name).is_file()]
    for name in names:
        (tree / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, tree / name)
    return [tree / name for name in names if name.startswith("papilla") and name.endswith((".py", ".pyi"))]


def failing_tests(tree: Path, places: list[str]) -> list[str]:
    """Those of the copy's quick tests that fail, and files that do not load."""

    def python(*arguments: str) -> subprocess.CompletedProcess[str]:
        environment = os.environ | {"PYTHONPATH": str(tree)}
        return subprocess.run([sys.executable, *arguments], cwd=tree, env=environment, capture_output=True, text=True)

    if str(tree) not in (loaded := python("-c", "import papilla; print(papilla.__file__)").stdout):
        raise SystemExit(f"the tests would not run in the copy: {loaded}")
    options = ("-m", "not slow", "-p", "no:cacheprovider", "-q", "-rfE", "--continue-on-collection-errors")
    ran = python("-m", "pytest", *options, *places)
    lines = [line for line in ran.stdout.splitlines() if line.startswith(("FAILED ", "ERROR "))]
    return lines if ran.returncode in (0, 1) else [*lines, f"pytest ends with code {ran.returncode}\n{ran.stderr}"]


def main() -> None:
    """Draw, rename, run, and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=30)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--rooms", nargs="*", help="rooms to draw from; default: all")
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder).resolve()
        files, defined = copied(tree), defaultdict(set)  # The rooms of each name
        for file in files:
            for name in private_names(file.read_text()):
                defined[name].add(room_of(file.relative_to(tree)))
        wanted = set(chosen.rooms or set().union(*defined.values()))
        pool = [name for name in sorted(defined.keys() - {file.stem for file in files}) if defined[name] & wanted]
        drawn = random.Random(chosen.seed).sample(pool, min(chosen.count, len(pool)))
        names = {name: f"_renamed_{number}" for number, name in enumerate(drawn)}
        for file in files:
            file.write_text(renamed(file.read_text(), names))
        print(*(f"{old} -> {new}  ({', '.join(sorted(defined[old]))})" for old, new in names.items()), sep="\n")
        places = sorted({TESTS.get(room, f"tests/{room}") for name in names for room in defined[name] & wanted})
        failed = failing_tests(tree, [place for place in places if (tree / place).exists()])
    print(*failed, f"{len(failed)} tests fail after {len(names)} renames: {', '.join(places)}", sep="\n")
    raise SystemExit(bool(failed))


if __name__ == "__main__":
    main()
