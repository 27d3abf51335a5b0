"""Figures of the benchmarks and of sliding show the rows that they are given."""

from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.text import Text

from papilla.view import study_plots
from papilla.view.style import ACCENTS, INK


def texts(figure) -> list[str]:
    """All texts of a figure."""
    return [item.get_text() for item in figure.findobj(match=Text)]


def row(scene, method, answered, false, median, kind="own", faults=()):
    return {"scene": scene, "method": method, "kind": kind, "answered": answered, "false": false, "median": median,
            "faults": faults}  # fmt: skip


def test_shares_and_errors_of_estimators():
    rows = [
        row("slow", "pipeline", 0.8, 0.25, 0.002), row("fast", "pipeline", 0.5, float("nan"), 9.0, faults=("late",)),
        row("slow", "STFT over the path", 1.0, 0.0, 1e-9), row("fast", "STFT over the path", 0.0, 0.0, float("nan")),
        row("slow", "old", 0.9, 0.1, 0.3, kind="published"),
    ]  # fmt: skip
    figure = study_plots.honesty_figure(rows)
    pipeline, stft, errors = figure.axes
    # In per cent: right answers first, false ones behind them; the first scene is at the top
    bars = [(bar.get_x(), bar.get_width(), bar.get_y() + bar.get_height() / 2) for bar in pipeline.patches]
    assert np.array(bars) == pytest.approx(np.array([(0, 60, 1), (0, 50, 0), (60, 20, 1), (50, 0, 0)]))
    assert [bar.get_width() for bar in stft.patches] == [100, 0, 0, 0]
    assert [label.get_text() for label in pipeline.get_yticklabels()] == ["slow", "fast"]
    assert [label.get_color() for label in pipeline.get_yticklabels()] == [INK, study_plots.FALSE]
    dots = {line.get_label(): line for line in errors.lines}
    assert dots["pipeline"].get_xdata() == pytest.approx([0.2, 300.0]) and list(dots["pipeline"].get_ydata()) == [1, 0]
    assert dots["STFT over the path"].get_xdata() == pytest.approx([1e-3])
    assert dots["pipeline"].get_markersize() > dots["STFT over the path"].get_markersize()
    assert {"published", "pipeline"} <= {text.get_text() for text in errors.get_legend().get_texts()}
    assert any(line.get_xdata()[0] == 5.0 for line in errors.lines if line.get_linestyle() == "--")
    assert "The pipeline holds its targets in 1 of 2 scenes" in texts(figure)


def test_the_price_of_presses():
    rows = [
        {"fidelity": fidelity, "element": element, "size_mm": size, "seconds_thousand": seconds, "error_sd": error,
         "pareto": pareto}
        for fidelity, element, size, seconds, error, pareto in (
            ("contact", "P1", 0.7, 40.0, 0.01, False), ("contact", "P1", 1.4, 9.0, 0.04, True),
            ("contact", "TH", 1.4, 20.0, 0.005, True), ("contact", "TH", 0.35, 900.0, 0.0, False),
            ("hertz", "P1", 1.4, 2.0, 0.2, True),
        )
    ]  # fmt: skip
    figure = study_plots.price_figure(rows, 0.35)
    (axes,) = figure.axes
    curve = next(line for line in axes.lines if line.get_marker() == "o" and line.get_color() == ACCENTS[0])
    assert list(curve.get_xdata()) == [9.0, 40.0] and list(curve.get_ydata()) == pytest.approx([4.0, 1.0])
    assert curve.get_markerfacecolor() == ACCENTS[0]
    hertz = next(line for line in axes.lines if line.get_marker() == "^" and len(line.get_xdata()))
    assert hertz.get_markerfacecolor() == "white"
    front = next(line for line in axes.lines if line.get_linestyle() == ":")
    assert list(front.get_xdata()) == [2.0, 9.0, 20.0] and front.get_ydata() == pytest.approx([20.0, 4.0, 0.5])
    assert axes.get_xscale() == axes.get_yscale() == "log"
    said = texts(figure)
    assert any("0.5 % in $S_d$ for 20 s a thousand presses: contact, TH, 1.4 mm" in " ".join(t.split()) for t in said)
    assert not any("finite" in text for text in said)
    sizes = sorted(text.get_text() for text in axes.texts)
    assert sizes == ["0.7", "1.4", "1.4", "1.4"]
    keys = [text.get_text() for text in axes.get_legend().get_texts()]
    assert keys == ["fidelity hertz", "fidelity contact", "P1", "TH", "Pareto front of hertz and contact"]
    assert 5.0 in axes.get_xticks()
    slow = [one | {"seconds_thousand": 600 * one["seconds_thousand"]} for one in rows]
    slow[0]["fidelity"] = "finite"
    figure = study_plots.price_figure(slow, 0.35)
    assert 5.0 not in figure.axes[0].get_xticks()
    assert any("finite: to itself on a finer mesh" in " ".join(text.split()) for text in texts(figure))


def test_signals_over_gratings():
    signals = [
        SimpleNamespace(wavelength_mm=w, pitch_mm=p, rms=np.array([w, 10 * w + p]))
        for w, p in ((2.0, 0.0), (1.0, 0.0), (2.0, 0.5), (1.0, 0.5))
    ]
    figure = study_plots.signals_figure(signals, ["g1", "a_$b$"])
    smooth, ridged = figure.axes
    for axes, pitch in ((smooth, 0.0), (ridged, 0.5)):
        curves = [line for line in axes.lines if line.get_marker() == "o"]
        assert [list(curve.get_xdata()) for curve in curves] == [[1.0, 2.0]] * 2
        assert list(curves[1].get_ydata()) == [10.0 + pitch, 20.0 + pitch]
        assert axes.get_ylim() == pytest.approx((0.5, 2 * 20.5)) and axes.get_yscale() == "log"
    marks = [line for line in ridged.lines if line.get_linestyle() == ":"]
    assert [mark.get_xdata()[0] for mark in marks] == [0.5]
    assert not [line for line in smooth.lines if line.get_linestyle() == ":"]
    said = texts(figure)
    assert r"2 mm gives the largest signal: 20.5 µε at a_$b$, with ridges of 0.5 mm" in said
    assert {"smooth skin", "ridges of 0.5 mm pitch", "Grey: noise of 1 to 5 µε. Dotted: the ridges' pitch."} <= set(
        said
    )
    (only,) = study_plots.signals_figure(signals[:2], ["g1", "g2"]).axes
    assert only.get_ylabel() == "signal, standard deviation (µε)"
