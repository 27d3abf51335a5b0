"""How figures are kept, drawn and written: whatever a paper's figure shows."""

import csv
import io
from dataclasses import replace

import numpy as np
import pytest

from papilla.core.errors import FileFormatError, InputError
from papilla_papers.claims import ALL_CLAIMS
from papilla_papers.figures import ALL_PAPERS, Curve, Figure, Panel, Paper, Picture, PrintedTable, Shade, figures, write
from papilla_papers.figures.drawing import as_svg, draw
from papilla_papers.figures.picture import CSV_HEADS, MOST_CELLS, MOST_ROWS, as_csv

X = np.linspace(0.0, 10.0, 4001)
CURVES = (
    Curve("line", X, np.sin(X)),
    Curve("true", X[[0, -1]], np.zeros(2), "dashed", origin="true"),
    Curve("printed", np.array([1.0, 2.0]), np.array([0.5, np.nan]), "points", origin="printed"),
    Curve("spread", np.array([3.0]), np.array([0.1]), "points", np.array([0.2])),
    Curve("", np.array([4.0]), np.array([1.0]), "impulses"),
)
LINES = Panel("lines $", "time, s", "y, mm", CURVES, x_range=(0.0, 5.0))
BARS = Panel("bars", "who", "share", (Curve("a", np.arange(2), np.array([0.2, 0.8]), "bars"),), names=("one", "two"))
GRID = np.add.outer(np.arange(1, 121), np.arange(200)) / 10
MAP = Panel(
    "map", "time, s", "frequency, Hz", log="y",
    shade=Shade(np.arange(200.0), np.arange(1.0, 121.0), GRID, "power", over=GRID > 10, phase=0 * GRID + 1.0),
)  # fmt: skip


def rows(picture: Picture) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(as_csv(picture))))


def toy() -> Picture:
    """A toy.

    Drawn by hand.
    """
    toy.calls += 1
    return Picture((LINES, BARS, MAP), columns=2, found="it works")


def toy_table() -> Picture:
    """A table.

    Of two rows.
    """
    return Picture(table=PrintedTable(("name", "f, Hz"), (("a", 1.5), ("b $", "25.0 (25)"))))


for _made_up in (toy, toy_table):
    _made_up.__module__ = "papilla.verify.case"  # Whose code is part of the key under which pictures are kept


@pytest.fixture
def papers(monkeypatch, tmp_path):
    toy.calls = 0
    monkeypatch.setenv("PAPILLA_CACHE", str(tmp_path / "cache"))
    return {
        "old": Paper(
            "an old one", (Figure("table I", toy_table), Figure("fig. 1", toy, ("A1",))), {"fig. 2": "a photo"}
        ),
        "new": Paper("a new one", (Figure("fig. 1", toy, (), "group"), Figure("fig. 2", toy, (), "group")), {}),
    }


def test_a_picture_survives_the_cache():
    before = Picture((LINES, BARS, MAP), PrintedTable(("a",), ((1.0,), ("b",))), 2, "words")
    after = Picture.unpacked(before.packed())
    assert as_csv(after) == as_csv(before) and as_svg(Picture((LINES,))) == as_svg(Picture(after.panels[:1]))
    assert (after.columns, after.found, after.panels[1].names) == (2, "words", ("one", "two"))
    assert after.panels[2].shade is not None and (after.panels[2].shade.phase == 1.0).all()


def test_bytes_that_are_no_picture_are_one_error():
    packed = Picture((LINES, BARS, MAP)).packed()
    others = [packed[:-1], packed[: len(packed) // 2], np.frombuffer(b"\x91" * 5000, np.uint8)]
    others += [np.frombuffer(packed.tobytes().replace(b"<f8", kind), np.uint8) for kind in (b"|O8", b"xyz", b"<f4")]
    for content in others:
        with pytest.raises(FileFormatError, match="no picture, or are damaged"):
            Picture.unpacked(content)


def test_the_csv_names_quantities_and_origins():
    found = rows(Picture((LINES, BARS)))
    assert tuple(found[0]) == CSV_HEADS
    printed = [row for row in found if row["origin"] == "printed"]
    assert [(row["x"], row["y"]) for row in printed] == [("1", "0.5"), ("2", "")]
    assert {row["curve"]: row["sd"] for row in found if row["sd"]} == {"spread": "0.2"}
    assert {row["x"] for row in found if row["panel"] == "bars"} == {"one", "two"}
    line = [float(row["x"]) for row in found if row["curve"] == "line"]
    assert len(line) <= MOST_ROWS and line[0] == 0 and 4.9 < line[-1] <= 5.0, "what the axes do not show stays out"


def test_a_map_is_a_row_a_cell():
    found = rows(Picture((MAP,)))
    assert len(found) == (120 // 3) * (200 // 4) and MOST_CELLS == 50
    assert float(found[-1]["value"]) == pytest.approx((float(found[-1]["x"]) + float(found[-1]["y"])) / 10)


def test_every_look_is_drawn():
    figure = draw(Picture((LINES, BARS, MAP), columns=2))
    lines, bars, shade, color_bar = figure.axes[0], figure.axes[1], figure.axes[2], figure.axes[-1]
    assert len(lines.lines) == 6 and len(lines.collections) == 2, "four curves, two caps of a bar; bar and impulse"
    assert [patch.get_height() for patch in bars.patches] == [0.2, 0.8]
    assert shade.get_yscale() == "log" and color_bar.get_ylabel() == "power"
    arrows = [one for one in shade.collections if hasattr(one, "angles")]
    assert arrows and np.allclose(arrows[0].V, -np.sin(1.0)), "a phase that leads points down"
    assert not figure.axes[3].axison, "an empty place has no axes"


def test_figures_are_computed_once_and_written(papers, tmp_path):
    made = figures(papers=papers)
    assert [one.stem for one in made] == ["old_table_i", "old_fig_1", "new_fig_1", "new_fig_2"]
    assert toy.calls == 3 and len(figures("new", papers=papers)) == 2 and toy.calls == 3
    paths = write(tmp_path / "out", made, papers=papers)
    text = paths["page"].read_text()
    assert text.count("data:image/svg+xml") == 6 and "25.0 (25)" in text and "Drawn by hand" in text
    assert "it works" in text and "fig. 2 (a photo)" in text and "http" not in text.replace("http://www.w3.org", "")
    claim = next(one for one in ALL_CLAIMS if one.key == "A1")
    assert claim.claim in text
    assert paths["old_fig_1.svg"].read_bytes().startswith(b"<?xml")
    assert paths["old_table_i.csv"].read_text() == 'name,"f, Hz"\na,1.5\nb $,25.0 (25)\n'
    assert {path.name for path in (tmp_path / "out").iterdir()} == {path.name for path in paths.values()}


def test_a_name_that_no_paper_has_is_refused_with_the_nearest():
    with pytest.raises(InputError, match=r"no paper is called '20O6'.*did you mean 2006\?"):
        figures("20O6")


def test_the_registry_is_whole():
    keys = {claim.key for claim in ALL_CLAIMS}
    for name, paper in ALL_PAPERS.items():
        stems = [one.stem for one in paper.figures]
        assert len(set(stems)) == len(stems), name
        for one in paper.figures:
            assert one.title and len(one.caption) > 80, f"{name} {one.name}: a caption says how it is computed"
            assert set(one.claims) <= keys, f"{name} {one.name}: {set(one.claims) - keys} are no claims"
            assert one.name not in paper.left_out


def test_each_figure_of_the_claims_is_drawn_or_left_out_by_name():
    """Of every figure that a claim names, the papers here say what becomes of it."""
    import re

    words = {"2006": "2006", "2007": "2007", "2011 Okamoto": "2011_okamoto", "2011 Oddo": "2011_oddo"}
    for claim in ALL_CLAIMS:
        paper = next((key for start, key in words.items() if claim.source.startswith(f"{start} ")), None)
        named = re.search(r"fig\. (\d+)", claim.source)
        if paper in ALL_PAPERS and named:
            known = " ".join([*(one.name for one in ALL_PAPERS[paper].figures), *ALL_PAPERS[paper].left_out])
            assert re.search(rf"\b{named[1]}\b", known), f"{claim.key}: {claim.source}"


class Unwritable(str):
    """A cell of a table that cannot be written."""

    def __str__(self):
        raise ZeroDivisionError

    __format__ = __repr__ = lambda self, *_: str(self)


def test_no_file_is_left_beside_a_failed_write(papers, tmp_path):
    first, *others = figures("old", papers=papers)
    bad = replace(first, picture=Picture(table=PrintedTable(("a",), ((Unwritable("b"),),))))
    with pytest.raises(ZeroDivisionError):
        write(tmp_path / "out", [*others, bad], papers=papers)
    assert list((tmp_path / "out").iterdir()) == []
