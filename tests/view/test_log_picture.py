"""The picture of a log: which panels it has, what its strips and bands show, and the line in the spectrum."""

import numpy as np
import pytest
from matplotlib.colors import to_rgba
from shown_figures import flaws

from papilla.estimators import Pipeline, find_lines
from papilla.view.log_picture import OK_COLOR, LogPicture
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
    for text in axes.texts:
        assert np.asarray(text.xy)[0] == pytest.approx(float(text.get_text().split()[0]), rel=1e-3), "over its line"


def test_a_log_without_a_velocity_shows_its_frequency():
    figure, _ = drawn((), gauges=1, rows=600)
    assert [axes.get_ylabel().replace("\n", " ") for axes in figure.axes] == ["readings (µε)", "frequency (Hz)"]
    assert figure.axes[-1].get_xlabel() == "time (s)"
