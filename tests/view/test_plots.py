"""Plots show the numbers they are given, and the shared style is deterministic."""

import numpy as np
import pytest
from matplotlib.text import Text

from papilla.view import plots, style

FORCE = np.linspace(0.05, 1, 20)
MODULI = np.array([0.05, 0.5, 5.0])
SD = 1e4 * FORCE[:, None] ** 0.6 * MODULI**0.1


def texts(figure) -> list[str]:
    """All texts of a figure."""
    return [item.get_text() for item in figure.findobj(match=Text)]


def test_published_curves_are_dashed_in_the_colour_of_the_nearest_modulus():
    figure = plots.sd_against_force(FORCE, MODULI, SD, (FORCE[:5], [0.51], 2 * SD[:5, 1:2]))
    lines = figure.axes[0].get_lines()
    dashed = next(line for line in lines if line.get_linestyle() == "--" and len(line.get_ydata()))
    assert dashed.get_ydata() == pytest.approx(SD[:5, 1] * 2 / 1000)
    solid = [line for line in lines if line.get_linestyle() == "-" and len(line.get_ydata())]
    assert dashed.get_color() == solid[1].get_color() and dashed.get_zorder() > solid[1].get_zorder()


def test_the_recovery_map_shows_every_press_and_marks_those_without_an_answer():
    error = np.array([0.01, -0.02, np.nan])
    figure = plots.recovery_map(np.array([0.2, 0.4, 0.8]), MODULI, error)
    dots, crosses = figure.axes[0].collections
    np.testing.assert_allclose(dots.get_array(), [1.0, -2.0])
    assert len(crosses.get_offsets()) == 1 and "no answer" in texts(figure)
    assert dots.get_clim() == (-2.0, 2.0)


def test_names_of_crowded_curves_stay_apart_and_below_the_top_of_the_axes():
    readings = np.outer([0.0, 1.0], 1000.0 - 2.0 * np.arange(6))
    figure = plots.gauge_readings(np.array([0.1, 1.0]), list("abcdef"), readings, "crowded")
    axes = figure.axes[0]
    places = sorted(text.xyann[1] for text in axes.texts)
    assert places[-1] <= 1.0
    assert np.diff(places).min() > 0.05


@pytest.mark.parametrize("value, limit", [(0.7, 0.8), (1.0, 1.0), (5.2, 6.0), (86, 100), (0.0031, 0.004), (9.9, 10)])
def test_a_nice_limit_is_round_and_never_below(value, limit):
    assert style.nice_limit(value) == pytest.approx(limit)


def test_the_same_figure_gives_the_same_bytes(tmp_path):
    pair = [plots.sd_against_modulus(MODULI, [0.1], SD[:1]) for _ in range(2)]
    assert style.svg(pair[0]) == style.svg(pair[1])
    style.write_png(pair[0], tmp_path / "plot.png")
    assert (tmp_path / "plot.png").read_bytes() == style.png(pair[1])


def test_no_plot_touches_the_global_style():
    import matplotlib

    before = dict(matplotlib.rcParams)
    plots.sd_against_modulus(MODULI, [0.1], SD[:1])
    assert dict(matplotlib.rcParams) == before


@pytest.mark.parametrize("bar", [False, True])
def test_a_narrow_figure_keeps_its_letters_and_nothing_is_cut_or_overlaps(bar):
    if bar:
        figure = plots.uncertainty_map(FORCE, MODULI, np.full((20, 3), 0.02), np.ones((20, 3), bool))
    else:
        figure = plots.sd_against_force(FORCE, MODULI, SD)
    style.titled(figure, "A message that is longer than a telephone is wide, by far", "and a detail below it " * 4)
    figure.draw_without_rendering()
    sizes = [item.get_fontsize() for item in figure.findobj(match=Text)]
    height, room = figure.get_figheight(), figure.axes[0].bbox.height
    style.narrow(figure)
    figure.draw_without_rendering()
    assert figure.get_figwidth() == style.NARROW_IN and figure.get_figheight() > height, "room for broken lines"
    assert [item.get_fontsize() for item in figure.findobj(match=Text)] == sizes
    boxes = [one.get_tightbbox() for one in (*figure.texts, *figure.axes)]
    width, height = figure.bbox.size
    assert all(box.x0 >= 0 and box.x1 <= width and box.y0 >= 0 and box.y1 <= height for box in boxes)
    assert boxes[0].y0 > boxes[1].y1, "the detail is below the message"
    assert figure.axes[0].bbox.height == pytest.approx(room, rel=0.05) and boxes[2].width > width / 2


def test_limits_and_labels_of_curves():
    figure = plots.sd_of_presses(FORCE, MODULI, SD, (FORCE[:3], np.full(3, 0.45), SD[:3, 1], np.array([5.0, 6.0, 7.0])))
    (axes,) = figure.axes
    assert axes.get_xlim()[0] == 0 and axes.get_ylim()[0] == 0 and axes.get_ylabel() == "$S_d$ (µε)"
    dots = [bar.lines[0] for bar in axes.containers]
    assert [dot.get_xydata().ravel().tolist() for dot in dots] == [
        [f, s] for f, s in zip(FORCE[:3], SD[:3, 1], strict=True)
    ]
    curve = next(line for line in axes.lines if len(line.get_xdata()) == len(FORCE) and line.get_ydata()[0] == SD[0, 1])
    assert {dot.get_color() for dot in dots} == {curve.get_color()}
    heights = [bar.lines[2][0].get_segments()[0] for bar in axes.containers]
    assert [np.ptp(one[:, 1]) for one in heights] == pytest.approx([10.0, 12.0, 14.0])
    figure = plots.sd_against_force(FORCE, MODULI, SD)
    (axes,) = figure.axes
    np.testing.assert_allclose(np.array([line.get_ydata() for line in axes.lines]).T, SD / 1000)
    assert {"0.05 MPa", "0.5 MPa", "5 MPa"} <= set(texts(figure)) and axes.get_xlabel() == "force (N)"
    assert axes.get_xlim() == (0, 1.0) and axes.get_ylim()[0] == 0
    (axes,) = plots.sd_against_modulus(MODULI, [0.1], SD[:1]).axes
    assert axes.lines[0].get_ydata() == pytest.approx(SD[0] / 1000) and axes.texts[0].get_text() == "0.1 N"
    assert axes.get_xlim() == (0.05, 5.0) and axes.get_xscale() == "log" and axes.get_ylim()[0] == 0
    assert [line.get_linewidth() for line in axes.lines] == [style.THICK_PT]


def test_residuals_have_a_band_of_two_sigmas():
    residual = np.column_stack([FORCE, -FORCE])
    figure = plots.residuals_against_force(FORCE, ["g1", "g2"], residual)
    (axes,) = figure.axes
    band = axes.patches[0].get_extents().transformed(axes.transData.inverted())
    assert (band.y0, band.y1) == pytest.approx((-2, 2)) and axes.get_xlim()[0] == 0
    assert [list(line.get_ydata()) for line in axes.lines] == [list(FORCE), list(-FORCE)]
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["g1", "g2"]


def test_the_shades_of_an_uncertainty():
    sigma = np.tile([1e-5, 0.03, 0.9], (20, 1))
    figure = plots.uncertainty_map(FORCE, MODULI, sigma, sigma < 0.5, (0.2, 1.0, 0.05, 0.5))
    axes, bar = figure.axes
    assert [text.get_text() for text in bar.get_yticklabels()] == [f"{level:g} %" for level in plots.SIGMA_LEVELS]
    shades = axes.collections[0]
    assert 10**shades.levels == pytest.approx(plots.SIGMA_LEVELS)
    # What is below the first level has its colour; what is not identified has none
    assert np.nanmin(shades.zmin) >= np.log10(0.1) - 1e-9
    (hatched,) = [item for item in axes.collections if getattr(item, "hatches", None) == ["////"]]
    assert min(path.vertices[:, 1].min() for path in hatched.get_paths() if len(path.vertices)) > 0.5
    assert "not identifiable" in texts(figure) and "where recovery was checked" in texts(figure)
    (box,) = [patch for patch in axes.patches if not patch.get_fill()]
    assert (box.get_x(), box.get_y(), box.get_width(), box.get_height()) == pytest.approx((0.2, 0.05, 0.8, 0.45))
    assert axes.get_xlim() == (0.05, 1.0) and axes.get_ylim() == (0.05, 5.0)
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("force (N)", "modulus of the specimen (MPa)")


def test_recovered_moduli_in_per_cent_with_room_around():
    force = np.array([0.2, 0.8])
    figure = plots.recovery_map(force, MODULI[:2], np.array([0.021, -0.01]))
    axes, bar = figure.axes
    (dots,) = axes.collections
    assert dots.get_offsets().tolist() == [[0.2, 0.05], [0.8, 0.5]] and dots.get_clim() == (-3.0, 3.0)
    assert axes.get_xlim() == pytest.approx((0.2 / plots.AXES_MARGIN, 0.8 * plots.AXES_MARGIN))
    assert axes.get_legend() is None and bar.get_ylabel() == "error of the recovered E (%)"
    assert plots.recovery_map(force, MODULI[:2], np.full(2, np.nan)).axes[0].get_legend() is not None


def test_gauges_are_drawn_in_order_and_their_mirror_images_dashed():
    names = ["g1", "g2", "g3", "g4", "g5"]
    readings = 1000 * np.outer(FORCE, [-1.0, 2.0, 5.0, 2.0001, -1.5])
    (axes,) = plots.gauge_readings(FORCE, names, readings, "title").axes
    zero, *curves = axes.lines
    assert list(zero.get_ydata()) == [0, 0]
    assert [curve.get_linestyle() for curve in curves] == ["-", "-", "-", "--", "--"]
    assert [curve.get_color() for curve in curves] == list(style.ACCENT_COLORS[:5])
    assert [curve.get_ydata()[-1] for curve in curves] == pytest.approx([-1.0, 2.0, 5.0, 2.0001, -1.5])
    labels = {text.get_text(): text for text in axes.texts}
    assert set(labels) == {"g1", "g2, g4", "g3", "g5"} and axes.get_title(loc="left") == "title"
    low, high = axes.get_ylim()
    for name, value in (("g1", -1.0), ("g2, g4", 2.0), ("g3", 5.0), ("g5", -1.5)):
        assert labels[name].xy == (1.0, pytest.approx(value))
        place = labels[name].xyann[1]
        assert place == pytest.approx((value - low) / (high - low), abs=1e-9) or name == "g1"
    assert labels["g1"].xyann[1] - labels["g5"].xyann[1] >= plots.NAME_GAP - 1e-12
    assert labels["g3"].get_color() == style.ACCENT_COLORS[2]


def test_a_curve_without_its_last_values_is_named_at_its_last_one():
    sd = SD.copy()
    sd[-5:, 2] = np.nan
    (axes,) = plots.sd_against_force(FORCE, MODULI, sd).axes
    assert next(text for text in axes.texts if text.get_text() == "5 MPa").xy[1] == pytest.approx(SD[-6, 2] / 1000)
