"""Figures: how they are kept, drawn and written, whatever they show; and what each figure of the papers shows."""

import csv
import io
import re
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.text import Text

from papilla.core.errors import FileFormatError, InputError
from papilla.core.units import INCH_MM
from papilla_papers.claims import ALL_CLAIMS
from papilla_papers.figures import (
    ALL_PAPERS,
    Curve,
    Figure,
    Panel,
    Paper,
    Picture,
    PrintedTable,
    Shade,
    figures,
    paper_2006,
    paper_2007,
    paper_oddo,
    paper_okamoto,
    paper_textiles,
    write,
)
from papilla_papers.figures.drawing import as_svg, draw
from papilla_papers.figures.picture import CSV_HEADS, MOST_CELLS, MOST_ROWS, as_csv
from papilla_papers.grating_signals import GratingSignal
from papilla_papers.study_plots import signals_figure

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
CELLS = Shade(np.arange(200.0), np.arange(1.0, 121.0), GRID, "power", over=GRID > 10, phase=0 * GRID + 1.0)
MAP = Panel("map", "time, s", "frequency, Hz", shade=CELLS, log="y")


def rows(picture: Picture) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(as_csv(picture))))


def toy() -> Picture:
    """A toy.

    Drawn by hand.
    """
    toy.calls += 1
    return Picture((LINES, BARS, MAP), columns=2, found="it works")


def toy_table() -> Picture:
    """A table."""
    return Picture(table=PrintedTable(("name", "f, Hz"), (("a", 1.5), ("b $", "25.0 (25)"))))


for _made_up in (toy, toy_table):
    _made_up.__module__ = "papilla.verify.case"  # Whose code is part of the key under which pictures are kept


@pytest.fixture
def papers(monkeypatch, tmp_path):
    toy.calls = 0
    monkeypatch.setenv("PAPILLA_CACHE", str(tmp_path / "cache"))
    old = Figure("table I", toy_table), Figure("fig. 1", toy, ("A1",))
    new = Figure("fig. 1", toy, (), "group"), Figure("fig. 2", toy, (), "group")
    return {"old": Paper("an old one", old, {"fig. 2": "a photo"}), "new": Paper("a new one", new, {})}


def test_a_picture_survives_the_cache_and_other_bytes_are_one_error():
    before = Picture((LINES, BARS, MAP), PrintedTable(("a",), ((1.0,), ("b",))), 2, "words")
    packed = before.packed()
    after = Picture.unpacked(packed)
    assert as_csv(after) == as_csv(before) and as_svg(Picture((LINES,))) == as_svg(Picture(after.panels[:1]))
    assert (after.columns, after.found, after.panels[1].names) == (2, "words", ("one", "two"))
    assert after.panels[2].shade is not None and (after.panels[2].shade.phase == 1.0).all()
    damaged = [packed[:-1], packed[: len(packed) // 2], np.frombuffer(b"\x91" * 5000, np.uint8)]
    damaged += [np.frombuffer(packed.tobytes().replace(b"<f8", kind), np.uint8) for kind in (b"|O8", b"xyz", b"<f4")]
    for content in damaged:
        with pytest.raises(FileFormatError, match="no picture, or are damaged"):
            Picture.unpacked(content)


def test_the_csv_names_quantities_and_origins_and_a_map_is_a_row_a_cell():
    found = rows(Picture((LINES, BARS)))
    assert tuple(found[0]) == CSV_HEADS
    assert [(row["x"], row["y"]) for row in found if row["origin"] == "printed"] == [("1", "0.5"), ("2", "")]
    assert {row["curve"]: row["sd"] for row in found if row["sd"]} == {"spread": "0.2"}
    assert {row["x"] for row in found if row["panel"] == "bars"} == {"one", "two"}
    line = [float(row["x"]) for row in found if row["curve"] == "line"]
    assert len(line) <= MOST_ROWS and line[0] == 0 and 4.9 < line[-1] <= 5.0, "what the axes do not show stays out"
    cells = rows(Picture((MAP,)))
    assert len(cells) == (120 // 3) * (200 // 4) and MOST_CELLS == 50
    assert all(float(row["value"]) == pytest.approx((float(row["x"]) + float(row["y"])) / 10) for row in cells)


def test_every_look_is_drawn():
    figure = draw(Picture((LINES, BARS, MAP), columns=2))
    lines, bars, shade, color_bar = figure.axes[0], figure.axes[1], figure.axes[2], figure.axes[-1]
    assert len(lines.lines) == 6 and len(lines.collections) == 2, "four curves, two caps of a bar; bar and impulse"
    assert [[4, 0], [4, 1]] in [part.tolist() for drawn in lines.collections for part in drawn.get_segments()]
    assert [patch.get_height() for patch in bars.patches] == [0.2, 0.8]
    assert shade.get_yscale() == "log" and color_bar.get_ylabel() == "power"
    arrows = [one for one in shade.collections if hasattr(one, "angles")]
    assert arrows and np.allclose(arrows[0].V, -np.sin(1.0)), "a phase that leads points down"
    assert not figure.axes[3].axison, "an empty place has no axes"
    (cells,) = draw(toy_table()).axes[0].tables
    assert {key: cell.get_text().get_text() for key, cell in cells.get_celld().items()}[1, 1] == "1.5"


def test_figures_are_computed_once_and_written_whole_or_not_at_all(papers, tmp_path):
    made = figures(papers=papers)
    assert [one.stem for one in made] == ["old_table_i", "old_fig_1", "new_fig_1", "new_fig_2"]
    assert toy.calls == 3 and len(figures("new", papers=papers)) == 2 and toy.calls == 3
    paths = write(tmp_path / "out", made, papers=papers)
    text = paths["page"].read_text()
    assert text.count("data:image/svg+xml") == 6 and "25.0 (25)" in text and "Drawn by hand" in text
    assert "it works" in text and "fig. 2 (a photo)" in text and "http" not in text.replace("http://www.w3.org", "")
    assert next(claim.claim for claim in ALL_CLAIMS if claim.key == "A1") in text
    assert paths["old_fig_1.svg"].read_bytes().startswith(b"<?xml")
    assert paths["old_table_i.csv"].read_text() == 'name,"f, Hz"\na,1.5\nb $,25.0 (25)\n'
    assert {path.name for path in (tmp_path / "out").iterdir()} == {path.name for path in paths.values()}
    bad = replace(made[0], picture=Picture(table=PrintedTable(("a",), (("a", "b"), 1.0))))
    with pytest.raises(TypeError):
        write(tmp_path / "bad", [*made[1:], bad], papers=papers)
    assert list((tmp_path / "bad").iterdir()) == []
    with pytest.raises(InputError, match=r"no paper is called '20O6'.*did you mean 2006\?"):
        figures("20O6")


def test_every_figure_has_its_caption_and_claims_and_none_is_missing():
    """Of every figure that a claim names, the papers here say what becomes of it."""
    assert sum(len(paper.figures) for paper in ALL_PAPERS.values()) >= 35
    for name, paper in ALL_PAPERS.items():
        assert len({one.stem for one in paper.figures}) == len(paper.figures), name
        for one in paper.figures:
            assert one.title and len(one.caption) > 80, f"{name} {one.name}: a caption says how it is computed"
            assert set(one.claims) <= {claim.key for claim in ALL_CLAIMS} and one.name not in paper.left_out, one.name
    words = {"2006": "2006", "2007": "2007", "2011 Okamoto": "2011_okamoto", "2011 Oddo": "2011_oddo"}
    for claim in ALL_CLAIMS:
        paper = next((ALL_PAPERS[key] for start, key in words.items() if claim.source.startswith(f"{start} ")), None)
        if paper and (number := re.search(r"fig\. (\d+)", claim.source)):
            known = " ".join([*(one.name for one in paper.figures), *paper.left_out])
            assert re.search(rf"\b{number[1]}\b", known), f"{claim.key}: {claim.source}"


def test_signals_over_gratings():
    signals = [
        GratingSignal(w, p, 10.0, 1.0, np.ones(2), np.array([w, 10 * w + p]), "quasi-static", "")
        for w, p in ((2.0, 0.0), (1.0, 0.0), (2.0, 0.5), (1.0, 0.5))
    ]
    figure = signals_figure(signals, ["g1", "a_$b$"])
    for axes, pitch in zip(figure.axes, (0.0, 0.5), strict=True):
        drawn = [line for line in axes.lines if line.get_marker() == "o"]
        assert [list(line.get_xdata()) for line in drawn] == [[1.0, 2.0]] * 2
        assert list(drawn[1].get_ydata()) == [10.0 + pitch, 20.0 + pitch]
        assert axes.get_ylim() == pytest.approx((0.5, 2 * 20.5)) and axes.get_yscale() == "log"
        marks = [line.get_xdata()[0] for line in axes.lines if line.get_linestyle() == ":"]
        assert marks == [pitch] * bool(pitch)
    words = " ".join(" ".join(text.get_text() for text in figure.findobj(Text)).split())
    assert "smooth skin" in words and "ridges of 0.5 mm pitch" in words
    assert "2 mm gives the largest signal: 20.5 µε at a_$b$, with ridges of 0.5 mm" in words
    assert len(signals_figure(signals[:2], ["g1", "g2"]).axes) == 1


# ---- What the papers' figures show


def curves(picture: Picture, panel: int) -> dict:
    return {one.label: one for one in picture.panels[panel].curves}


def test_passive_touch_follows_the_step_and_its_phases():
    made = paper_oddo.passive_maps()
    for panel, expected in ((4, 0.0), (3, np.angle(np.exp(-2j * np.pi * 2.36 / 0.48)))):
        shade = made.panels[panel].shade
        for time, frequency in ((1.6, 13.9), (2.4, 20.8)):
            column = int(np.argmin(np.abs(shade.x - time)))
            row = int(np.nanargmax(shade.value[:, column]))
            assert shade.y[row] == pytest.approx(frequency, rel=0.03) and shade.over[row, column]
            assert abs(np.angle(np.exp(1j * (abs(shade.phase[row, column]) - abs(expected))))) < 0.15


def test_an_active_rub_is_felt_by_one_row_before_the_other():
    felt = paper_oddo.active_record().panels[0].curves
    fourth, first, second = (float(one.x[np.flatnonzero(np.abs(one.y) > 0.5)[0]]) for one in felt)
    assert first == pytest.approx(second, abs=0.01) and fourth - first == pytest.approx(0.035, abs=0.015)
    panels = paper_oddo.active_maps().panels
    assert all(one.curves[0].label == "t_MP" for one in panels[3:]) and len(panels) == 5


def test_gratings_are_clusters_and_a_nearest_neighbour_names_them():
    centres = [one.x.mean() for one in paper_oddo.clusters().panels[0].curves if one.label]
    assert np.all(np.diff(centres) < -2) and len(centres) == 3
    each = paper_oddo.every_run()
    assert all(len(panel.curves) == 4 and len(panel.curves[-1].x) == 24 for panel in each.panels)
    assert float(re.search(r"gap of (\S+) Hz", each.found)[1]) > 0.5


def test_statistics_of_active_touch_scatter_more_than_those_of_passive_touch():
    tables = paper_oddo.passive_table().table, paper_oddo.active_table().table
    passive, active = (np.array([row[-4:] for row in table.rows], float) for table in tables)
    assert (passive[:, 1] / passive[:, 0]).max() < 0.016
    assert 0.05 < (active[:, 1] / active[:, 0]).max() < 0.12
    assert np.all(active[:, 2] > active[:, 0]) and np.all(active[:, 0] > active[:, 3])
    expected = paper_oddo.expected().table.rows
    assert expected[2][1] == pytest.approx(float(expected[2][2]), abs=0.05)


def test_the_tables_of_textiles_are_the_printed_ones():
    weights = np.array([row[2:5] for row in paper_textiles.fabrics().table.rows], float)
    agree = np.abs(weights[:, 1] / weights[:, 0] - 1) < 0.07
    assert agree.tolist() == [True, False, True, True] and (weights[:, 2] < 0.35 * weights[:, 0]).all()
    made = paper_textiles.grid()
    assert [row[1] for row in made.table.rows] == list(paper_textiles.PRINTED_BANDS) and "11770" in made.found


@pytest.mark.slow
class TestSlides:
    """Figures of sliding scenes by finite elements."""

    def test_two_grooves_give_two_impulses_at_their_entries(self):
        made = paper_2006.two_grooves()
        impulses, printed = made.panels[4].curves
        assert len(impulses.x) == 4, "two edges a groove"
        assert impulses.x[2] - impulses.x[0] == pytest.approx(0.05, abs=0.002)
        assert printed.x == pytest.approx(impulses.x[[0, 2]], abs=0.003)
        assert len(made.panels[5].curves[0].x) > 8, "a finger feels every edge with every ridge"

    def test_zero_crossings(self):
        output, impulses = paper_2007.crossings().panels
        assert len(impulses.curves[0].x) / 0.4 > 33 and np.ptp(output.curves[0].y) > 100
        step = curves(paper_2007.side_by_side(), 1)["synthetic"].y
        assert [np.nanmedian(step[600:900]), np.nanmedian(step[1300:])] == pytest.approx([1, 4], rel=0.1)

    def test_okamoto(self):
        match, synthetic, felt = paper_okamoto.wavelengths().panels[0].curves
        assert np.abs(synthetic.y - synthetic.x).max() < 0.1 * match.x.max()
        assert np.all(np.diff(synthetic.spread[1:]) > 0) and felt.y[1] == pytest.approx(1.0, rel=0.2)
        assert all(np.ptp(np.log(one.y)) < 2 for one in paper_okamoto.power_over_speed().panels[0].curves)
        points, quartic, *_ = paper_okamoto.power_over_wavelength().panels[0].curves
        assert 1.0 < points.x[np.argmax(points.y)] < 1.6 and "R²" in quartic.label

    def test_displays(self):
        delayed, at_once = paper_okamoto.with_delay(), curves(paper_okamoto.without_delay(), 0)
        late, match = curves(delayed, 0), at_once["match"].x
        for model in (at_once["local model"], late["local model, delayed"]):
            assert model.y[[0, -1]] == pytest.approx(match, rel=0.03)
        assert np.nanmean(np.abs(late["direct, delayed"].y / late["direct, delayed"].x - 1)) > 0.2
        direct, local = (np.nanmedian(one.y) for one in delayed.panels[2].curves[:2])
        assert direct > paper_okamoto.NOTICED_MS > 5 > abs(local) and len(paper_okamoto.signals().table.rows) == 28

    def test_textiles(self):
        weaves = list(paper_textiles.PRINTED_FABRICS.values())[1:3]
        tops = [one.x[10:][np.argmax(one.y[10:])] for one in paper_textiles.vibration().panels[1].curves[1:3]]
        assert any(
            abs(top * 2 * INCH_MM / weave.yarns[0] / 10 - 1) < 0.1 for top, weave in zip(tops, weaves, strict=True)
        )
        for panel in paper_textiles.bands().panels:
            assert panel.curves[0].y[6] > max(panel.curves[0].y[5], panel.curves[0].y[7])
            assert panel.names[6] in ("18-118", "19-119", "20-120"), "the lowest and widest of the grid, or next to it"
        assert all(np.nanmax(one.shade.value) == one.shade.value[-1, 0] > 0 for one in paper_textiles.contour().panels)
        *heard, rough = paper_textiles.agreement().panels[0].curves
        assert all(one.y.max() == 1 for one in (*heard, rough)) and len(heard) == 2
        assert np.corrcoef(heard[1].y, rough.y)[0, 1] > 0.5, "by finite elements rougher weaves are louder"
        assert np.argmax(paper_textiles.roughness().panels[0].curves[0].y) == 3
