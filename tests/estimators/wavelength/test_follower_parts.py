"""The follower by itself: on each side of every limit, what it says, what it keeps, and what it begins anew."""

import copy
import math
from dataclasses import replace

import numpy as np
import pytest

from papilla.core.errors import InputError
from papilla.estimators.stream import Spread
from papilla.estimators.wavelength import TrackingStatus as Status
from papilla.estimators.wavelength.follower import Follower, Search
from papilla.estimators.wavelength.memory import Finding, Options, Task, checked

RATE, LOW, HIGH = 1000.0, 0.5, 4.0
TRUE = 1 / 1.7


def made(scale_sigma=0.0, latency_s=0.0, rate=RATE, gauges=1, high=HIGH, **known):
    """A follower that remembers this."""
    own = Follower(gauges, checked((LOW, high), rate, scale_sigma, latency_s, ()))
    own.remember(own.fresh())
    return knowing(own, **known)


def knowing(own, **known):
    """It, whatever it found on its way, remembering its path and this."""
    own.remember(replace(own.fresh(), cells=own.memory.cells, place=own.memory.place))
    for name, value in known.items():
        setattr(own.memory, name, value)
    return own


def walked(own, path, step=0.02, readings=(1.0,), begin=0.0, time=0.0):
    """After this path in mm at an even speed: the status of each sample."""
    steps = np.arange(1, round(abs(path) / step) + 1)
    way = math.copysign(step, path)
    return [own.advance(time + number / RATE, begin + way * number, readings) for number in steps.tolist()]


SURE = {"finding": Finding(Status.OK), "known": (TRUE, 1e-3 * TRUE), "agreed": 2}


@pytest.mark.parametrize(
    "known, status",
    [
        ({}, Status.OK),
        ({"finding": Finding(Status.CONSTANT_SPEED)}, Status.CONSTANT_SPEED),
        ({"agreed": 1}, Status.SEARCHING),
        ({"hums_Hz": (50.0,)}, Status.SEARCHING),
        ({"hums_Hz": (50.0,), "agreed": 3}, Status.OK),
        ({"finding": Finding(Status.SEARCHING)}, Status.SEARCHING),
        ({"finding": Finding(Status.AMBIGUOUS)}, Status.AMBIGUOUS),
        ({"finding": Finding(Status.INCOHERENT)}, Status.INCOHERENT),
        ({"finding": Finding(Status.TIME_LOCKED), "changed": True}, Status.TIME_LOCKED),
        ({"finding": Finding(Status.OUT_OF_RANGE), "changed": True}, Status.OUT_OF_RANGE),
        ({"changed": True}, Status.NO_TEXTURE),
        ({"doubted": True, "finding": Finding(Status.TIME_LOCKED)}, Status.SEARCHING),
        ({"known": (0.0, 0.0)}, Status.SEARCHING),
        ({"known": (TRUE, 0.024 * TRUE)}, Status.OK),
        ({"known": (TRUE, 0.026 * TRUE)}, Status.VAGUE),
        ({"known": (1 / (0.985 * LOW), 1e-3)}, Status.OK),
        ({"known": (1 / (0.97 * LOW), 1e-3)}, Status.OUT_OF_RANGE),
        ({"known": (1 / (1.015 * HIGH), 1e-4)}, Status.OK),
        ({"known": (1 / (1.03 * HIGH), 1e-4)}, Status.OUT_OF_RANGE),
    ],
)
def test_the_status_says_what_is_known(known, status):
    assert made(**(SURE | known))._status() == status


def test_the_scale_of_the_path_is_in_the_sigma_and_in_what_is_vague():
    own = made(0.015, **(SURE | {"known": (TRUE, 0.019 * TRUE)}))
    wavelength, sigma = own.estimate()
    assert wavelength == pytest.approx(1.7) and sigma == pytest.approx(1.7 * math.hypot(0.015, 0.019))
    assert own._status() == Status.OK
    own.memory.known = TRUE, 0.021 * TRUE
    assert own._status() == Status.VAGUE
    own.memory.known = 0.0, 1.0
    assert all(map(math.isnan, own.estimate()))


def test_hums_are_the_mains_harmonics_that_the_rate_shows_and_the_resonances():
    hums = checked((0.4, 6.0), 1000.0, 0.0, None, (77.5, 50.0)).hums_Hz
    assert hums == tuple(sorted({*range(50, 501, 50), *range(60, 481, 60), 77.5}))
    assert checked((0.4, 6.0), 99.0, 0.0, None, ()).hums_Hz == ()
    assert checked((0.4, 6.0), 100.0, 0.0, None, ()).hums_Hz == (50.0,)


@pytest.mark.parametrize(
    "asked, usable, not_usable",
    [
        ("wavelength_range_mm", [(1, 1.5), (0.1, 10)], [(1, 1.49), (0.1, 10.1)]),
        ("latency_s", [-0.1, 0.1, None], [-0.11, 0.11]),
        ("scale_sigma", [0, 0.2], [-0.01, 0.21]),
        ("ridge_pitch_mm", [0, 100, None], [-0.1, 101]),
        ("resonances_Hz", [(1.0,)], [(0.0,), (-5.0,)]),
    ],
)
def test_options_are_taken_up_to_their_limits(asked, usable, not_usable):
    plain = {"wavelength_range_mm": (0.4, 6), "rate_Hz": 1000.0, "scale_sigma": 0.0, "latency_s": None,
             "resonances_Hz": (), "ridge_pitch_mm": None}  # fmt: skip
    for value in usable:
        assert checked(**(plain | {asked: value}))
    for value in not_usable:
        with pytest.raises(InputError, match=asked):
            checked(**(plain | {asked: value}))


def test_a_stated_lateness_is_certain_and_another_is_looked_for():
    stated, unknown = made(latency_s=0.012).memory, made(latency_s=None).memory
    assert (stated.late_s, stated.late_variance) == (0.012, 0.0)
    assert unknown.late_s == 0.0 and unknown.late_variance == pytest.approx(0.01**2)
    trials = made(latency_s=None)._trials
    assert trials == pytest.approx(np.arange(-0.004, 0.0321, 0.002).tolist()) and len(unknown.sharper) == len(trials)


def test_a_state_is_of_this_many_gauges_and_this_range():
    with pytest.raises(InputError, match="the state is not of 2 gauges and this range of wavelengths"):
        made(gauges=2).remember(made().memory)
    with pytest.raises(InputError, match="the state is not of 1 gauges"):
        made().remember(made(high=40.0).memory)
    made().remember(made().memory)


@pytest.mark.parametrize("low, high", [(0.4, 6.0), (0.5, 1.0), (0.4, 40.0)])
def test_the_memory_is_sixteen_of_the_longest_wavelengths_or_at_least_six(low, high):
    """In cells of an eighth of the shortest; where 16 of the longest are too many cells, six are enough."""
    own = Follower(1, checked((low, high), RATE, 0.0, 0.0, ()))
    kept = own._cells * low / 8
    assert 6 * high - 1e-9 <= kept <= 16 * high + low / 8
    assert own._cells <= max(1024, math.ceil(48 * high / low))
    # And the grid of its spectrum holds all of it, in steps of a quarter of the shortest.
    assert own._size * low / 4 >= 16 * high and own._size < 4 * 16 * high / (low / 4)


def test_without_movement_the_finger_stands_after_a_fifth_of_a_second():
    own = made(**SURE)
    walked(own, 1.0)
    rest = [own.advance(0.05 + number / RATE, 1.0, (1.0,)) for number in range(1, 300)]
    stands = [status == Status.STANDSTILL for status in rest]
    assert 199 <= stands.index(True) <= 201 and all(stands[202:])
    assert own.advance(1.0, 1.02, (1.0,)) != Status.STANDSTILL


def test_steps_longer_than_the_longest_wavelength_shows_are_aliased():
    for step, aliased in ((HIGH / 2.1, True), (HIGH / 2.3, False)):
        found = walked(made(), 12 * step, step)
        assert (found[-1] == Status.ALIASED) == aliased


def test_what_is_not_known_is_said_and_ends_a_stroke():
    own = made(**SURE)
    walked(own, 2.0)
    assert own.advance(0.2, math.nan, (1.0,)) == Status.NO_VELOCITY
    assert own.memory.place == pytest.approx(2.0) and own.memory.cells.breaks == []
    walked(own, 1.0, begin=2.0, time=0.2)
    assert len(own.memory.cells.breaks) == 1
    before = own.memory.cells.end
    assert own.advance(0.9, 3.5, (math.nan,)) == Status.MISSING
    assert own.memory.cells.end == before, "a sample without a reading is in no cell"
    assert made(gauges=2).advance(0.0, 0.0, (math.nan, 1.0)) != Status.MISSING


def test_a_jump_over_more_than_is_remembered_begins_anew():
    for jump, known in ((15.9 * HIGH, True), (16.1 * HIGH, False)):
        own = made()
        walked(own, 2.0)
        before = knowing(own, **SURE).memory.cells.end
        own.advance(0.2, 2.0 + jump, (1.0,))
        assert (own.memory.agreed == 2) == known and own.memory.cells.end == (before + 1 if known else 0)


def test_a_window_is_the_latest_path_that_is_allowed_of_this_texture():
    own = made()
    walked(own, 66.0, 0.06)
    cells, end = own.memory.cells, own.memory.cells.end

    def path(begin):
        place = cells.between(begin, end)[:, 1]
        return place[-1] - place[0]

    assert path(own._window_begin(end)) == pytest.approx(16 * HIGH, abs=0.2)
    own.memory.limit = 10.0
    assert path(own._window_begin(end)) == pytest.approx(10.0, abs=0.2)
    own.memory.limit, own.memory.begin = 1e9, end - 20
    assert own._window_begin(end) == end - 20
    own._begin_anew(end, 3.0)
    assert path(own.memory.begin) == pytest.approx(3.0, abs=0.2)
    assert (own.memory.agreed, own.memory.proved, own.memory.changed, own.memory.limit) == (0, 0.0, True, 16 * HIGH)


def test_a_task_is_of_differences_and_of_the_strokes_inside():
    own = made(latency_s=0.01)
    walked(own, 8.0, begin=1e6, time=3e4)
    knowing(own, known=(TRUE, 0.01), proved=0.6, hums_Hz=(50.0,))
    own.memory.cells.breaks = [3, 10, 25, 60, 70]
    task = own._task(10, 60)
    assert task.breaks == (15,) and len(task.rows) == 50
    assert task.rows[0, :2] == pytest.approx([0, 0]) and task.rows[-1, :2] == pytest.approx([49 * 0.004, 49 * 0.08])
    np.testing.assert_array_equal(task.rows[:, 2:], own.memory.cells.between(10, 60)[:, 2:])
    assert (task.late_s, task.late_variance, task.proved, task.options) == (0.01, 0.0, 0.6, own.options)
    assert task.known_hums_Hz == (50.0,) and task.before == 0.0
    own.memory.agreed = 1
    assert own._task(10, 60).before == TRUE


def search_in(cells=200):
    """A search in so many cells; what is in them does not matter."""
    options = Options(LOW, HIGH, RATE, 0.0, 0.0, (), 0.0)
    task = Task(np.zeros((cells, 4)), (), options, LOW / 4, 64, 0.0, 0.0, 0.0, 0.0, ())
    return Search(task, 0, cells, 0.0)


def found_of(wavenumber=TRUE, sigma=1e-4, status=Status.OK, **some):
    return Finding(status, wavenumber, sigma, extent=20.0, **some)


def concluded(found, latency_s=0.0, **known):
    own = made(latency_s=latency_s)
    walked(own, 20.0)
    knowing(own, **known)._conclude(found, search_in())
    return own.memory


def test_looks_that_agree_are_counted_and_many_prove_the_wavenumber():
    known = {"known": (TRUE, 1e-4), "agreed": 3}
    for off, sigma, agreed in ((1.015, 1e-9, 4), (1.025, 1e-9, 1), (0.985, 1e-9, 4), (0.975, 1e-9, 1),
                               (1.04, 0.008 * TRUE, 4), (1.05, 0.008 * TRUE, 1)):  # fmt: skip
        memory = concluded(found_of(off * TRUE, sigma), **known)
        assert memory.agreed == agreed and memory.known == (off * TRUE, sigma) and memory.proved == 0.0
    memory = concluded(found_of(), known=(TRUE, 1e-4), agreed=4, changed=True, guessed=True)
    assert memory.proved == TRUE and not memory.changed and not memory.guessed
    # The first look agrees with nothing.
    assert concluded(found_of()).agreed == 1


def test_a_guess_counts_while_nothing_better_is_known():
    guess = found_of(0.7, status=Status.SEARCHING)
    for known, told in (
        ({}, 0.7),
        ({"known": (TRUE, 1e-4)}, TRUE),
        ({"known": (TRUE, 1e-4), "guessed": True}, 0.7),
        ({"known": (TRUE, 1e-4), "changed": True}, TRUE),
    ):
        memory = concluded(guess, agreed=3, **known)
        assert memory.known[0] == told and memory.agreed == 0 and (memory.guessed == (told == 0.7))
    assert concluded(found_of(0.0, status=Status.SEARCHING)).known == (0.0, 0.0)


def test_a_smeared_line_is_looked_for_in_less_of_the_path_and_another_in_more():
    smeared = found_of(status=Status.INCOHERENT)
    assert concluded(smeared).limit == pytest.approx(0.6 * 20)
    assert concluded(replace(smeared, extent=8.0)).limit == pytest.approx(2 * HIGH)
    assert concluded(found_of(), limit=15.0).limit == pytest.approx(1.15 * 20)
    assert concluded(found_of(), limit=30.0).limit == pytest.approx(1.15 * 30)
    assert concluded(found_of(), limit=63.0).limit == pytest.approx(16 * HIGH)


def test_the_lateness_is_that_of_the_look_within_what_is_looked_for():
    for late, told in ((0.013, 0.013), (0.04, 0.032), (-0.01, -0.004)):
        memory = concluded(found_of(late_s=late, late_variance=1e-8), latency_s=None)
        assert memory.late_s == told and memory.late_variance == pytest.approx(1e-8 + 1e-8)
    assert concluded(found_of(late_s=0.01, late_variance=1.0), latency_s=None).late_variance == pytest.approx(1e-4)
    stated = concluded(found_of(late_s=0.02, late_variance=1e-8), latency_s=0.01)
    assert (stated.late_s, stated.late_variance) == (0.01, 0.0)


def test_where_the_newest_periods_have_lost_the_line_another_surface_begins():
    for kept, sigma, anew in ((0.1, 0.12, True), (0.1, 0.15, False), (0.6, 0.0, False)):
        memory = concluded(found_of(kept=kept, kept_sigma=sigma), known=(TRUE, 1e-4), agreed=9)
        assert memory.changed == anew and (memory.agreed == 0) == anew
        assert memory.searched == 200
    assert not concluded(found_of(kept=0.0, status=Status.SEARCHING)).changed


@pytest.mark.parametrize(
    "found, known, held",
    [
        ({}, {}, True),
        ({"lines": ((1 / (TRUE + 0.03), 9.0, 0.0),)}, {}, False),
        ({"lines": ((1 / (TRUE + 0.02), 9.0, 0.0), (0.7, 3.0, 0.0))}, {}, True),
        ({"lines": ()}, {}, False),
        ({"status": Status.SEARCHING}, {}, False),
        ({"kept": 0.2}, {}, False),
        ({"kept": 0.2, "kept_sigma": 0.11}, {}, True),
        ({}, {"agreed": 4}, False),
    ],
)
def test_a_line_that_many_looks_agreed_on_is_held_while_its_phases_are_disturbed(found, known, held):
    smeared = found_of(0.9, status=Status.INCOHERENT, lines=((1.7, 9.0, 0.0),))
    own = made()
    walked(own, 2.0)
    knowing(own, **({"agreed": 5, "proved": TRUE, "known": (TRUE, 1e-4), "doubted": True} | known))
    changed = replace(smeared, **found)
    own._conclude(changed, search_in(20))
    assert (own.memory.known == (TRUE, 1e-4) and own.memory.agreed == (known or {"agreed": 5})["agreed"]) == held
    assert not own.memory.doubted and (own.memory.finding is changed) != held


def test_a_hum_is_taken_out_for_thirty_looks():
    for hummed, taken in ((28, (50.0,)), (30, ())):
        memory = concluded(found_of(), hums_Hz=(50.0,), hummed=hummed)
        assert memory.hums_Hz == taken and memory.hummed == (hummed + 1 if taken else 0)
    memory = concluded(found_of(hums_Hz=(60.0,)), hums_Hz=(50.0,), hummed=7)
    assert memory.hums_Hz == (60.0,) and memory.hummed == 0


def test_looks_are_rarer_once_every_lateness_was_tried_and_glances_tell():
    clear = {"amplitude": (1.0 + 0j,), "noise": (0.1,)}
    trials = len(made()._trials)
    for agreed, told, hop in ((trials + 5, clear, 50), (trials + 4, clear, 24), (trials + 5, {}, 24)):
        memory = concluded(found_of(**told), agreed=agreed, known=(TRUE, 1e-4))
        assert memory.hop == hop


def test_glances_tell_where_the_line_is_most_of_what_one_gauge_reads():
    own = made()
    for amplitude, noise, tell in (((1.0,), (0.49,), True), ((1.0,), (0.51,), False), ((0.1, 1.0), (0.4, 0.4), True)):
        found = found_of(amplitude=amplitude, noise=noise)
        assert own._glances(found) == tell and not own._glances(replace(found, mixed=True))
    own.memory.hums_Hz = (50.0,)
    assert not own._glances(found) and not made()._glances(found_of())


def test_a_lateness_is_taken_when_the_lines_are_often_sharper_for_it():
    own = made(latency_s=None, agreed=5)
    trial = 9
    for _ in range(8):
        own.memory.trial = trial
        own._weigh(0.0, 100.0)
        own._weigh(300.0, 180.0)
    assert own.memory.late_s == 0.0, "330 over 210 is less than 1.6"
    for _ in range(2):
        own.memory.trial = trial
        own._weigh(1000.0, 100.0)
    assert own.memory.late_s == own._trials[trial] and own.memory.agreed == 0
    assert own.memory.late_variance == pytest.approx(0.002**2) and set(own.memory.sharper) == {1.0}
    plain = made(latency_s=None)
    for _ in range(50):
        plain._weigh(18.0, 2.0)
    assert plain.memory.late_s == 0.0, "where no line stands out chance is sharper somewhere"


def test_the_next_look_waits_while_glances_see_and_many_agreed():
    for known, due in (({}, False), ({"waited": 151}, True), ({"glances": False}, True), ({"agreed": 4}, True)):
        own = made(**({"glances": True, "agreed": 5, "waited": 149} | known))
        assert own._due(24) == due


def test_the_next_look_waits_for_a_whole_window_while_glances_see_the_line():
    for known, due in (({}, False), ({"searched": 399}, True), ({"seen": 476}, True), ({"whole": 0}, True)):
        own = made(**({"searched": 400, "seen": 477, "whole": 101, "hop": 24, "waited": 151} | known))
        assert own._due(500) == due


def test_a_glance_asks_whether_the_newest_periods_still_have_the_line():
    """Of a wave that goes on, and of one that stops; only after as much path as it looks at."""
    for stops, doubted in ((math.inf, False), (25.0, True)):
        own = made()
        for number in range(1, 1501):
            place = 0.02 * number
            own.memory.search, own.memory.searched = None, max(own.memory.cells.end - 20, 0)
            own.advance(number / RATE, place, (math.cos(2 * math.pi * TRUE * place) * (place < stops),))
        known = {"finding": found_of(amplitude=(1.0 + 0j,), noise=(0.01,)), "agreed": 2, "glances": True}
        knowing(own, **known, searched=own.memory.cells.end - 20)
        end = own.memory.cells.end
        assert own._glance(end) and own.memory.doubted == doubted and own.memory.glanced == end
        assert own.memory.seen == end * (not doubted)
        own.memory.glances = own.memory.doubted = False
        assert not own._glance(end), "nothing would follow from it"
        own.memory.whole = 100
        assert own._glance(end) and not own.memory.doubted, "a weak line is seen, but not missed"
        own.memory.glanced, own.memory.searched = 0, 60
        assert not own._glance(end), "less path than the look had"


def test_a_glance_waits_for_eight_cells(monkeypatch):
    own, asked = made(), []
    for number in range(1, 1501):
        own.advance(number / RATE, 0.02 * number, (math.cos(2 * math.pi * TRUE * 0.02 * number),))
    monkeypatch.setattr(own, "_glance", asked.append)
    end = own.memory.cells.end
    for cells in (7, 8):
        own.memory.search, own.memory.searched, own.memory.doubted, own.memory.glanced = None, end, False, end - cells
        own._go_on()
    assert asked == [end], "after eight, not after seven"


@pytest.fixture
def endless(monkeypatch):
    """Searches that are never done: how many pieces of them were asked for."""
    asked = []

    def pieces(search):
        while True:
            asked.append(search)
            yield

    monkeypatch.setattr(Search, "run", pieces)
    return asked


@pytest.mark.parametrize(
    "rate, gauges, cells, pieces", [(1000.0, 1, 400, 2), (1000.0, 1, 600, 1), (1000.0, 2, 400, 1), (1000.0, 5, 400, 1),
                                   (1000.0, 1, 90, 2), (100.0, 5, 400, 12), (400.0, 5, 400, 3), (5000.0, 5, 400, 1)]
)  # fmt: skip
def test_a_sample_does_so_much_of_a_search(rate, gauges, cells, pieces, endless):
    """1200 pieces a second at slow rates; two at a time where they are half as long."""
    own = made(rate=rate, gauges=gauges)
    own.memory.search = Spread(search_in(cells))
    own._advance(own.memory.search)
    assert own.memory.search.done == pieces == len(endless)


def test_searches_begin_every_24_cells_and_a_doubt_begins_one_at_once(endless):
    own = made()
    walked(own, 23.5 * 0.08)
    assert own.memory.cells.end == 23 and own.memory.search is None
    walked(own, 0.16, begin=23.5 * 0.08, time=0.1)
    search = own.memory.search.task
    assert (search.begin, search.end) == (0, 24) and search.origin == pytest.approx(0.05)
    knowing(own, doubted=True, searched=own.memory.cells.end)
    own._go_on()
    assert own.memory.search is not None and own.memory.search.done == 0
    # Of less path than 24 cells there is no look.
    knowing(own, begin=own.memory.cells.end - 20, searched=0)
    own._go_on()
    assert own.memory.search is None and own.memory.searched == own.memory.cells.end
    knowing(own, searched=own.memory.cells.end - 23)
    own._go_on()
    assert own.memory.search is None and own.memory.waited == 1
    knowing(own, searched=own.memory.cells.end - 24)
    own._go_on()
    assert own.memory.search is not None and own.memory.waited == 0


def test_a_search_that_was_under_way_is_gone_on_with_where_it_was(endless):
    own = made()
    walked(own, 3.0)
    done = own.memory.search.done
    assert done > 3
    endless.clear()
    own.remember(copy.deepcopy(own.memory))
    assert own.memory.search.done == done and endless == [], "what was done is done again when it goes on"
    walked(own, 0.02, begin=3.0, time=0.2)
    assert own.memory.search.done == done + 2 == len(endless)


def test_every_lateness_is_tried_in_turn_after_a_look_with_a_line():
    own = made(latency_s=None)
    walked(own, 20.0)
    knowing(own)
    count = len(own._trials)
    for turn in range(1, count + 3):
        own.memory.search = None
        own._conclude(found_of(score=40.0, late_variance=1e-6), search_in())
        assert own.memory.trial == turn % count and own.memory.search.task.trial_s == own._trials[turn % count]
        assert own.memory.search.task.score == 40.0 and own.memory.search.done == 0
    own.memory.search = None
    own._conclude(found_of(score=0.0), search_in())
    assert own.memory.search is None, "of no line there is none that is sharper"
    stated = made(latency_s=0.0)
    walked(stated, 20.0)
    stated.memory.search = None
    stated._conclude(found_of(score=40.0), search_in())
    assert stated.memory.search is None and stated.memory.trial == 0
