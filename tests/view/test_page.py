"""Numbers, pictures and words of pages."""

import base64

import pytest

from papilla.core.errors import InputError
from papilla.view import page, style


@pytest.mark.parametrize(
    "value, digits, text",
    [
        (0.123456, 3, "0.123"), (12.3456, 3, "12.3"), (1234.5, 3, "1\u202f230"), (123456.0, 3, "123\u202f000"),
        (-0.5, 3, "−0.500"), (0.99996, 3, "1.00"), (0, 3, "0"), (1e-7, 3, "1.00·10<sup>−7</sup>"),
        (-2.5e9, 2, "−2.5·10<sup>9</sup>"), (1e-5, 3, "0.0000100"), (1e-6, 3, "1.00·10<sup>−6</sup>"),
        (1.234e5, 3, "123\u202f000"), (1.234e6, 3, "1.23·10<sup>6</sup>"), (float("nan"), 3, "–"), (None, 3, "–"),
        (float("inf"), 3, "∞"),
    ],
)  # fmt: skip
def test_a_number_has_its_significant_digits(value, digits, text):
    assert page.number(value, digits) == text


def test_a_number_may_show_its_sign():
    assert page.number(0.25, 2, sign=True) == "+0.25" and page.number(-0.25, 2, sign=True) == "−0.25"
    assert page.percent(0.0123) == "1.2\u00a0%" and page.percent(None) == "–\u00a0%"
    assert page.percent(0.5, 3, sign=True) == "+50.0\u00a0%"
    assert page.plain(12345) == "12\u202f345" and page.plain(-0.125) == "−0.125" and page.plain(2.0) == "2"


def test_a_template_knows_the_filters_and_refuses_what_is_missing():
    made = page.environment("papilla.view")
    assert made.from_string("{{ x|number }} {{ y|percent }} {{ z|plain }}").render(x=1.5, y=0.5, z=3) == (
        "1.50 50\u00a0% 3"
    )
    assert made.from_string("{{ '<b>' }}").render() == "&lt;b&gt;"
    with pytest.raises(Exception, match="undefined"):
        made.from_string("{{ nothing }}").render()


def test_a_page_has_a_wide_and_a_narrow_picture():
    shown = page.either([b"wide", b"small"], 'a "name"', "png")
    wide, small = (base64.b64encode(one).decode() for one in (b"wide", b"small"))
    assert f'srcset="data:image/png;base64,{small}"' in shown and f'src="data:image/png;base64,{wide}"' in shown
    assert 'alt="a &#34;name&#34;"' in shown
    with style.styled() as figure:
        figure.subplots().plot([0, 1], [0, 1])
        width = figure.get_figwidth()
        both = page.image(figure, "a line")
    assert figure.get_figwidth() == style.NARROW_IN < width and both.count("data:image/svg+xml;base64,") == 2


def test_texts_stand_below_each_other_and_axes_below_them():
    with style.styled(5.0, 3.0) as figure:
        axes = figure.subplots()
        axes.set_title("title")
        style.titled(figure, "A message in one line", "A detail that is longer than the figure is wide " * 2, 10)
        figure.draw_without_rendering()
        figure.draw_without_rendering()
    message, detail = figure.texts
    assert (message.get_fontsize(), detail.get_fontsize()) == (10, 7.5) and message.get_weight() == "bold"
    assert detail.get_text().count("\n") == 1 and detail.get_color() == style.MUTED_COLOR
    boxes = [one.get_tightbbox() for one in (message, detail, axes)]
    assert figure.bbox.height > boxes[0].y1 > boxes[0].y0 > boxes[1].y1 > boxes[1].y0 > boxes[2].y1
    assert boxes[0].x0 == pytest.approx(boxes[1].x0, abs=1) and boxes[1].x1 <= figure.bbox.width


def test_a_logarithmic_axis_has_plain_numbers():
    with style.styled() as figure:
        axes = figure.subplots()
        axes.set(xscale="log", xlim=(0.09, 21))
        style.plain_log(axes.xaxis)
        ticks = [tick for tick in axes.get_xticks() if 0.09 <= tick <= 21]
        assert ticks == pytest.approx([0.1, 0.2, 0.5, 1, 2, 5, 10, 20])
        assert axes.xaxis.get_major_formatter()(0.5, 0) == "0.5" and len(axes.get_xticks(minor=True)) == 0
        style.plain_log(axes.xaxis, (1.0,))
        assert [t for t in axes.get_xticks() if 0.09 <= t <= 21] == pytest.approx([0.1, 1, 10])


def test_a_bar_of_signed_values_is_symmetric_and_below():
    with style.styled() as figure:
        axes = figure.subplots()
        bar = style.diverging_bar(axes, 3.0, "strain (%)")
        figure.draw_without_rendering()
    assert bar.mappable.get_clim() == (-3.0, 3.0) and bar.ax.get_xlabel() == "strain (%)"
    assert list(bar.get_ticks()) == [-3.0, -1.5, 0.0, 1.5, 3.0]
    own, above = bar.ax.get_position(), axes.get_position()
    assert own.y1 < above.y0 and own.x0 + own.x1 == pytest.approx(above.x0 + above.x1, abs=0.02)
    assert own.width / above.width == pytest.approx(0.5, abs=0.03)


def test_the_kind_of_a_picture_is_the_ending_of_its_name():
    assert [style.kind_of(f"a.b.{end}") for end in ("PNG", "pdf", "svg")] == ["png", "pdf", "svg"]
    with pytest.raises(InputError, match="x.gif: pictures are written as .png, .pdf, .svg, not as gif"):
        style.kind_of("x.gif")
    with pytest.raises(InputError, match="not as a name without"):
        style.kind_of("picture")


@pytest.mark.parametrize("kind, start", [("png", b"\x89PNG"), ("pdf", b"%PDF"), ("svg", b"<?xml")])
def test_a_picture_has_no_date_and_program(kind, start):
    with style.styled() as figure:
        figure.subplots()
    found = style.content(figure, kind, 50)
    assert found.startswith(start)
    for word in (b"Matplotlib v", b"CreationDate", b"<dc:date>", b"Software"):
        assert word not in found


def test_words_of_friction():
    assert style.friction_text(0.5) == "friction 0.5" and style.friction_text(float("inf")) == "friction stick"
