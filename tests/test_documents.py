"""What the documents name exists: files, modules and their names, benchmarks, decisions, links."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
DOCUMENTS = sorted(
    path.relative_to(ROOT).as_posix()
    for path in (*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md"))
    if path.name != "CHANGELOG.md" and not {"_build", "generated"} & {*path.parts}
)
HISTORY = re.compile(r"docs/adr/\d")
"""Decisions name files and modules as they were called then; README.md of their folder says so."""
FOLDERS = ("papilla", "papilla_papers", "tests", "benchmarks", "docs", "notebooks", "examples")
PATH = re.compile(rf"`((?:{'|'.join(FOLDERS)})/[\w./*-]+|[\w/]+/[\w/]+\.py)`")
MODULE = re.compile(r"`papilla((?:\.\w+)+)[`(]")
SCRIPT = re.compile(r"python ((?:benchmarks|examples)/[\w/]+\.py)")
DECISION = re.compile(r"(?:ADR |docs/adr/)([0-9]{4})")
LINK = re.compile(r"\]\((?!https?:)([^)#]+)\)")
MADE = re.compile(r"(^|/)(generated|_build)/")
"""What `make docs` makes; it refuses a link to a page that it has not made."""


def missing_paths(text: str) -> list[str]:
    """Files and folders that a text names, from the root or inside the package, and that do not exist."""
    found = [*PATH.findall(text), *SCRIPT.findall(text)]
    return [
        path for path in found if not MADE.search(path) and not any([*ROOT.glob(path), *(ROOT / "papilla").glob(path)])
    ]


def missing_names(text: str) -> list[str]:
    """Dotted names below `papilla` that are neither a module nor a name in one."""
    missing = []
    for dotted in MODULE.findall(text):
        place, parts = ROOT / "papilla", dotted[1:].split(".")
        while parts and (place / parts[0]).is_dir():
            place /= parts.pop(0)
        if parts and (place / f"{parts[0]}.py").is_file():
            home = [place / f"{parts.pop(0)}.py"]
        else:
            home = [*place.glob("__init__.py*")]
        written = "".join(file.read_text(encoding="utf-8") for file in home)
        if parts and not all(re.search(rf"\b{part}\b", written) for part in parts[:1]):
            missing.append(f"papilla{dotted}")
    return missing


@pytest.mark.parametrize("document", DOCUMENTS)
def test_what_a_document_names_exists(document):
    text = (ROOT / document).read_text(encoding="utf-8")
    if not HISTORY.match(document):
        assert missing_paths(text) == []
        assert missing_names(text) == []
    here = (ROOT / document).parent
    assert [link for link in LINK.findall(text) if not MADE.search(link) and not (here / link).exists()] == []


def test_every_decision_that_is_named_exists_and_stands_in_the_index():
    decisions = {path.name[:4] for path in ROOT.glob("docs/adr/[0-9]*.md")}
    files = [*ROOT.glob("*.md"), *(file for top in FOLDERS[:5] for file in (ROOT / top).rglob("*.[pm][yd]"))]
    named = {number for file in files for number in DECISION.findall(file.read_text(encoding="utf-8"))}
    assert named and named <= decisions
    assert set(re.findall(r"\]\(([0-9]{4})", (ROOT / "docs/adr/README.md").read_text(encoding="utf-8"))) == decisions


def test_the_check_sees_what_is_not_there():
    assert missing_paths("`papilla/nowhere.py`, not `fem/fields.py`") == ["papilla/nowhere.py"]
    assert missing_names("`papilla.fem.nothing_such` and `papilla.fem.press`") == ["papilla.fem.nothing_such"]
