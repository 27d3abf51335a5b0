"""One look at a window: every number of its finding against the truth of the window, and its status."""

import numpy as np
import pytest

from papilla.estimators.stream import completed
from papilla.estimators.wavelength.line_search import LineSearch
from papilla.estimators.wavelength.memory import Options, Task, TrackingStatus, window_of
from papilla.scenes.parts import sheared

COUNT, RATE, TRUE_MM, NOISE, APART_MM = 900, 1000.0, 1.8, 0.2, 0.3
PLACES = {
    "constant": lambda t: 96 * t,
    "slow": lambda t: 10 * t,
    "bent": lambda t: 96 * t + 8 * np.sin(7 * t),
    "strokes": lambda t: 25 * (1 - np.cos(2 * np.pi * 1.1 * t)),
    "quick strokes": lambda t: 12 * (1 - np.cos(2 * np.pi * 2.2 * t)),
}
HUMS_HZ = tuple(sorted({n * mains for mains in (50.0, 60.0) for n in range(1, 9)}))


def window(motion, seed, *, wavelength=TRUE_MM, late_s=0.0, hum=0.0, gauges=1, harmonics=(1.0, 0.4)):
    """Rows of time, place as it is told, samples and readings; and the rows at which strokes begin."""
    time = np.arange(COUNT) / RATE
    true, told = PLACES[motion](time), PLACES[motion](time - late_s)
    readings = NOISE * np.random.default_rng(seed).standard_normal((COUNT, gauges))
    readings += hum * np.sin(2 * np.pi * 50 * time)[:, None]
    for order, size in enumerate(harmonics, 1):
        turns = order * (true[:, None] - APART_MM * np.arange(gauges)) / wavelength
        readings += size * np.cos(2 * np.pi * turns + order)
    breaks = np.flatnonzero(np.diff(np.sign(np.diff(told)))) + 1 if "strokes" in motion else ()
    return np.column_stack([time, told - told[0], np.ones(COUNT), readings]), tuple(map(int, breaks))


def task_of(rows, breaks, *, low=0.4, high=6.0, late_variance=0.0, before=0.0, proved=0.0, hums_Hz=()):
    options = Options(low, high, RATE, 0.0, None, HUMS_HZ, 0.0)
    return Task(
        rows=rows, breaks=breaks, options=options, step=low / 4, size=2048, late_s=0.0, late_variance=late_variance,
        before=before, proved=proved, known_hums_Hz=hums_Hz,
    )  # fmt: skip


def looked(rows, breaks, **known):
    return completed(LineSearch(task_of(rows, breaks, **known)).run())


@pytest.mark.parametrize(
    "motion, options, status",
    [
        ("constant", {}, TrackingStatus.CONSTANT_SPEED), ("bent", {}, TrackingStatus.OK),
        ("bent", {"hum": 3.0}, TrackingStatus.OK), ("strokes", {"hum": 3.0}, TrackingStatus.OK),
        ("strokes", {"late_s": 0.006}, TrackingStatus.OK),
        ("bent", {"late_s": 0.003, "gauges": 2}, TrackingStatus.OK),
    ],
)  # fmt: skip
def test_a_finding_is_the_truth_within_its_sigma(motion, options, status):
    late, hum, off, ratios, levels = options.get("late_s", 0.0), options.get("hum", 0.0), [], [], []
    for seed in range(8):
        rows, breaks = window(motion, seed, **options)
        found = looked(rows, breaks, late_variance=1e-4 if late else 0.0)
        assert found.status == status
        off.append(found.wavenumber * TRUE_MM - 1)
        ratios.append((found.wavenumber - 1 / TRUE_MM) / found.sigma)
        levels.append(found.noise)
        assert np.abs(found.amplitude) == pytest.approx(1.0, abs=0.1) and abs(found.kept - 1) < 4 * found.kept_sigma
        assert 0 < found.kept_sigma < 0.15 and found.late_s == pytest.approx(late, abs=5e-4)
        places = [wavelength for wavelength, *_ in found.lines]
        assert min(abs(one / TRUE_MM - 1) for one in places) < 0.01
    assert np.abs(off).max() < 1e-3
    # Hum is taken out as well as it is known.
    if not hum:
        assert 0.25 < np.sqrt(np.mean(np.square(ratios))) < 2.0
        assert np.mean(levels, axis=0) == pytest.approx(NOISE**2, rel=0.5)
        last = COUNT - (breaks[-1] if breaks else 0)
        exact = np.sqrt(2 * np.array(found.noise) / (np.abs(found.amplitude) ** 2 * last)) / (2 * np.pi)
        assert found.phase_sigma == pytest.approx(exact.tolist(), rel=0.02)
    else:
        assert found.hums_Hz == () or min(abs(one - 50) for one in found.hums_Hz) < 1.0
    assert found.extent == pytest.approx(np.ptp(rows[:, 1]), rel=0.02)
    if len(found.phase) > 1:
        apart = (found.phase[0] - found.phase[1]) % 1
        assert apart == pytest.approx(APART_MM / TRUE_MM, abs=0.01)


def test_noise_alone_is_nothing():
    statuses = [looked(*window("bent", seed, harmonics=())).status for seed in range(25)]
    assert statuses == [TrackingStatus.SEARCHING] * 25


@pytest.mark.parametrize(
    "motion, options, task, status",
    [
        ("constant", {"wavelength": 1.92}, {}, TrackingStatus.TIME_LOCKED),
        ("constant", {"wavelength": 1.92 / 2.4}, {}, TrackingStatus.TIME_LOCKED),
        ("bent", {}, {"high": 1.2}, TrackingStatus.OUT_OF_RANGE),
    ],
)
def test_what_is_not_the_surface_s_or_not_asked_for_is_refused(motion, options, task, status):
    for seed in range(4):
        assert looked(*window(motion, seed, **options), **task).status == status


def test_the_play_of_the_skin_after_a_turn_is_no_error_of_the_wavelength():
    """The skin trails by 0.3 mm, turning over within 0.5 mm of the way back."""
    ratios = []
    for seed in range(8):
        rows, breaks = window("quick strokes", seed, harmonics=())
        skin = sheared(rows[:, 1], 0.3, 0.5)
        rows[:, 3] += np.cos(2 * np.pi * skin / TRUE_MM)
        found = looked(rows, breaks, late_variance=1e-4)
        ratios.append((found.wavenumber - 1 / TRUE_MM) / found.sigma)
        assert found.status == TrackingStatus.OK and abs(found.late_s) < 3e-4
    assert np.sqrt(np.mean(np.square(ratios))) < 2.0


@pytest.mark.parametrize("motion", ["bent", "strokes"])
@pytest.mark.parametrize("options", [{"harmonics": (), "hum": 3.0}, {"wavelength": 7.0}])
def test_hum_and_what_is_too_long_are_never_found(motion, options):
    for seed in range(4):
        found = looked(*window(motion, seed, **options))
        assert found.status not in (TrackingStatus.OK, TrackingStatus.CONSTANT_SPEED)
        assert "hum" not in options or found.hums_Hz == pytest.approx((50.0,), abs=0.5)


def test_the_newest_periods_tell_that_the_line_is_gone():
    rows, breaks = window("bent", 0)
    gone = rows[:, 1] > rows[-1, 1] - 3 * TRUE_MM
    rows[gone, 3] = NOISE * np.random.default_rng(5).standard_normal(gone.sum())
    found = looked(rows, breaks)
    assert found.kept + 3 * found.kept_sigma < 0.5 and found.status == TrackingStatus.OK
    rows, breaks = window("bent", 0)
    rows[:, 3] *= np.where(rows[:, 1] > rows[-1, 1] - 17 * TRUE_MM, 0.6, 1.0)
    found = looked(rows, breaks)
    assert found.kept == pytest.approx(0.6 / np.abs(found.amplitude[0]), abs=4 * found.kept_sigma)


def test_a_path_that_is_late_by_as_much_makes_the_line_sharper():
    task = task_of(*window("strokes", 0, late_s=0.008))
    sharp = {late: completed(task.sharpness(late)) for late in (-0.004, 0.0, 0.008, 0.02)}
    assert max(sharp, key=sharp.get) == 0.008 and sharp[0.008] > 1.3 * sharp[0.0]
    assert sharp[0.0] == pytest.approx(looked(*window("strokes", 0, late_s=0.008)).score, rel=0.01)


def test_a_window_has_the_strokes_that_are_long_enough():
    """Of a path to and fro: at least 0.6 of the longest, and more than eight rows."""
    ends = np.cumsum([0, 120, 80, 80, 65])
    place = np.interp(np.arange(345), ends, [0.0, 12.0, 4.0, 12.0, 5.5])
    rows = np.column_stack([np.arange(345) / RATE, place, np.ones(345), np.arange(345.0)])
    task = task_of(rows, tuple(ends[1:-1].tolist()))
    _, at, _, stroke, begin, readings = window_of(task, 0.0)
    assert begin.tolist() == [0, 120, 200, 280] and np.unique(stroke).tolist() == [0, 1, 2]
    np.testing.assert_array_equal(readings[:, 0], np.arange(280.0))
    np.testing.assert_array_equal(at, place[:280])
    for low, none in ((3.1, True), (2.9, False)):
        assert (window_of(task_of(rows, task.breaks, low=low), 0.0) is None) == none
    # A path that is late by 10 ms is that of the rows 10 ms on, its turns as much earlier.
    late = (0.01, 110, (0.0, 0.0), place[10:110]), (-0.01, 120, (0.01, 10.0), place[:100])
    for late_s, turn, begun, expected in late:
        time, at, _, stroke, begin, readings = window_of(task, late_s)
        assert begin[1] == turn and (time[0], readings[0, 0]) == pytest.approx(begun)
        assert len(stroke) == begin[-1]
        np.testing.assert_allclose(at[:100], expected, atol=1e-9)
