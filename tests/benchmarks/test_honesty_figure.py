"""The figure of the comparison of estimators shows the rows that it is given."""

import numpy as np
import pytest
from matplotlib.text import Text

from benchmarks.estimators import honesty_figure
from papilla.view.style import INK


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
    figure = honesty_figure.honesty_figure(rows)
    pipeline, stft, errors = figure.axes
    # In per cent: right answers first, false ones behind them; the first scene is at the top
    bars = [(bar.get_x(), bar.get_width(), bar.get_y() + bar.get_height() / 2) for bar in pipeline.patches]
    assert np.array(bars) == pytest.approx(np.array([(0, 60, 1), (0, 50, 0), (60, 20, 1), (50, 0, 0)]))
    assert [bar.get_width() for bar in stft.patches] == [100, 0, 0, 0]
    assert [label.get_text() for label in pipeline.get_yticklabels()] == ["slow", "fast"]
    assert [label.get_color() for label in pipeline.get_yticklabels()] == [INK, honesty_figure.FALSE]
    dots = {line.get_label(): line for line in errors.lines}
    assert dots["pipeline"].get_xdata() == pytest.approx([0.2, 300.0]) and list(dots["pipeline"].get_ydata()) == [1, 0]
    assert dots["STFT over the path"].get_xdata() == pytest.approx([1e-3])
    assert dots["pipeline"].get_markersize() > dots["STFT over the path"].get_markersize()
    assert {"published", "pipeline"} <= {text.get_text() for text in errors.get_legend().get_texts()}
    assert any(line.get_xdata()[0] == 5.0 for line in errors.lines if line.get_linestyle() == "--")
    assert "The pipeline holds its targets in 1 of 2 scenes" in texts(figure)
