"""The pipeline: right answers from whatever columns there are, and words for what is wrong or missing."""

import numpy as np
import pytest

from papilla.estimators import Doubts, Pipeline
from papilla.scenes.scenes import scene

PLACES = np.array([0.0, 3.0, 7.1])
"""Where three gauges are along the sliding direction, mm."""


def slid(wavelength=1.2, seconds=2.0, rate=1000.0, speed=80.0, seed=0, drift=1.0, jitter=0.0, amplitude=20.0):
    """Times, positions, velocities and readings (n, 3) of a slide at a nominal rate whose clock is off by a factor."""
    rng = np.random.default_rng(seed)
    count = round(seconds * rate)
    time = 100 + (np.arange(count) * drift + jitter * rng.uniform(-1, 1, count)) / rate
    position = speed * (time - 100) + 3 * np.sin(4 * (time - 100))
    velocity = speed + 12 * np.cos(4 * (time - 100))
    phase = 2 * np.pi * (position[:, None] - PLACES) / wavelength
    texture = np.sin(phase) + 0.4 * np.sin(2 * phase + 1)
    return time, position, velocity, amplitude * (texture + rng.normal(0, 0.1, phase.shape))


def tracked(rows, *columns, rate=1000.0, **options):
    return Pipeline(gauges=3, columns=columns, sample_rate_Hz=rate, **options).process(rows)


def settled(answer, wavelength, tolerance, last=300):
    """The wavelength is right over the last rows, and its sigma of a fitting size."""
    off = answer.wavelength_mm[-last:] / wavelength - 1
    assert np.sqrt(np.mean(off**2)) < tolerance
    assert (answer.wavelength_sigma_mm[-last:] > 0).all()


@pytest.mark.parametrize("drift, jitter", [(0.985, 0.0), (1.02, 0.3)])
def test_neither_drift_nor_jitter_of_the_clock_bends_the_wavelength(drift, jitter):
    time, position, velocity, readings = slid(drift=drift, jitter=jitter)
    by_velocity = tracked(np.column_stack([time, readings, velocity]), "velocity_mm_s")
    settled(by_velocity, 1.2, 1e-3)
    np.testing.assert_allclose(by_velocity.frequency_Hz[-300:], velocity[-300:] / 1.2, rtol=3e-3)
    by_position = tracked(np.column_stack([time, readings, position]), "position_mm")
    settled(by_position, 1.2, 1e-3)


def test_a_start_after_ten_hours_changes_nothing():
    time, position, _, readings = slid(seconds=1.2)
    early = tracked(np.column_stack([time, readings, position]), "position_mm")
    late = tracked(np.column_stack([time + 36_000, readings, position + 3.6e6]), "position_mm")
    np.testing.assert_allclose(late.wavelength_mm, early.wavelength_mm, rtol=1e-6)
    assert late.status == early.status


def stroked(column, jump_s=0.0, late_ms=0):
    """A pipeline's answers to strokes over 1.4 mm, the clock set by `jump_s` at row 1200; the rows that are ok."""
    made = scene("act1", 1.4, seed=4, seconds=2.4)
    time, path = made.time_s + jump_s * (np.arange(2400) >= 1200), getattr(made, column)
    behind = np.concatenate([np.full(late_ms, path[0]), path[: 2400 - late_ms]])
    pipeline = Pipeline(gauges=1, columns=(column,))
    answer = pipeline.process(np.column_stack([time, made.readings, behind]))
    return pipeline, answer, np.array([words.startswith("ok") for words in answer.wavelength_status])


@pytest.mark.parametrize("column", ["velocity_mm_s", "position_mm"])
@pytest.mark.parametrize(
    "jump_s, left_out, told",
    [
        (0.07, 0, "time: samples are missing before this one"), (0.6, 0, "time: samples are missing before this one"),
        (4.0, 0, "time: begun anew"), (-0.2, 200, "left out: the sample is not later"), (-4.0, 0, "time: begun anew"),
    ],
)  # fmt: skip
def test_a_clock_that_is_set_is_told_and_nothing_wrong_is_ok(column, jump_s, left_out, told):
    pipeline, answer, usable = stroked(column, jump_s)
    assert usable[800:1200].mean() > 0.9 and answer.status[1200].startswith(told)
    off = np.abs(answer.wavelength_mm / 1.4 - 1)
    assert off[usable].max() < 0.05
    # Until the clock is where it was.
    assert all(words.startswith("left out") for words in answer.status[1200 : 1200 + left_out])
    assert answer.wavelength_status[1200 : 1200 + left_out] == ["repeated"] * left_out
    assert sum(pipeline.faults.values()) == max(left_out, 1)
    assert {*answer.wavelength_status} == {*pipeline.legend["wavelength"]}
    assert usable[1500:].mean() > 0.4


@pytest.mark.parametrize("column, late_ms", [("velocity_mm_s", 10), ("position_mm", 20), ("position_mm", 4)])
def test_a_late_encoder_is_found_and_told(column, late_ms):
    pipeline, answer, usable = stroked(column, late_ms=late_ms)
    assert usable[800:].mean() > 0.8 and np.abs(answer.wavelength_mm[usable] / 1.4 - 1).max() < 0.02
    (told,) = [line for line in pipeline.notes if "ms behind the readings" in line]
    assert float(told.split(" ms behind")[0].split()[-1]) == pytest.approx(late_ms, abs=1.0)
    assert not [line for line in stroked(column)[0].notes if "behind the readings" in line]


def test_bad_gauges_are_named_and_the_others_answer():
    time, _, velocity, readings = slid()
    readings[500:, 0] = readings[500, 0]
    readings[900:1000, 1] = np.nan
    readings[1500:, 2] = 5e4
    answer = tracked(np.column_stack([time, readings, velocity]), "velocity_mm_s", saturation=4e4)
    assert answer.status[700].startswith("g1 stuck")
    assert answer.status[950].startswith("g2 missing; g1 stuck")
    assert answer.status[1600].startswith("g3 saturated; g1 stuck")
    settled(answer, 1.2, 1e-2)


def test_friction_from_the_positions(calibration):
    count = 3000
    time = np.arange(count) / 1000
    position = 40 * np.sin(3 * time)
    force = 0.5 + 0.2 * np.sin(2 * time)
    tangential = 0.6 * force * np.sign(np.cos(3 * time)) + 0.05
    rows = np.column_stack([time, np.zeros(count), force, np.round(position, 3), tangential])
    answer = Pipeline(gauges=1, columns=("force_N", "position_mm", "tangential_N")).process(rows)
    assert answer.mu_kinetic[-1] == pytest.approx(0.6, rel=0.02)


def test_softness_uses_every_gauge_or_s_d(calibration, touch):
    rng = np.random.default_rng(4)
    force = np.full(800, 0.4)
    force[600:] = 0.0
    rows = touch(0.3, force[:600], 2.0, 1e-3, rng)
    rows = np.vstack([rows, np.column_stack([rng.normal(0, 2, (200, 5)), rng.normal(0, 1e-3, 200)])])
    sure, stream = {"columns": ("force_N",), "gauge_sigma": 2.0}, np.column_stack([np.arange(800) / 1000, rows])
    answer = Pipeline(calibration, doubts=Doubts.NONE, **sure).process(stream)
    assert abs(answer.modulus_MPa[599] / 0.3 - 1) < 4 * answer.modulus_sigma_MPa[599] / 0.3 < 0.1
    doubting = Pipeline(calibration, **sure)
    assert doubting.process(stream).modulus_sigma_MPa[599] > 10 * answer.modulus_sigma_MPa[599]
    assert any(told.startswith("modulus: most of its standard deviation is the") for told in doubting.notes)
    assert "modulus: no contact" in answer.status[-1]
    assert np.isnan(answer.modulus_MPa[-1])


def test_without_a_velocity_the_gauge_that_changes_most_is_followed():
    """Another one once it changes four times more, in power; a slow log has no frequency, and says so."""
    time, rng = np.arange(3000) / 1000, np.random.default_rng(0)
    sizes = np.array([1.0, 6.0, 0.5]) * np.where(time[:, None] < 1.5, 1.0, [1.0, 1.0, 40.0])
    readings = (
        sizes * np.sin(2 * np.pi * time[:, None] * [40.0, 60.0, 90.0]) + [0, 50, 0] + rng.normal(0, 0.05, (3000, 3))
    )
    pipeline = Pipeline(gauges=3, columns=())
    found = pipeline.process(np.column_stack([time, readings])).frequency_Hz
    assert found[1000:1500] == pytest.approx(60.0, rel=0.02) and found[2500:] == pytest.approx(90.0, rel=0.02)
    # One that is lost counts less and less, until another one is followed.
    lost = np.sin(2 * np.pi * time[:, None] * [40.0, 60.0]) * [1.0, 6.0] + rng.normal(0, 0.05, (3000, 2))
    lost[1000:, 1] = np.nan
    found = Pipeline(gauges=2, columns=()).process(np.column_stack([time, lost])).frequency_Hz
    assert found[500:900] == pytest.approx(60.0, rel=0.02) and found[2500:] == pytest.approx(40.0, rel=0.02)
    slow = Pipeline(gauges=1, columns=(), sample_rate_Hz=20.0)
    assert "20 Hz is too slow without a velocity" in slow.off["frequency"]
    assert slow.update((0.0, 1.0)).status.startswith("nothing to estimate; no modulus")


@pytest.mark.parametrize("rate", [1000.0, 400.0, 399.0, 200.0, 199.0])
def test_messages_name_what_the_rate_and_the_options_leave_open(rate):
    columns = ("force_N", "velocity_mm_s", "tangential_N")
    plain = {"gauges": 1, "columns": columns, "sample_rate_Hz": rate}
    text = "\n".join(Pipeline(None, **plain).notes)
    assert ("friction: no static coefficient" in text) == (rate < 400) and ("may look longer" in text) == (rate < 200)
    assert "ridge_pitch_mm" in text and "1.5% for the scale" in text
    text = "\n".join(Pipeline(None, **plain, ridge_pitch_mm=0.0, scale_sigma=0.0).notes)
    assert "ridge_pitch_mm" not in text and "scale of the path" not in text


def test_an_ambiguous_wavelength_names_both():
    """A faint lone line in step with the finger's ridges may be their harmonic."""
    time, rng = np.arange(1500) / 1000, np.random.default_rng(4)
    reading = np.cos(2 * np.pi * 126 * time / 1.2) + rng.normal(0, 1.2, 1500)
    pipeline = Pipeline(gauges=1, columns=("velocity_mm_s",), ridge_pitch_mm=1.2)
    answer = pipeline.process(np.column_stack([time, reading, np.full(1500, 126.0)]))
    assert not any(code.startswith("ok") for code in answer.wavelength_status)
    both = [text for text in answer.status if "(1.2 or 2.4 mm)" in text or "(1.201 or 2.4" in text]
    assert both, set(answer.status)
