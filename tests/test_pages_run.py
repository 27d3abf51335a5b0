"""Every program and command of the documentation, run from top to bottom of its page, in the names of its page; a
block that opens with "# NAME.toml" is that file. Commands are shortened (`shorter`)."""

import re
import tomllib
from pathlib import Path

import pytest
from shorter import shortened

DOCS = Path(__file__).parents[1] / "docs"
SKIPPED = ("adr", "generated", "_build")
PAGES = sorted(page for page in DOCS.rglob("*.md") if page.relative_to(DOCS).parts[0] not in SKIPPED)
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```", re.MULTILINE | re.DOTALL)
FILE = re.compile(r"# (\w+\.toml)\n")
QUICK = ("foreign_log", "design_studies", "link")
"""Pages of a few seconds; the others are slow."""
DRAWN = ("surfaces",)
"""Pages whose finger needs a mesh of its own."""


def blocks(page: Path) -> list[tuple[str, str]]:
    """Language and text of the blocks of a page that do something."""
    return [(kind, text) for kind, text in BLOCK.findall(page.read_text(encoding="utf-8")) if kind != "text"]


def marked(page: Path):
    marks = [] if page.stem in QUICK else [pytest.mark.slow]
    return pytest.param(page, id=page.stem, marks=[*marks, *([pytest.mark.mesher] if page.stem in DRAWN else [])])


@pytest.mark.parametrize("page", [marked(page) for page in PAGES if blocks(page)])
def test_what_a_page_shows_runs(page, tmp_path, monkeypatch, capsys):
    from papilla.cli.main import run

    monkeypatch.chdir(tmp_path)
    names = {"__name__": "__main__"}
    for kind, text in blocks(page):
        if kind == "python":
            exec(compile(text, page.name, "exec"), names)
        elif kind == "sh":
            for line in text.splitlines():
                assert line.startswith("papilla ")
                with pytest.raises(SystemExit) as end:
                    run(shortened(line))
                assert end.value.code == 0, (line, capsys.readouterr().err)
        else:
            assert kind == "toml" and tomllib.loads(text)
            if named := FILE.match(text):
                Path(named[1]).write_text(text, encoding="utf-8")


def test_blocks_are_of_known_kinds():
    assert len(PAGES) > 20
    assert {kind for page in PAGES for kind, _ in blocks(page)} <= {"python", "sh", "toml"}
