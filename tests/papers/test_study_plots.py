"""The figure of sliding shows the rows that it is given."""

import numpy as np
import pytest
from matplotlib.text import Text

from papilla_papers import study_plots
from papilla_papers.grating_signals import GratingSignal


def texts(figure) -> list[str]:
    """All texts of a figure."""
    return [item.get_text() for item in figure.findobj(match=Text)]


def test_signals_over_gratings():
    signals = [
        GratingSignal(w, p, 10.0, 1.0, np.ones(2), np.array([w, 10 * w + p]), "quasi-static", "")
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
    said = [" ".join(text.split()) for text in texts(figure)]
    assert "2 mm gives the largest signal: 20.5 µε at a_$b$, with ridges of 0.5 mm" in said
    assert {"smooth skin", "ridges of 0.5 mm pitch", "Grey: noise of 1 to 5 µε. Dotted: the ridges' pitch."} <= set(
        said
    )
    (only,) = study_plots.signals_figure(signals[:2], ["g1", "g2"]).axes
    assert only.get_ylabel() == "signal, standard deviation (µε)"
