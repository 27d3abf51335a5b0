"""The figure of `papilla bench` shows the rows that it is given."""

import pytest
from matplotlib.text import Text

from papilla.cli.speed.price_figure import price_figure
from papilla.view.style import ACCENT_COLORS


def texts(figure) -> list[str]:
    """All texts of a figure."""
    return [item.get_text() for item in figure.findobj(match=Text)]


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
    figure = price_figure(rows, 0.35)
    (axes,) = figure.axes
    curve = next(line for line in axes.lines if line.get_marker() == "o" and line.get_color() == ACCENT_COLORS[0])
    assert list(curve.get_xdata()) == [9.0, 40.0] and list(curve.get_ydata()) == pytest.approx([4.0, 1.0])
    assert curve.get_markerfacecolor() == ACCENT_COLORS[0]
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
    figure = price_figure(slow, 0.35)
    assert 5.0 not in figure.axes[0].get_xticks()
    assert any("finite: to itself on a finer mesh" in " ".join(text.split()) for text in texts(figure))
