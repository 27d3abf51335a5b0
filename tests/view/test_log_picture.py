"""The picture of a log: which panels it has, what its strips and bands show, and the line in the spectrum."""

import numpy as np
import pytest
from matplotlib.colors import to_rgba
from shown_figures import flaws

from papilla.estimators import Pipeline, find_lines
from papilla.view.log_picture import DOUBT_COLORS, OK_COLOR, REMARK_COLOR, LogPicture
from papilla.view.style import png


def drawn(columns, gauges=2, rows=3000):
    """The figure of a slide to and fro over 1.5 mm, and the pipeline's answer."""
    rng = np.random.default_rng(3)
    time = np.arange(rows) / 1000
    velocity = 60 * np.sin(2 * np.pi * time)
    place = np.cumsum(velocity) / 1000
    readings = 10 * np.sin(2 * np.pi * (place[:, None] - np.arange(gauges)) / 1.5) + rng.normal(0, 1, (rows, gauges))
    force = np.full(rows, 0.5)
    values = {"force_N": force, "velocity_mm_s": velocity, "tangential_N": 0.3 * force * np.sign(velocity)}
    block = np.column_stack([time, readings, *(values[name] for name in columns)])
    pipeline = Pipeline(gauges=gauges, columns=columns)
    answer = pipeline.process(block)
    picture = LogPicture([f"g{n + 1}" for n in range(gauges)], columns, pipeline.off)
    for part in np.array_split(np.arange(rows), 3):
        picture.add(block[part], type(answer)(*(np.array(column, object)[part] for column in answer)))
    spectrum = find_lines(place, readings) if "velocity_mm_s" in columns and gauges else None
    return picture.figure("a_$log$.csv", "detail", spectrum), answer


def test_what_was_measured_stands_above_what_was_estimated():
    figure, answer = drawn(("force_N", "velocity_mm_s", "tangential_N"))
    labels = [axes.get_ylabel().replace("\n", " ") for axes in figure.axes]
    assert labels == [
        "readings (µε)", "force (N)", "tangential force (N)", "velocity (mm/s)", "wavelength (mm)",
        "kinetic friction", "", "spectrum over the path",
    ]  # fmt: skip
    wavelength, strips, spectrum = figure.axes[4], figure.axes[6], figure.axes[7]
    shown = wavelength.lines[1].get_ydata()
    assert np.nanmedian(shown) == pytest.approx(1.5, rel=1e-2) and np.isnan(shown).any()
    low, high = wavelength.get_ylim()
    assert 1.0 < low < 1.5 < high < 2.0
    told = {text.get_text() for text in strips.get_legend().get_texts()}
    assert told == {*answer.wavelength_status} | {*answer.friction_status}
    # The last rows are ok: the last span of the strip is blue and ends with the log
    assert strips.collections[0].get_facecolor()[-1] == pytest.approx(to_rgba(OK_COLOR))
    assert [text.get_text() for text in spectrum.texts][0] == "1.5 mm" and spectrum.texts[0].get_color() == OK_COLOR
    # A strip a quantity, the first at the top; its bars begin and end with the log and leave no gap
    names = [text.get_text() for text in strips.get_yticklabels()]
    assert names == ["wavelength", "friction"] and strips.get_ylim() == (1.5, -0.5)
    for number, bars in enumerate(strips.collections):
        left, right = np.array([path.vertices[:, 0] for path in bars.get_paths()])[:, [0, 2]].T
        assert left[0] == strips.get_xlim()[0] == pytest.approx(0.0, abs=2e-3) and left[1:] == pytest.approx(right[:-1])
        assert right[-1] == strips.get_xlim()[1] == pytest.approx(3.0, rel=2e-2)
        assert bars.get_paths()[0].get_extents().y0 == pytest.approx(number - 0.4)
    assert len(png(figure, dpi=50)) > 10_000 and flaws(figure) == []


def test_a_quantity_that_is_held_constant_does_not_show_its_rounding():
    rows, rng = 600, np.random.default_rng(1)
    held = 20 + 1e-11 * rng.normal(size=rows)
    block = np.column_stack([np.arange(rows) / 1000, rng.normal(0, 1, rows), held])
    pipeline = Pipeline(gauges=1, columns=("velocity_mm_s",))
    answer = pipeline.process(block)
    picture = LogPicture(["g1"], ("velocity_mm_s",), pipeline.off)
    picture.add(block, type(answer)(*(np.array(column, object) for column in answer)))
    axes = picture.figure("log", "", None).axes[1]
    assert axes.get_ylabel() == "velocity\n(mm/s)" and axes.get_ylim() == pytest.approx((18.0, 22.0), rel=1e-6)
    assert axes.yaxis.get_major_formatter().get_useOffset() is False


def test_names_of_lines_in_the_spectrum_stay_apart():
    """Lines at 2 mm, at 2.05 mm and at 0.5 mm: the first and the third have room for their names."""
    place, rng = np.arange(0, 400, 0.05), np.random.default_rng(5)
    readings = sum(np.sin(2 * np.pi * place / one) for one in (2.0, 2.05, 0.5)) + 0.1 * rng.normal(size=place.size)
    spectrum = find_lines(place, readings[:, None])
    found = sorted(line.wavelength_mm for line in spectrum.lines)
    assert len(found) >= 3 and np.abs(np.array(found)[:, None] / [2.0, 2.05, 0.5] - 1).min(axis=0).max() < 1e-3
    pipeline = Pipeline(gauges=1, columns=())
    block = np.column_stack([np.arange(100) / 1000, readings[:100]])
    picture = LogPicture(["g1"], (), pipeline.off)
    picture.add(block, pipeline.process(block))
    axes = picture.figure("log", "", spectrum).axes[-1]
    shown = [float(text.get_text().split()[0]) for text in axes.texts]
    assert len(shown) == 2 and np.sort(shown)[0] == pytest.approx(0.5, rel=1e-3)
    positive = spectrum.wavenumber_per_mm > 0
    wavelength, power = 1 / spectrum.wavenumber_per_mm[positive], spectrum.power[positive]
    for text in axes.texts:
        over, at = text.xy
        assert over == pytest.approx(float(text.get_text().split()[0]), rel=1e-3), "over its line"
        assert at == power[np.abs(wavelength - over).argmin()] and text.xyann == (0, 4)
        line = min(spectrum.lines, key=lambda one: abs(one.wavelength_mm - over))
        assert (text.get_color() == OK_COLOR) == (line.harmonic == 1)
    assert axes.get_xlim() == pytest.approx((wavelength.min(), wavelength.max()))
    assert axes.get_ylim() == pytest.approx((max(np.median(power) / 10, 1e-6), 8 * power.max()))
    peaks = axes.collections[0].get_paths()[0].vertices
    assert peaks[:, 1].max() == power.max() and peaks[:, 0].max() == pytest.approx(wavelength.max())


def test_curves_bands_limits_and_strips_are_those_of_the_answers():
    """Drawn answers: usable values in their band of two deviations, and the colour of each row's code."""
    rng, rows, columns = np.random.default_rng(11), 400, ("force_N", "velocity_mm_s", "tangential_N")
    time = np.arange(rows) / 1000
    block = np.column_stack([time, rng.normal(size=(rows, 2)), 1 + rng.random((rows, 3)) * [1, 2, 3]])
    pipeline = Pipeline(gauges=2, columns=columns)
    codes = [rng.choice(["ok", "ok: aged", "doubt", "none"], rows // 4).repeat(4).tolist() for _ in range(2)]
    values, sigmas = 1 + rng.random((2, rows)), 0.1 * rng.random((2, rows))
    answer = pipeline.process(block)._replace(
        wavelength_mm=values[0], wavelength_sigma_mm=sigmas[0], wavelength_status=codes[0], mu_kinetic=values[1],
        mu_kinetic_sigma=sigmas[1], friction_status=codes[1],
    )  # fmt: skip
    picture = LogPicture(["g1", "g2"], columns, pipeline.off)
    picture.add(block, answer)
    figure = picture.figure("log", "detail", None)
    readings, force, tangential, velocity, *answers, strips = figure.axes
    assert figure.get_size_inches() == pytest.approx([10, 1.3 * (2 + 3 + 2 + 2 * 0.3 + 1)])
    assert [text.get_text() for text in readings.get_legend().get_texts()] == ["g1", "g2"]
    pairs = [
        (readings.lines[0], 1),
        (readings.lines[1], 2),
        (force.lines[0], 3),
        (velocity.lines[0], 4),
        (tangential.lines[0], 5),
    ]
    for line, column in pairs:
        assert line.get_xydata() == pytest.approx(block[:, [0, column]])
    for panel, value, sigma, code in zip(answers, values, sigmas, codes, strict=True):
        usable = np.array([one.startswith("ok") for one in code])
        every, used = panel.lines
        assert every.get_ydata() == pytest.approx(value)
        assert used.get_ydata() == pytest.approx(np.where(usable, value, np.nan), nan_ok=True)
        low, high = (value - 2 * sigma)[usable], (value + 2 * sigma)[usable]
        band = np.concatenate([path.vertices[:, 1] for path in panel.collections[1].get_paths()])
        assert (band.min(), band.max()) == pytest.approx((low.min(), high.max()))
        bottom, top = np.percentile(low, 3), np.percentile(high, 97)
        room = 0.3 * (top - bottom)
        assert panel.get_ylim() == pytest.approx((bottom - room, top + room))
    assert [panel.get_legend() is None for panel in answers] == [False, True]
    order = list(dict.fromkeys(one for one in codes[0] if not one.startswith("ok")))
    shades = {"ok": OK_COLOR, "ok: aged": REMARK_COLOR} | dict(zip(order, DOUBT_COLORS, strict=False))
    for number, code in enumerate(codes):
        bars = strips.collections[number]
        starts = [row for row in range(rows) if row == 0 or code[row] != code[row - 1]]
        boxes = [path.get_extents() for path in bars.get_paths()]
        assert [box.x0 for box in boxes] == pytest.approx(time[starts]) and boxes[-1].x1 == pytest.approx(0.4)
        assert bars.get_facecolor() == pytest.approx(np.array([to_rgba(shades[code[row]]) for row in starts]))
        assert (boxes[0].y0, boxes[0].y1) == pytest.approx((number - 0.4, number + 0.4))
    keys = {
        text.get_text(): key.get_facecolor()
        for text, key in zip(*[strips.get_legend().get_texts(), strips.get_legend().get_patches()], strict=True)
    }
    assert keys == {code: to_rgba(shade) for code, shade in shades.items()}
    assert {axes.get_xlim() for axes in figure.axes} == {strips.get_xlim()} and strips.get_xlabel() == "time (s)"
    assert not any(label.get_visible() for axes in figure.axes[:-1] for label in axes.get_xticklabels())


def test_a_log_without_a_velocity_shows_its_frequency():
    figure, _ = drawn((), gauges=1, rows=600)
    assert [axes.get_ylabel().replace("\n", " ") for axes in figure.axes] == ["readings (µε)", "frequency (Hz)"]
    assert figure.axes[-1].get_xlabel() == "time (s)"
