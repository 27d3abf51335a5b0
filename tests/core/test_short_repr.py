"""What holds arrays shows their shapes: a repr is one short line."""

from dataclasses import make_dataclass

import numpy as np
import pytest

from papilla.calibration import BicubicSurface, PositionTerms
from papilla.core.short_repr import html_table, short_repr
from papilla.identification import MaterialTests, fit_material
from papilla.logs import PressLog
from papilla.model.materials import NeoHookean

STRETCH = np.linspace(1.0, 2.0, 30)
TESTS = MaterialTests(STRETCH, NeoHookean(0.1).nominal_stress(STRETCH, "uniaxial"), "uniaxial")


@pytest.mark.parametrize(
    "thing, shown",
    [
        (
            BicubicSurface((0.05, 1.0), (0.02, 5.0), np.zeros((9, 15))),
            "Surface(force_N=(0.05, 1.0), modulus_MPa=(0.02, 5.0), coefficients=<9 x 15>)",
        ),
        (
            PressLog(np.ones(5), np.ones(5), np.ones((5, 2)), ("g1", "g2")),
            "force_N=<5>, modulus_MPa=<5>, readings=<5 x 2>",
        ),
        (PositionTerms((0.05, 1.0), (0.02, 5.0), 4.0, np.zeros((2, 5, 6, 11)), np.zeros((2, 9))), "error=<2 x 9>)"),
        (TESTS, "MaterialTests(stretch=<30>, stress=<30>, mode=<30>)"),
        (fit_material("ogden", TESTS), "covariance=<2 x 2>"),
    ],
    ids=lambda value: type(value).__name__,
)
def test_arrays_are_shown_by_their_shapes(thing, shown):
    assert shown in repr(thing) and "\n" not in repr(thing) and len(repr(thing)) < 400


def test_a_table_of_a_notebook_has_five_digits_and_no_markup_of_its_cells():
    page = html_table("a < b", [("x & y", 1.2345678), (3, "z")], ("name", "µ"))
    assert page.startswith("<b>a &lt; b</b><table><tr><th>name</th><th>µ</th></tr><tr><td>x &amp; y</td>")
    assert page.endswith("<td>1.2346</td></tr><tr><td>3</td><td>z</td></tr></table>")
    assert "<th>" not in html_table("t", [(1,)])


@pytest.mark.parametrize("letters", [58, 59, 500])
def test_a_text_takes_at_most_sixty_letters(letters):
    text = short_repr(make_dataclass("Holder", ["text"])("x" * letters)).removeprefix("Holder(text=").removesuffix(")")
    assert len(text) == 60 and ("..." in text) == (letters > 58) and text[0] == text[-1] == "'"
