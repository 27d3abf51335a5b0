"""Figures: how they are kept, drawn and written, whatever they show; and what each figure of the papers shows."""

import csv
import io
import re
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.colors import to_hex
from matplotlib.text import Text
from pytest import approx

from papilla.core.errors import FileFormatError, InputError
from papilla.core.units import INCH_MM
from papilla.view import style
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
from papilla_papers.figures.drawing import BARS_WIDTH, PANEL_IN, PHASE_ARROWS, ROW_IN, WIDTH_IN, as_svg, draw
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


def beside_the_title(figure) -> bool:
    """Whether the legend of the first axes is above them."""
    figure.canvas.draw()
    return figure.axes[0].get_legend().get_window_extent().y0 >= figure.axes[0].get_window_extent().y1 - 1


def test_axes_show_what_the_panel_holds():
    """Bars side by side about their place, colours in order, printed points as diamonds, limits, titles, a legend."""
    bars = tuple(
        Curve(name, np.arange(3), height + np.arange(3), "bars", np.full(3, 0.1), color=color)
        for name, height, color in (("one", 1.0, None), ("two", 2.0, 9), ("three", 3.0, -1))
    )
    named = Panel("heights", "who", "share", bars, y_range=(0.0, 9.0), names=("u", "v", "w"))
    even = Panel("even", "x, mm", "y, mm", (*CURVES[:3], Curve("next", X, X)), x_range=(0.5, 5.0), log="x", even=True)
    wide, narrow = draw(Picture((named, even))), draw(Picture((named, even)), narrow=True)
    assert (
        wide.get_size_inches().tolist() == [WIDTH_IN, 2.5 * PANEL_IN] and narrow.get_size_inches()[1] == 2.5 * PANEL_IN
    )
    assert draw(Picture((LINES,) * 4, columns=3)).get_size_inches()[1] == 2 * PANEL_IN
    left, right = wide.axes
    places = np.array([[bar.get_x(), bar.get_x() + bar.get_width()] for bar in left.patches]).reshape(3, 3, 2)
    np.testing.assert_allclose(places[1].mean(axis=1), [0, 1, 2], atol=1e-12)
    np.testing.assert_allclose(places[0, :, 1], places[1, :, 0])
    np.testing.assert_allclose(places[1, :, 1], places[2, :, 0])
    np.testing.assert_allclose(places[2, :, 1] - places[0, :, 0], BARS_WIDTH)
    assert [bar.get_height() for bar in left.patches] == [1, 2, 3, 2, 3, 4, 3, 4, 5]
    shades = [to_hex(bar.get_facecolor()) for bar in left.patches[::3]]
    assert shades == [style.ACCENT_COLORS[0], style.ACCENT_COLORS[1], to_hex(style.INK_COLOR)]
    assert [tick.get_text() for tick in left.get_xticklabels()] == ["u", "v", "w"] and left.get_ylim() == (0, 9)
    assert (left.get_title(loc="left"), left.get_xlabel(), left.get_ylabel()) == ("heights", "who", "share")
    line, true, printed, following = right.lines
    assert [to_hex(curve.get_color()) for curve in (line, true, following)] == [
        style.ACCENT_COLORS[0], to_hex(style.INK_COLOR), style.ACCENT_COLORS[1]]  # fmt: skip
    assert [curve.get_linestyle() for curve in (line, true, printed)] == ["-", "--", "None"]
    assert (printed.get_marker(), printed.get_markerfacecolor(), line.get_marker()) == ("D", "white", "None")
    np.testing.assert_array_equal(line.get_xydata(), np.column_stack([X, np.sin(X)]))
    assert right.get_xscale() == "log" and right.get_yscale() == "linear" and right.get_aspect() == 1
    assert [text.get_text() for text in right.get_legend().get_texts()] == ["line", "true", "printed", "next"]
    for figure, above in ((wide, True), (narrow, False), (draw(Picture((named, even), columns=2)), False)):
        figure.canvas.draw()
        assert (
            figure.axes[0].get_legend().get_window_extent().y0 >= figure.axes[0].get_window_extent().y1 - 1
        ) == above
    long = draw(Picture((replace(named, title="x" * 90),)))
    long.canvas.draw()
    assert long.axes[0].get_legend().get_window_extent().y0 < long.axes[0].get_window_extent().y1, "there is no room"
    errors = draw(Picture((Panel("", "", "", (CURVES[3],)),))).axes[0].collections[0].get_segments()
    np.testing.assert_allclose(errors[0], [[3.0, -0.1], [3.0, 0.3]])


def test_a_map_shows_its_values_and_phases_where_it_is_over():
    phase = np.linspace(-3, 3, GRID.size).reshape(GRID.shape)
    for over, log in ((GRID > 10, "y"), (None, ""), (GRID < 99, "")):
        shade = replace(CELLS, over=over, phase=phase, top=12.0, value=GRID - 1)
        mesh, *outlines, arrows = draw(Picture((replace(MAP, shade=shade, log=log),))).axes[0].collections
        np.testing.assert_array_equal(mesh.get_array(), GRID - 1)
        assert mesh.get_clim() == (min(0, GRID.min() - 1), 12.0) and len(outlines) == (
            over is not None and not over.all()
        )
        columns, rows_at = np.searchsorted(CELLS.x, arrows.X), np.searchsorted(CELLS.y, arrows.Y)
        assert over is None or over[rows_at, columns].all()
        turned = np.angle(np.exp(1j * (np.arctan2(-arrows.V, arrows.U) - phase[rows_at, columns])))
        assert np.abs(turned).max() < 1e-9
        if over is None or over.all():
            steps = np.diff(np.unique(arrows.X)), np.diff(np.unique(arrows.Y))
            assert len(arrows.X) == PHASE_ARROWS**2 and all(np.ptp(step) <= 1 for step in steps)
        else:
            assert 20 < len(arrows.X) < PHASE_ARROWS**2 and np.ptp(np.diff(np.log(np.unique(arrows.Y)))) < 0.2
    every = np.array([key for key, _ in draw(toy_table()).axes[0].tables[0].get_celld().items()])
    assert every.max(axis=0).tolist() == [2, 1] and draw(toy_table()).get_size_inches()[1] == approx(ROW_IN * 4)


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


QUICK = [
    *(getattr(paper_oddo, name) for name in (
        "passive_record", "passive_maps", "active_record", "active_maps", "three_gratings", "every_run", "clusters",
        "textiles", "expected", "passive_table", "active_table")),
    paper_textiles.roughness, paper_textiles.fabrics, paper_textiles.grid,
]  # fmt: skip


@pytest.mark.parametrize("make", QUICK, ids=lambda make: make.__name__)
def test_a_quick_figure_holds_texts_and_numbers_in_their_places(make):
    drawn = Picture.unpacked(make().packed())
    quantities = {("time, s", "output"), ("time, s", "frequency, Hz"), ("run", "frequency, Hz")}
    for panel in drawn.panels:
        if "mean f_MP" not in panel.x_label and make is not paper_textiles.roughness:
            assert (panel.x_label, panel.y_label) in quantities and panel.title not in ("", panel.x_label)
        assert all(curve.x.shape == curve.y.shape and np.isfinite(curve.y).all() for curve in panel.curves)
        if panel.shade is not None:
            assert panel.shade.value.shape == (len(panel.shade.y), len(panel.shade.x)) == panel.shade.over.shape
            assert panel.shade.value.max() <= 1 and panel.log == "y" and panel.shade.label == "power over its greatest"
    if drawn.table is not None:
        assert all(len(row) == len(drawn.table.heads) for row in drawn.table.rows)
    NUMBERS.get(make.__name__, lambda drawn: None)(drawn)


def numbers(text: str) -> list[float]:
    return [float(number) for number in re.findall(r"-?\d+(?:\.\d+)?", text)]


def line_of(curve: Curve, frequency_Hz: float, begin_s: float, end_s: float) -> complex:
    """Amplitude and phase of a curve's line over a time."""
    inside = (curve.x >= begin_s) & (curve.x < end_s)
    return 2 * np.mean(curve.y[inside] * np.exp(-2j * np.pi * frequency_Hz * curve.x[inside]))


def of_passive_record(drawn: Picture) -> None:
    """S1 and S2 in phase, S4 2.36 mm along the path behind; nothing but noise at rest."""
    assert [panel.x_range for panel in drawn.panels] == [(0.0, 3.5), (1.75, 2.25)] and drawn.columns == 2
    fourth, first, second = drawn.panels[0].curves
    assert [fourth.label, first.label, second.label] == ["P1S4", "P1S1", "P1S2"] and first.x[300] == 1.0
    for speed, begin, end in ((10 / 1.5, 0.56, 1.928), (10.0, 2.04, 2.952)):  # Whole periods
        lines = [line_of(curve, speed / 0.48, begin, end) for curve in (fourth, first, second)]
        assert np.abs(lines) == approx(np.sqrt(2), rel=0.03) and lines[1] == approx(lines[2], abs=0.05)
        assert lines[0] / lines[1] == approx(np.exp(-2j * np.pi * 2.36 / 0.48), abs=0.05)
    for rest in (slice(0, 149), slice(901, None)):
        assert first.y[rest].std() == approx(0.1, rel=0.25) and not np.array_equal(first.y, second.y)
    assert numbers(drawn.found)[-2] == round(np.degrees(np.angle(np.exp(2j * np.pi * 2.36 / 0.48))))


def of_passive_maps(drawn: Picture) -> None:
    assert numbers(re.sub("P1S.", "", drawn.found))[:2] == approx([13.89, 20.83], abs=0.1)
    for panel, paired in zip(drawn.panels, (False, False, False, True, True), strict=True):
        assert (panel.shade.phase is not None) == paired and panel.shade.value.max() > 0.99
        assert (panel.shade.x[0], panel.shade.x[-1]) == approx((1.5, 2.5), abs=0.004)
        assert np.log2(panel.shade.y[1:] / panel.shade.y[:-1]) == approx(0.03) and panel.shade.y[0] == 8
        (marks,) = panel.curves
        assert (marks.origin, marks.x.tolist(), marks.y.tolist()) == ("printed", [1.6, 2.4], [13.9, 20.8])
        for time, frequency in ((1.6, 13.9), (2.4, 20.8)):
            column = np.argmin(np.abs(panel.shade.x - time))
            assert panel.shade.y[panel.shade.value[:, column].argmax()] == approx(frequency, rel=0.04)
            assert 0.05 < panel.shade.over[:, column].mean() < 0.6


def of_active_maps(drawn: Picture) -> None:
    for panel in drawn.panels[3:]:
        (at,) = panel.curves
        assert at.x[0] == at.x[1] == approx(panel.shade.x[panel.shade.value.max(axis=0).argmax()], abs=0.004)
        assert (at.label, at.y[0], at.origin) == ("t_MP", 8.0, "papilla") and at.y[1] == approx(120, rel=0.01)
    _, low, high, least, most, *_ = numbers(re.sub("P1S.", "", drawn.found).replace("f_MP in the 67", "67"))
    assert 45 < least < low < most < high < 66
    assert all(not panel.curves and panel.shade.phase is None for panel in drawn.panels[:3])


def of_three_gratings(drawn: Picture) -> None:
    assert [panel.title for panel in drawn.panels] == ["400 µm", "440 µm", "480 µm"]
    assert all(panel.x_range == approx((0.42, 0.53)) for panel in drawn.panels)
    expected = np.degrees(np.angle(np.exp(2j * np.pi * 2.36 / np.array([0.40, 0.44, 0.48]))))
    assert numbers(drawn.found.split("equation (4):")[1])[:3] == expected.round().tolist()


def of_every_run(drawn: Picture) -> None:
    gaps = []
    for panel in drawn.panels:
        *samples, means = panel.curves
        assert (
            means.x.tolist() == [*range(1, 25)]
            and means.color == -1
            and [curve.color for curve in samples] == [0, 1, 2]
        )
        assert [curve.label for curve in samples] == ["400 µm", "440 µm", "480 µm"]
        every = np.concatenate([curve.y.reshape(8, 20) for curve in samples])
        assert np.concatenate([curve.x for curve in samples]).tolist() == np.repeat(means.x, 20).tolist()
        np.testing.assert_allclose(means.y, every.mean(axis=1))
        levels = means.y.reshape(3, 8)
        gaps += [levels[0].min() - levels[1].max(), levels[1].min() - levels[2].max()]
    assert numbers(drawn.found)[-1] == approx(min(gaps), abs=0.051) and min(gaps) > 0.5


def of_clusters(drawn: Picture) -> None:
    """The ellipse is where the distance by the covariance is 1."""
    centres = []
    for points, edge in zip(*(drawn.panels[0].curves[k::2] for k in (0, 1)), strict=True):
        cloud = np.array([points.x, points.y])
        off = np.array([edge.x, edge.y]) - cloud.mean(axis=1)[:, None]
        assert np.sum(off * np.linalg.solve(np.cov(cloud), off), axis=0) == approx(1) and len(edge.x) > 30
        assert points.look == "points" and points.color == edge.color
        centres.append(cloud[0].mean())
    assert numbers(drawn.found)[:3] == approx(centres, abs=0.051) and np.all(np.diff(centres) < -2)


def of_textiles(drawn: Picture) -> None:
    """The strong period is felt at about 25 mm/s, and the nap has none."""
    tops = [panel.shade.y[panel.shade.value.max(axis=1).argmax()] for panel in drawn.panels]
    assert numbers(drawn.found) == approx(np.round(tops)) and [panel.title[0] for panel in drawn.panels] == [*"ABCDE"]
    assert tops[:3] == approx(26 / np.array([0.35, 0.5, 0.7]), rel=0.2) and 25 < tops[3] < tops[2]
    assert all(panel.shade.value.max() == 1 and 0 < panel.shade.over.mean() < 0.5 for panel in drawn.panels)
    assert all((panel.shade.x[0], panel.shade.x[-1]) == approx((0.3, 0.65), abs=0.004) for panel in drawn.panels)


def of_expected(drawn: Picture) -> None:
    rows = drawn.table.rows
    assert [row[0] for row in rows] == ["400", "440", "480"] and [row[2] for row in rows] == ["", "", "13.9"]
    assert [row[4] for row in rows] == ["25", "", "20.8"]
    for row in rows:
        assert (row[1], row[3]) == approx((1e4 / 1.5 / float(row[0]), 1e4 / float(row[0])))
        assert all(
            float(text) == approx(hertz, abs=0.05) for hertz, text in zip(row[1::2], row[2::2], strict=True) if text
        )


def of_passive_table(drawn: Picture) -> None:
    for row in drawn.table.rows:
        mean, sd, most, least = row[3:]
        assert mean == approx(1000 * float(row[1].split()[0]) / float(row[0].split()[0]), rel=0.008)
        assert mean - 4 * sd <= least <= mean <= most <= mean + 4 * sd and 0 <= sd < 0.01 * mean
    worst = max(100 * row[4] / row[3] for row in drawn.table.rows)
    assert len(drawn.table.rows) == 12 and numbers(drawn.found)[0] == approx(worst, abs=0.051)


def of_active_table(drawn: Picture) -> None:
    samples = [[curve.y.reshape(8, 20) for curve in panel.curves[:3]] for panel in paper_oddo.every_run().panels]
    for number, row in enumerate(drawn.table.rows):
        of_runs = samples[number % 2][number // 2]
        ends = of_runs.max(axis=1).mean(), of_runs.min(axis=1).mean()
        assert row[2:] == approx((of_runs.mean(), of_runs.std(ddof=1), *ends), abs=1e-6)
    worst = max(100 * row[3] / row[2] for row in drawn.table.rows)
    assert numbers(drawn.found)[0] == approx(worst, abs=0.051) and 5 < worst < 12, "far more than in passive touch"


def of_fabrics(drawn: Picture) -> None:
    """Mass of an area: yarns of a length over their count (590.5 tex over it); frequency: 10 mm/s over the pitch."""
    counts = [(16, 16), (40, 32), (40, 40), (12, 8)]
    for (_, yarns, printed, *weights, inch, metric), both in zip(drawn.table.rows, counts, strict=True):
        warp, weft = map(int, yarns.split(" x "))
        assert (float(weights[0]) == approx(float(printed), rel=0.07)) == (yarns != "65 x 100")
        for length, weight, hertz in ((INCH_MM, weights[0], inch), (100.0, weights[1], metric)):
            assert float(weight) == approx(590.5 * (warp / both[0] + weft / both[1]) / length, abs=0.51)
            assert numbers(hertz) == approx([10 * warp / length, 10 * weft / length], abs=0.51)


def of_grid(drawn: Picture) -> None:
    assert [row[1] for row in drawn.table.rows] == list(paper_textiles.PRINTED_BANDS)
    assert [row[0] for row in drawn.table.rows] == [f"f{k} - f{k + 1}" for k in range(9)]
    assert sum(row[3] for row in drawn.table.rows) == numbers(drawn.found)[0] == 11770


def of_roughness(drawn: Picture) -> None:
    """Yarns of the diameter of their count, over and under in turn, each with a height of its own, uneven by 15 %."""
    rough, factors = drawn.panels[0].curves[0].y, []
    for number, weave in enumerate(paper_textiles.PRINTED_FABRICS.values()):
        made_up = paper_textiles.profile(weave, number)
        place, height = np.asarray(made_up.x_mm), np.asarray(made_up.height_mm)
        assert rough[number] == approx(1000 * height.std()) and (place[0], np.ptp(place)) == approx((-30, 90), abs=0.02)
        turns, radius = place * weave.yarns[0] / INCH_MM, INCH_MM / (28 * np.sqrt(weave.counts[0])) / 2
        form = radius * (np.cos(2 * np.pi * turns) + np.cos(np.pi * turns)) / 2
        for yarn in range(20):
            inside = (np.floor(turns) == yarn) & (np.abs(form) > 0.3 * radius)
            assert np.ptp(height[inside] / form[inside]) < 1e-6
            factors.append(height[inside][0] / form[inside][0])
    assert np.mean(factors) == approx(1, abs=0.06) and np.std(factors) == approx(0.15, rel=0.2)
    order = [str(1 + place) for place in np.argsort(rough)]
    assert drawn.found == f"In rising order: {' < '.join(order)}." and drawn.panels[0].names == ("1", "2", "3", "4")


NUMBERS = {name[3:]: check for name, check in globals().items() if name.startswith("of_")}


def test_passive_touch_follows_the_step_and_its_phases():
    made = paper_oddo.passive_maps()
    for panel, expected in ((4, 0.0), (3, np.angle(np.exp(-2j * np.pi * 2.36 / 0.48)))):
        shade = made.panels[panel].shade
        for time, frequency in ((1.6, 13.9), (2.4, 20.8)):
            column = int(np.argmin(np.abs(shade.x - time)))
            row = int(np.nanargmax(shade.value[:, column]))
            assert shade.y[row] == pytest.approx(frequency, rel=0.03) and shade.over[row, column]
            assert abs(np.angle(np.exp(1j * (abs(shade.phase[row, column]) - abs(expected))))) < 0.15


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
