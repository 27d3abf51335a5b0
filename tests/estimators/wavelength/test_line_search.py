"""One look at a window: every number of its finding against the truth of the window, and its status."""

import numpy as np
import pytest

from papilla.estimators.stream import completed
from papilla.estimators.wavelength.fundamental import hints
from papilla.estimators.wavelength.line_search import LineSearch
from papilla.estimators.wavelength.memory import Options, Task, TrackingStatus, window_of
from papilla.estimators.wavelength.spectrum import Line
from papilla.estimators.wavelength.time_lines import credits_of, forward
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


def task_of(rows, breaks, *, low=0.4, high=6.0, late_variance=0.0, before=0.0, proved=0.0):
    options = Options(low, high, RATE, 0.0, None, HUMS_HZ, 0.0)
    return Task(
        rows=rows, breaks=breaks, options=options, step=low / 4, size=2048, late_s=0.0, late_variance=late_variance,
        before=before, proved=proved, known_hums_Hz=(),
    )  # fmt: skip


def looked(rows, breaks, **known):
    return completed(LineSearch(task_of(rows, breaks, **known)).run())


@pytest.mark.parametrize(
    "motion, options, status",
    [
        ("constant", {}, TrackingStatus.CONSTANT_SPEED),
        ("bent", {}, TrackingStatus.OK),
        ("bent", {"hum": 3.0}, TrackingStatus.OK),
        ("strokes", {"hum": 3.0}, TrackingStatus.OK),
        ("strokes", {"late_s": 0.006}, TrackingStatus.OK),
        ("bent", {"late_s": 0.003, "gauges": 2}, TrackingStatus.OK),
    ],
)
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


def test_a_wave_whose_phase_wanders_is_incoherent():
    rows, breaks = window("bent", 0, harmonics=())
    wander = 0.8 * np.cumsum(np.random.default_rng(1).standard_normal(COUNT)) / 10
    rows[:, 3] += np.cos(2 * np.pi * (rows[:, 1] / TRUE_MM + wander))
    assert looked(rows, breaks).status in (TrackingStatus.INCOHERENT, TrackingStatus.SEARCHING)
    rows[:, 3] -= np.cos(2 * np.pi * (rows[:, 1] / TRUE_MM + wander))
    rows[:, 3] += np.cos(2 * np.pi * (rows[:, 1] / TRUE_MM + 0.02 * wander))
    assert looked(rows, breaks).status == TrackingStatus.OK


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


def test_what_was_known_is_gone_on_from_and_helps_a_faint_line():
    seen = {proved: 0 for proved in (0.0, 1 / TRUE_MM)}
    for seed in range(12):
        for proved in seen:
            found = looked(*window("bent", seed, harmonics=(0.08,)), proved=proved)
            seen[proved] += found.status == TrackingStatus.OK and abs(found.wavenumber * TRUE_MM - 1) < 0.02
    assert seen[1 / TRUE_MM] >= seen[0.0] > 3
    rows, breaks = window("bent", 0)
    plain, known = (looked(rows, breaks, before=before) for before in (0.0, 1 / TRUE_MM + 1e-4))
    assert known.wavenumber == pytest.approx(plain.wavenumber, abs=0.3 * plain.sigma)


def parted(rows, breaks, **known):
    """A look up to where it has its lines over the path and over time."""
    look = LineSearch(task_of(rows, breaks, **known))
    assert completed(look._gathered(0.0))
    completed(look._detected())
    completed(look._over_time())
    return look


def line(wavenumber, amplitude=1.0, ratio=1000.0):
    return Line(wavenumber, ratio, amplitude, 1e-9)


def test_how_far_a_path_bends_and_how_fast_it_is():
    """x = v t + a t^2 / 2 leaves the straight line through it by a (t^2 - T^2 / 12) / 2 about the middle: its root mean
    square under the taper. Ramps at the ends, as of a quick turn, are hardly heard."""
    rows, breaks = window("constant", 0)
    bent, ramped, span = rows.copy(), rows.copy(), rows[-1, 0]
    bent[:, 1] = 60 * rows[:, 0] + 4 * rows[:, 0] ** 2
    ramped[:, 1] = np.cumsum(np.clip(np.sin(np.pi * rows[:, 0] / span) / 0.1, 0, 1))
    straight, curved, turned = (parted(own, breaks) for own in (rows, bent, ramped))
    u = np.linspace(-0.5, 0.5, 2001)
    square, fourth = (np.average(u**power, weights=np.cos(np.pi * u) ** 2) for power in (2, 4))
    assert straight._bend < 1e-9
    assert curved._bend == pytest.approx(4 * span**2 * (fourth - square**2) ** 0.5, rel=0.02)
    assert turned._bend < 0.002 * np.ptp(ramped[:, 1])
    assert curved._speed[5:-5] == pytest.approx(60 + 8 * rows[5:-5, 0], rel=1e-6)
    assert straight._spans == pytest.approx([span]) and straight._speed == pytest.approx(96.0)
    rows, breaks = window("strokes", 0)
    assert parted(rows, breaks)._spans == pytest.approx(np.diff([0, *breaks, COUNT])[:2] / RATE, abs=0.003)


@pytest.mark.parametrize("off, near", [(0.0, True), (0.9, True), (-0.9, True), (1.1, False), (-1.1, False)])
def test_a_line_may_be_the_mains_within_a_resolution_of_their_harmonics(off, near):
    """At a constant speed, which is all that the path's wavenumber tells of a frequency."""
    look = parted(*window("constant", 0))
    resolution = 1 / look._spans[0]
    for hum in (50.0, 120.0):
        assert look._near_hum(line((hum + off * resolution) / 96)) == near
    assert not look._near_hum(line(120.0 / 96), 100.0) and look._near_hum(line(100.0 / 96), 100.0)
    # A line over time is that of the mains from which it is not told apart.
    half = 0.5 / look._spans[0]
    assert look._exact(50 + 0.95 * half) == 50.0 and look._exact(50 + 1.05 * half) == 50 + 1.05 * half
    assert look._exact(59.6) == 60.0 and look._exact(9.0) == 9.0


def test_the_known_line_comes_first_while_no_other_is_much_stronger():
    look = parted(*window("constant", 0))
    resolution = 1 / look._strokes.extent
    for place, amplitude, first in ((0.9, 0.86, True), (1.1, 0.86, False), (0.0, 0.84, False), (-0.9, 0.86, True)):
        look._inside = [line(1.3), line(0.5 + place * resolution, amplitude), line(0.9, 0.4)]
        look._task = look._task._replace(before=0.5)
        ranked = look._ranked()
        assert [one.wavenumber for one in sorted(ranked)] == sorted(one.wavenumber for one in look._inside)
        assert (ranked[0] == look._inside[1]) == first and ranked[-1] == look._inside[2]


def test_a_harmonic_of_a_louder_hum_may_hide_behind_it():
    look = parted(*window("constant", 0))
    resolution = 1 / look._strokes.extent
    for order, off, loud, hidden in (
        (2, 0.0, 2.0, True), (5, 2.9, 2.0, True), (5, -3.1, 2.0, False), (3, 3.1, 2.0, False), (2, 0.0, 0.9, False),
        (1, 0.0, 2.0, False), (6, 0.0, 2.0, False),
    ):  # fmt: skip
        hum = line(0.52 + off * resolution, loud)
        assert look._hidden(line(order * 0.52), [line(3.3, 9.0), hum]) == hidden


def test_more_than_noise_at_the_place_of_a_fundamental_or_of_another_harmonic_is_a_hint():
    """Unless it is faint beside the line, is a line by itself, or lies where drift is."""
    look = parted(*window("constant", 0))
    resolution = 1 / look._strokes.extent
    spectrum, near = look._spectrum, 2 * resolution
    noise = np.random.default_rng(0).exponential(size=len(spectrum.power))
    chosen = line(1.4, 30.0)

    def hinted(order, power, chosen=chosen, lines=(), lowest=0.1):
        flat, at = noise.copy(), round(order * 0.7 / spectrum.step)
        for place in (0.7, 2.1, 3.5):
            flat[round(place / spectrum.step) - 12 : round(place / spectrum.step) + 13] = 0.5
        flat[at] = power
        return hints(spectrum._replace(power=flat), [chosen, *lines], chosen, 2, near, lowest)

    assert hinted(1, 60.0) and not hinted(1, 1.0) and hinted(3, 60.0)
    assert hinted(1, 60.0, lowest=0.8) and not hinted(3, 60.0, lowest=0.8), "0.7 per mm is not in the range"
    assert not hinted(1, 60.0, chosen._replace(amplitude=200.0))
    assert not hinted(3, 60.0, chosen._replace(amplitude=60.0)), "another harmonic must be louder than a fundamental"
    for off, told in ((1.9, False), (-1.9, False), (2.1, True)):
        assert hinted(1, 60.0, lines=[line(0.7 + off * resolution)]) == told
    assert not hints(spectrum, [], line(3.8 * resolution, 1e9), 2, near, 0.1)


def test_the_noise_of_a_sample_is_known_at_each_harmonic_that_the_rate_shows():
    """160 Hz at 1 kHz: the third harmonic is above what anti-aliasing leaves."""
    look = parted(*window("constant", 0, gauges=2))
    level = look._noise(1 / 0.6)
    assert level.shape == (5, 2) and np.isinf(level[2:]).all()
    assert level[:2] == pytest.approx(NOISE**2, rel=0.7)
    assert np.isfinite(look._noise(1 / 1.1)).all(axis=1).tolist() == [True] * 5
    assert np.isfinite(look._noise(1 / 0.2)).all(axis=1).tolist() == [True, False, False, False, False]
    # And that the grid shows: twice the shortest wavelength's.
    slow = parted(*window("slow", 0))
    assert np.isfinite(slow._noise(2.4)).all(axis=1).tolist() == [True] * 4 + [False]


def test_the_skin_trails_after_a_turn_and_not_where_the_window_begins():
    """By exp(-s / 0.5 mm) of what it does at the turn, s mm after it, against the way; in cycles."""
    rows, breaks = window("quick strokes", 0)
    look = parted(rows, breaks)
    look._wavenumber = 0.5
    play, begin = look._play(), look._begin
    assert not play[: begin[1]].any()
    for number in range(1, len(begin) - 1):
        own = slice(begin[number], begin[number + 1])
        place = look._place[own]
        way = np.sign(place[-1] - place[0])
        np.testing.assert_allclose(play[own], 0.5 * way * np.exp(-np.abs(place - place[0]) / 0.5), rtol=1e-9)


@pytest.mark.parametrize("step", [0.05, 0.2, 0.5])
def test_steps_show_wavenumbers_up_to_nearly_half_of_theirs(step):
    """Of the longest tenth; and the grid is that of the path where that is coarser."""
    task, place = task_of(*window("constant", 0)), np.arange(200) * step
    assert task.highest(place) == pytest.approx(min(0.45 / step, 1 / 0.4))
    assert task.grid(place) == pytest.approx(max(step, 0.1))
    uneven = np.cumsum(np.where(np.arange(200) % 4, step, 2 * step))
    assert task.highest(uneven) == pytest.approx(min(0.225 / step, 2.5))
    assert task.grid(-uneven) == pytest.approx(task.grid(place))


def test_another_texture_is_taken_out_before_the_phases_are_read():
    rows, breaks = window("bent", 0)
    rows[:, 3] += 0.7 * np.cos(2 * np.pi * rows[:, 1] * 0.777)
    look = parted(rows, breaks)
    look._wavenumber, look._hum = 1 / TRUE_MM, False
    plain, strokes = look._strokes, completed(look._unmixed())

    def size(readings, wavenumber):
        wave = np.exp(-2j * np.pi * wavenumber * plain.place)
        return 2 * abs((plain.weight * readings[:, 0]) @ wave) / plain.weight.sum()

    assert size(plain.readings, 0.777) == pytest.approx(0.7, rel=0.1) and size(strokes.readings, 0.777) < 0.05
    for order, amplitude in ((1, 1.0), (2, 0.4)):
        assert size(strokes.readings, order / TRUE_MM) == pytest.approx(amplitude, rel=0.1)


def test_a_window_has_the_strokes_that_are_long_enough():
    """Of a path to and fro: at least 0.6 of the longest, and more than eight rows."""
    time = np.arange(400) / RATE
    turns = [0.0, 12.0, 4.0, 12.0, 5.5]
    ends = np.cumsum([0, 120, 80, 80, 65])
    place = np.interp(np.arange(400), ends, turns)
    rows = np.column_stack([time, place, np.ones(400), np.arange(400.0)])[:345]
    task = task_of(rows, tuple(ends[1:-1].tolist()))
    own, at, count, stroke, begin, readings = window_of(task, 0.0)
    assert begin.tolist() == [0, 120, 200, 280] and np.unique(stroke).tolist() == [0, 1, 2]
    np.testing.assert_array_equal(readings[:, 0], np.arange(280.0))
    np.testing.assert_array_equal(at, place[:280])
    assert (
        window_of(task._replace(options=task.options._replace(low=3.1)), 0.0) is None
        and window_of(task._replace(options=task.options._replace(low=2.9)), 0.0) is not None
    )
    # A path that is late by 10 ms is that of the rows 10 ms on, its turns as much earlier.
    own, at, count, stroke, begin, readings = window_of(task, 0.01)
    assert begin[1] == 110 and own[0] == 0.0 and len(stroke) == begin[-1]
    np.testing.assert_allclose(at[:100], place[10:110], atol=1e-9)
    own, at, *_, readings = window_of(task, -0.01)
    assert own[0] == pytest.approx(0.01) and readings[0, 0] == 10.0
    np.testing.assert_allclose(at[:100], place[:100], atol=1e-9)


def test_a_place_that_grows_as_time_does_tells_waves_on_the_way_back():
    rows, breaks = window("strokes", 0)
    look = parted(rows, breaks)
    grown = forward(look._strokes)
    for first, last in zip(look._begin[:-1], look._begin[1:], strict=True):
        assert grown[last - 1] > grown[first]
        np.testing.assert_allclose(np.abs(grown[first:last]), np.abs(look._place[first:last]))


@pytest.mark.parametrize("motion", ["bent", "strokes"])
def test_what_only_a_line_explains_is_its_energy(motion):
    """Over the background: all of it where nothing over time is like it, and next to none for time."""
    look = parted(*window(motion, 0, harmonics=(1.0,)))
    best = look._inside[0]
    path, time = completed(credits_of(best, look._spectrum, look._strokes, look._time, [line(233.0), line(51.0)]))
    assert path == pytest.approx(best.ratio, rel=0.3) and time < 0.05 * path
    assert completed(look._origin(best)) == TrackingStatus.OK
    hum = parted(*window(motion, 0, harmonics=(), hum=2.0), proved=0.0)
    if hum._inside:
        path, time = completed(credits_of(hum._inside[0], hum._spectrum, hum._strokes, hum._time, [line(50.0)]))
        assert time > 4 * path


def test_where_the_speed_is_constant_time_and_path_are_not_told_apart():
    look = parted(*window("constant", 0))
    assert completed(look._origin(look._inside[0])) == TrackingStatus.CONSTANT_SPEED
    look = parted(*window("constant", 0, wavelength=1.92))
    assert completed(look._origin(look._inside[0])) == TrackingStatus.TIME_LOCKED


def test_a_finding_names_eight_lines_at_most_strongest_first():
    rows, breaks = window("bent", 0, harmonics=())
    for number in range(11):
        rows[:, 3] += (1 - 0.05 * number) * np.cos(2 * np.pi * rows[:, 1] * (0.31 + 0.173 * number) + number)
    found = parted(rows, breaks)
    amplitudes = [one.amplitude for one in found._lines]
    assert len(found._lines) == 8 and amplitudes == sorted(amplitudes, reverse=True)
    assert found.finding.score == pytest.approx(max(one.ratio for one in found._lines))
    assert [one[0] for one in found.finding.lines] == [1 / one.wavenumber for one in found._inside]


@pytest.mark.parametrize("motion", ["bent", "strokes", "constant"])
def test_a_hum_that_is_known_is_taken_out_before_lines_are_looked_for(motion):
    """And so does not sharpen the path, as it is as sharp at any lateness."""
    rows, breaks = window(motion, 0, hum=3.0)
    task = task_of(rows, breaks)._replace(known_hums_Hz=(50.0,), before=1 / TRUE_MM)
    found, blind = completed(LineSearch(task).run()), completed(LineSearch(task._replace(known_hums_Hz=())).run())
    assert found.status in (TrackingStatus.OK, TrackingStatus.CONSTANT_SPEED) and found.score == blind.score == 0.0
    assert found.wavenumber * TRUE_MM == pytest.approx(1.0, abs=1e-3) and found.hums_Hz == ()
    assert np.abs(found.amplitude) == pytest.approx(1.0, abs=0.1)
    assert found.noise[0] < 3 * NOISE**2 and not found.mixed


def test_with_two_textures_the_louder_is_told_and_the_other_is_among_the_lines():
    for size, told in ((0.6, 1 / TRUE_MM), (1.6, 0.777)):
        rows, breaks = window("bent", 0, harmonics=(1.0,))
        rows[:, 3] += size * np.cos(2 * np.pi * rows[:, 1] * 0.777)
        found = looked(rows, breaks)
        assert found.wavenumber == pytest.approx(told, rel=2e-3)
        places = [1 / wavelength for wavelength, *_ in found.lines]
        assert min(abs(place - 0.777) for place in places) < 0.01 > min(abs(place - 1 / TRUE_MM) for place in places)


def test_a_line_above_the_highest_of_the_range_or_below_the_lowest_is_no_answer():
    rows, breaks = window("bent", 0, harmonics=(1.0,))
    for low, high, told in ((0.4, 1.77, False), (0.4, 1.9, True), (1.7, 6.0, True), (1.85, 6.0, False)):
        found = looked(rows, breaks, low=low, high=high)
        assert (found.status == TrackingStatus.OK) == told
        assert told or found.status in (TrackingStatus.SEARCHING, TrackingStatus.OUT_OF_RANGE)


def test_too_little_path_is_nothing_and_says_so():
    rows, breaks = window("bent", 0)
    for count, nothing in ((11, True), (200, False)):
        found = looked(rows[:count], ())
        assert (found.status == TrackingStatus.SEARCHING and found.extent == 0.0) == nothing
    assert completed(task_of(rows[:11], ()).sharpness(0.0)) == 0.0
