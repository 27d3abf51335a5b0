"""The comparison of estimators: its judge on answers that are known, the rivals, the command, small."""

import dataclasses
import json
import math
import re

import numpy as np
import pytest
from matplotlib.text import Text

from benchmarks import estimator_comparison as command
from benchmarks.estimators import comparison, cost, methods, touches
from benchmarks.estimators.honesty_figure import honesty_figure
from benchmarks.estimators.methods import METHODS, PRODUCT, PUBLISHED, RIVAL, Answer, chosen
from papilla.cli.output import json_text
from papilla.core.errors import InputError
from papilla.scenes.scenes import scene

SMALL = comparison.Plan(
    scenes=("start", "const, hum only"), methods=("pipeline", "STFT over"), seeds=(3, 4), longest_s=0.4
)


# ---- The judge


def judged(made, factor=1.0, sigma=0.01, ok=True, path_mm=None):
    """A run of a method that answers `factor` (a number, or (n,)) times the truth."""
    wavelength = factor * made.wavelength_mm
    answer = Answer(wavelength, sigma * wavelength, np.broadcast_to(ok, made.time_s.shape))
    return comparison.judged(made, answer, path_mm, 7.0)


@pytest.fixture(scope="module")
def grating():
    return scene("const", 1.8, seed=1, seconds=1.0)


def row_of(*runs, name="const", method="pipeline"):
    return comparison.row_of(name, method, runs)


def test_right_answers_are_not_false_and_within_sigma(grating):
    row = row_of(judged(grating, 1.015))
    assert row.answered == row.claimed == row.covered == 1 and row.false == row.over_5 == row.first_right_s == 0
    assert (row.median, row.rms) == pytest.approx((0.015, 0.015)) and row.over_sigma == pytest.approx(1.5 / 1.015)
    assert row_of(judged(grating, 1.03)).covered == 0


def test_what_is_false_is_counted_among_ok_alone(grating):
    factor, ok = np.ones(1000), np.zeros(1000, bool)
    ok[200:600], factor[500:700] = True, 1.2
    run = judged(grating, factor, ok=ok)
    row = row_of(run)
    assert row.false == 0.25 and row.false_settled == pytest.approx(1 / 3, abs=0.01), (
        "100 rows of 400, of 300 late ones"
    )
    past = grating.travelled_mm > 12
    assert row.answered == pytest.approx(ok[run.asked].mean()) and row.over_5 == pytest.approx(200 / past.sum())
    early = np.where(np.arange(1000) < 100, 1.5, 1.0)
    row = row_of(judged(grating, early))
    assert row.false == pytest.approx(0.1) and row.false_settled == 0 and row.first_right_s == pytest.approx(0.1)


def test_any_answer_is_false_without_a_line_and_either_line_is_right(grating):
    row = row_of(judged(grating, math.nan, ok=False))
    assert row.answered == row.claimed == 0 and row.over_5 == 1 and row.median == row.first_right_s == math.inf
    assert math.isnan(row.false) and math.isnan(row.rms)
    made = scene("const, hum only", 1.8, seed=1, seconds=1.0)
    answer = Answer(np.full(1000, 2.0), np.full(1000, 1.0), np.arange(1000) < 600)
    row = row_of(comparison.judged(made, answer, None, 1.0), name=made.name)
    assert row.false == row.claimed == 1 and math.isnan(row.covered + row.rms + row.median)
    two = scene("const, two lines", 1.8, seed=1, seconds=1.0)
    second = two.others_mm[0] / two.wavelength_mm
    assert row_of(judged(two, np.where(np.arange(1000) % 2, second, 1.0)), name=two.name).false == 0


def test_after_a_step_everything_begins_anew():
    made = scene("step", 1.2, seed=1, seconds=2.0)
    change = int(np.flatnonzero(np.diff(made.wavelength_mm))[0]) + 1
    held = np.where(np.arange(2000) < change + 80, made.wavelength_mm[0], made.wavelength_mm[-1])
    row = row_of(judged(made, held / made.wavelength_mm), name="step")
    assert row.first_right_s == pytest.approx(0.08) and row.false == pytest.approx(80 / 2000, abs=2e-3)
    assert row.false_settled == row.over_5 == 0, "12 mm, 0.3 s and two periods count from the step on"


def test_the_error_over_the_bound_is_that_of_the_path_remembered():
    made = scene("const", 1.8, seed=1, seconds=3.0)
    assert judged(made, 1 + 2 * made.bound(path_mm=96.0), path_mm=96.0).bound_square == pytest.approx(4)
    for other in (scene("harsh", 1.8, seed=1, seconds=3.0), scene("start", 1.8)):
        assert math.isnan(judged(other, path_mm=96.0).bound_square)


def at(frequency_Hz, mains_Hz=math.nan, speed=100.0, change=0.0):
    """A scene at a speed that is constant, or changes by a share of it, whose line has a frequency."""
    made = scene("const", speed / frequency_Hz, seed=1, seconds=1.0)
    velocity = speed * (1 + change * np.sin(2 * math.pi * made.time_s))
    return dataclasses.replace(made, velocity_mm_s=velocity, mains_Hz=mains_Hz)


@pytest.mark.parametrize(
    "made, from_mm",
    [
        (at(80.0), 5), (at(53.0), 100 / 3), (at(124.0), 25), (at(124.0, speed=200.0), 50), (at(50.0), math.inf),
        (at(80.0, mains_Hz=50.0), 30), (at(53.0, mains_Hz=50.0), 100), (at(104.0, mains_Hz=50.0), 150),
        (at(50.0, change=0.1), 0), (scene("const, hum only", 1.8, seconds=1.0), 0),
    ],
)  # fmt: skip
def test_an_answer_is_asked_for_once_the_path_tells_the_line_from_the_mains(made, from_mm):
    for path in (0.97 * from_mm, 1.03 * from_mm) if 0 < from_mm < math.inf else (1.0, 1e3):
        assert made.tellable(np.full(1000, path)).tolist() == [path >= from_mm] * 1000


def test_the_faults_of_the_product_alone():
    good = {name: 0.0 for name in ("false", "false_steady", "false_settled", "over_5")}
    good |= {name: 1.0 for name in ("asked", "claimed", "over_sigma", "over_bound", "us")}
    good |= dict(answered=0.9, median=0.001, rms=0.001, covered=0.95, first_right_s=0.1, runs=1)
    fine, rival = (comparison.Row("const", *names, **good) for names in (("pipeline", PRODUCT), ("periodogram", RIVAL)))

    def faults(others=(fine, rival), **changes):
        return comparison.faults(dataclasses.replace(fine, **changes), others)

    assert faults() == () and comparison.faults(dataclasses.replace(rival, false=1.0), (fine, rival)) == ()
    worse = dict(
        answered=0.7, false=0.03, false_steady=0.03, false_settled=0.01, median=0.002, over_5=0.02, covered=0.8
    )
    for name, value in (worse | dict(covered=0.8)).items():
        assert len(faults(**{name: value})) == 1, name
    blind = dataclasses.replace(rival, over_5=0.3)
    assert faults([fine, blind], answered=0.1) == (), "no spectrum is right there"


# ---- The methods


def test_an_unknown_name_is_refused():
    assert chosen("estimator", ("ekf", "music"), METHODS) == ["MUSIC", "seeded EKF"]
    with pytest.raises(InputError, match="no estimator is called 'nobody', there are: pipeline; "):
        chosen("estimator", ("nobody",), METHODS)


@pytest.mark.parametrize("name", METHODS)
def test_every_method_answers_a_plain_grating(name):
    made = scene("const", 1.8, seed=2, seconds=0.6)
    answer = METHODS[name].run(made.time_s, made.readings, made.known_mm_s)
    assert answer.ok.shape == answer.sigma_mm.shape == answer.wavelength_mm.shape == (600,) and answer.ok.dtype == bool
    literal = 2.0 if "interval" in name else 1.0
    off = 0.15 if METHODS[name].kind == PUBLISHED else 0.005
    assert np.nanmedian(answer.wavelength_mm[-50:]) * literal == pytest.approx(1.8, rel=off)


@pytest.mark.parametrize("tapered, least, most", [(False, 0.65, 1.35), (True, 0.5, 0.8)])
def test_the_sigma_of_a_spectrum_is_that_of_its_errors(tapered, least, most):
    """In white noise, over 60 noises: about true without a taper, and larger than need be with one."""
    made, rng, errors, sigmas = scene("const, rounded", 1.2, snr_dB=300, seconds=0.5), np.random.default_rng(0), [], []
    for _ in range(60):
        noisy = made.signal[:, 0] + 0.3 * rng.standard_normal(500)
        wavelength, sigma, ok = methods.strongest(made.position_mm, noisy, tapered=tapered)
        assert ok
        errors.append(wavelength - 1.2)
        sigmas.append(sigma)
    assert least < np.std(errors) / np.mean(sigmas) < most


# ---- The comparison


@pytest.fixture(scope="module")
def small():
    calls = []
    rows = comparison.compare(SMALL, progress=calls.append)
    assert (calls[-1].done, calls[-1].total) == (4, 4)
    return rows


def test_a_row_for_each_scene_and_method(small):
    assert [(row.scene, row.method) for row in small] == [
        (name, method) for name in SMALL.scenes for method in ("pipeline", "STFT over the path")
    ]
    hum = small[3]
    assert all(row.runs == 2 and row.us > 0 for row in small) and hum.answered > 0.9 and hum.false == 1
    assert json.loads(json.dumps([dataclasses.asdict(row) for row in small]))[0]["kind"] == PRODUCT


def test_tables_show_shares_in_per_cent_and_what_was_missed(capsys):
    numbers = dict(zip(
        ("answered", "asked", "claimed", "false", "false_steady", "false_settled", "median", "over_5", "rms",
         "covered", "over_sigma", "over_bound", "first_right_s", "us"),
        (0.5, 0.25, 1.0, 0.125, 0.01, 0.02, 0.03, 0.04, 0.05, 0.95, 1.25, 1.5, 0.3, math.nan), strict=True,
    ))  # fmt: skip
    ours = comparison.Row("grating", "the product", PRODUCT, **numbers, runs=1, faults=("too late", "too wide"))
    other = dataclasses.replace(ours, method="a paper's", kind=PUBLISHED, median=math.nan, answered=1.0, faults=())
    touch = touches.TouchRow("creep", "gauges", 0.5, 0.1, 0.2, 0.9, 0.05, 1.5, 2.5, 8)
    price = cost.Cost("modulus", 1.0, 2.0, 2.5, 3.0, 4.0)
    for short in (False, True):
        answer = command.answer_of([ours, other], () if short else (touch,), [price], None, short, 61.0)
        answer.show()
        said = " ".join(re.sub(r"[│┃━─┏┓┗┛┡┩└┘┬┴┼╇┳┻╋]", " ", capsys.readouterr().out).split())
        assert "grating 25 50 12.5 1 2 95 1.25 3 4 5 1.5 0.3 missed" in said, "the nan of the last column is empty"
        assert "missed, the product, grating: too late; too wide Median error" in said, "of the product alone"
        assert "Answered, and false among these, % scene the product a paper's grating 50 12.5 100 12.5" in said
        assert ("creep gauges 50 5 90 1.5 10 20 2.5" in said) != short and "modulus 1 2 2.5 3 4" in said
        assert said.endswith("61 s" + command.SHORT_REMARK * short) and answer.facts["plots"] == []
        assert json.loads(json_text(answer.facts))["scenes"][0]["us"] is None


def test_the_figure_shows_shares_and_errors():
    def row(scene, method, answered, false, median, kind="own", faults=()):
        return dict(locals())

    rows = [
        row("slow", "pipeline", 0.8, 0.25, 0.002), row("fast", "pipeline", 0.5, math.nan, 9.0, faults=("late",)),
        row("slow", "STFT over the path", 1.0, 0.0, 1e-9), row("fast", "STFT over the path", 0.0, 0.0, math.nan),
        row("slow", "old", 0.9, 0.1, 0.3, kind="published"),
    ]  # fmt: skip
    figure = honesty_figure(rows)
    pipeline, stft, errors = figure.axes
    # In per cent: right answers first, false ones behind them; the first scene is at the top
    bars = [(bar.get_x(), bar.get_width(), bar.get_y() + bar.get_height() / 2) for bar in pipeline.patches]
    assert np.array(bars) == pytest.approx(np.array([(0, 60, 1), (0, 50, 0), (60, 20, 1), (50, 0, 0)]))
    assert [bar.get_width() for bar in stft.patches] == [100, 0, 0, 0]
    dots = {line.get_label(): line for line in errors.lines}["pipeline"]
    assert dots.get_xdata() == pytest.approx([0.2, 300.0]) and list(dots.get_ydata()) == [1, 0]
    texts = {text.get_text() for text in figure.findobj(Text)}
    assert {"The pipeline holds its targets in 1 of 2 scenes", "published", "slow", "fast"} <= texts
