"""Names of fingers and gauges in pictures and pages: letter by letter, whatever signs they have."""

import json
import random
from dataclasses import replace
from html import escape

import numpy as np
import pytest
from matplotlib.text import Text
from odd_names import odd_names

from papilla.view import plots, strain_field, style, turning

FORCE = np.linspace(0.05, 1, 20)


def texts(figure) -> str:
    return "\n".join(text.get_text() for text in figure.findobj(Text))


def shown(name: str) -> str:
    """The beginning of a long name."""
    return name if len(name) <= style.PICTURE_NAME_LETTERS else name[: style.PICTURE_NAME_LETTERS - 1]


FIGURES = {
    "readings": lambda names: plots.gauge_readings(FORCE, names, np.outer(FORCE, np.arange(1.0, 1 + len(names))), ""),
    "residuals": lambda names: plots.residuals_against_force(FORCE, names, np.outer(FORCE, np.arange(len(names)))),
}


@pytest.mark.parametrize("draw", FIGURES.values(), ids=FIGURES)
@pytest.mark.parametrize("seed", range(4))
def test_names_are_drawn_letter_by_letter(draw, seed):
    names = odd_names(random.Random(seed), 4)
    figure = draw(names)
    assert style.svg(figure) and style.png(figure), "without a warning"
    assert all(shown(name) in texts(figure) for name in names)


def test_papilla_s_own_formulas_are_drawn_as_formulas():
    figure = plots.sd_against_modulus(np.array([0.05, 0.5, 5.0]), [0.5], np.ones((1, 3)))
    label = figure.axes[0].yaxis.label
    assert "$S_d$" in label.get_text() and label.get_parse_math()
    assert not any(text.get_parse_math() for text in figure.axes[0].texts)


@pytest.fixture
def odd(scene):
    """The scene with drawn names."""
    finger, *gauges = odd_names(random.Random(7), 6)
    named = [replace(gauge, name=name) for gauge, name in zip(scene.finger.gauges, gauges, strict=True)]
    named = replace(scene.finger, name=finger, gauges=tuple(named))
    reduced = replace(scene.reduced, finger_sha256=named.sha256, finger_name=finger, gauge_names=tuple(gauges))
    return replace(scene, finger=named, reduced=reduced)


def test_a_page_to_turn_shows_the_names(odd):
    """plotly reads tags in a text as HTML."""
    pytest.importorskip("plotly")
    pressed = strain_field.PressScene(odd.field, odd.press, odd.specimen)
    page = turning.strain_html([pressed], odd.reduced, odd.finger)
    data, *_ = json.JSONDecoder().raw_decode(page, page.index("[", page.rindex("Plotly.newPlot")))
    names = next(trace["text"] for trace in data if trace.get("mode") == "text")
    assert names == [escape(gauge.name) for gauge in odd.finger.gauges]
    assert "<script>alert" not in page
