"""Fundamentals, whole turns between gauges, cells of a path, and the trackers around them: by hand, at each limit."""

import math

import numpy as np
import pytest

from papilla.core.errors import InputError
from papilla.estimators import FusedTracker, SpaceTracker
from papilla.estimators.wavelength import TrackingStatus
from papilla.estimators.wavelength.fundamental import fundamental_of, lone
from papilla.estimators.wavelength.memory import Cells, SearchResult
from papilla.estimators.wavelength.spectrum import Line
from papilla.estimators.wavelength.trackers import wavelength_between


def line(wavenumber, amplitude=1.0, ratio=1000.0):
    return Line(wavenumber, ratio, amplitude, 1e-9)


HALF, FAINT = line(0.5, 0.5), line(0.5, 0.2)


@pytest.mark.parametrize(
    "others, reach, told",
    [
        # One loud line at half fits by chance in 2 reaches of the half: less than 2 % is believed.
        ([line(0.5, 0.31)], 0.0049, (0.5, True)), ([line(0.5, 0.31)], 0.0051, (1.0, False)),
        # A faint one does not prove, and is a doubt while it would be rare by chance.
        ([line(0.5, 0.29)], 0.0049, (1.0, False)), ([line(0.5, 0.29)], 0.0051, (1.0, True)),
        # Two faint ones that both fit do, where chance is below a thousandth.
        ([FAINT, line(1.5, 0.2)], 0.0039, (0.5, True)), ([FAINT, line(1.5, 0.2)], 0.0040, (1.0, False)),
        # Among more lines each fits more easily.
        ([HALF, line(0.71, 0.1)], 0.0026, (1.0, False)), ([HALF, line(0.71, 0.1)], 0.0024, (0.5, True)),
        # How far off it may lie is at most a tenth of the fundamental.
        ([line(0.5024, 0.5)], 0.0025, (0.5, True)), ([line(0.5026, 0.5)], 0.0025, (1.0, True)),
        ([line(1 / 6 + 0.016, 0.5)], 0.9, (1.0, False)),
        # Up to the sixth harmonic. A lower fundamental must be ten times plainer.
        ([line(1 / 6, 0.5)], 0.0016, (1 / 6, True)), ([line(1 / 7, 0.5)], 0.0013, (1.0, True)),
        ([HALF, line(0.75, 0.5), line(1.25, 0.4)], 1e-3, (0.25, True)),
    ],
)  # fmt: skip
def test_a_fundamental_is_believed_where_chance_does_not_make_it(others, reach, told):
    found = fundamental_of(line(1.0), others, reach, set(others), False)
    assert (found.wavenumber, not found.other) == (pytest.approx(told[0]), told[1])


@pytest.mark.parametrize(
    "others, told",
    [
        ([line(0.5, 0.5)], (0.5, True)), ([line(0.5, 0.13), line(1.5, 0.1)], (0.5, True)),
        ([line(0.5, 0.12), line(1.5, 0.1)], (0.5, False)), ([line(0.506, 0.01)], (1.0, False)),
        ([line(0.509, 0.01)], (1.0, True)),
    ],
)  # fmt: skip
def test_where_ridges_may_feel_a_harmonic_louder_faint_lines_prove_nothing(others, told):
    """And one within three times the reach is a doubt."""
    found = fundamental_of(line(1.0), others, 0.0025, set(others), True)
    assert (found.wavenumber, not found.other) == told
    assert fundamental_of(line(1.0), others, 0.0025, set(), True) == (1.0, 0.0, False)


@pytest.mark.parametrize(
    "pitch, enough", [(1.0, 1600), (1.24, 1600), (1.26, 400), (0.76, 1600), (0.74, 400), (0.2, 400), (2.8, 1600)]
)
def test_a_lone_line_is_sure_once_its_fundamental_would_be_seen(pitch, enough):
    """25 over the background at an eighth of its amplitude, where all ridges feel it in step, else at a quarter."""
    assert lone(line(1.0, ratio=enough - 1), pitch) and not lone(line(1.0, ratio=enough + 1), pitch)
    assert not lone(line(1.0, ratio=1.0), 0.0)


PLACES, SIGMAS = np.array([0.0, 2.3, 5.9, 7.1]), np.array([0.03, 0.05, 0.02, 0.06])


def phases(wavelength, errors=0.0, shift=0.7):
    return np.angle(np.exp(1j * (2 * np.pi * PLACES / wavelength + shift + errors)))


def test_the_sigma_between_gauges_is_that_of_a_line_through_phases_that_share_the_first_ones_error():
    found, sigma = wavelength_between(PLACES, phases(1.7), SIGMAS, 1.7)
    assert found == pytest.approx(1.7, rel=1e-9)
    d, s = PLACES[1:], SIGMAS[1:]
    weight = 1 / (s**2 + SIGMAS[0] ** 2)
    slope = weight * d / (weight @ d**2)
    variance = slope @ (np.diag(s**2) + SIGMAS[0] ** 2) @ slope
    assert sigma == pytest.approx(1.7**2 / (2 * np.pi) * math.sqrt(variance), rel=1e-9)
    # The same whichever place is called 0, and on the way back.
    assert wavelength_between(PLACES + 40, phases(1.7), SIGMAS, 1.7) == pytest.approx((found, sigma))
    assert wavelength_between(-PLACES, -phases(1.7), SIGMAS, 1.7) == pytest.approx((found, sigma))


def test_phases_that_misfit_are_known_less_by_birges_ratio():
    errors = np.array([0.0, 0.12, -0.12, 0.1])
    found, sigma = wavelength_between(PLACES, phases(1.7, errors), SIGMAS, 1.7)
    _, usual = wavelength_between(PLACES, phases(found), SIGMAS, found)
    k, best = 2 * np.pi / found, math.inf
    for shift in np.linspace(-0.5, 0.5, 4001):
        best = min(best, float((((2 * np.pi * PLACES / 1.7 + errors) - k * PLACES - shift) ** 2 / SIGMAS**2).sum()))
    assert best > 8 and sigma / usual == pytest.approx(math.sqrt(best / 2), rel=0.01)


def cells(turn=0.25, length=0.1, rows=40, gauges=2):
    return Cells(np.zeros((rows, 3 + gauges)), length, turn)


def filled(own, places, begin=0.0, readings=(1.0, 2.0)):
    for number, place in enumerate(places):
        own.fill(begin + number / 1000, float(place), readings)
    return own


def test_a_cell_is_the_mean_of_the_samples_that_lie_in_it():
    own = cells()
    for number, (place, reading) in enumerate([(0.0, (1.0, 5.0)), (0.04, (2.0, math.nan)), (0.09, (6.0, 7.0))]):
        own.fill(number / 10, place, reading)
    assert own.end == 0 and own.count == 0
    own.fill(0.3, 0.1, (math.nan, math.nan))
    assert own.end == 1 and own.between(0, 1)[0] == pytest.approx([0.1, 0.13 / 3, 3, 3.0, 6.0])
    own.fill(0.4, 0.0, (1.0, 1.0))
    row = own.between(1, 2)[0]
    assert row[:3] == pytest.approx([0.3, 0.1, 1]) and np.isnan(row[3:]).all(), "on the way back as well"


def steps(first, last):
    """Places an eighth of a mm apart, each in a cell of its own."""
    return np.arange(8 * first, 8 * last, math.copysign(1, last - first)) / 8


def test_a_stroke_ends_where_the_path_turned_by_more_than_play():
    """The last sample is in the open cell; 0.25 mm back is no turn, 0.375 mm is."""
    for back, breaks in ((1.625, []), (1.5, [16])):
        own = filled(cells(), [*steps(0, 2), *steps(1.75, back), back, 9.0])
        assert own.breaks == breaks and own.direction == (-1.0 if breaks else 1.0)
        assert own.extreme == (back if breaks else 1.875) and own.extreme_cell == (own.end - 1 if breaks else 15)
    own = filled(cells(), [*steps(0, 2), 1.75, 1.625, *steps(1.75, 2.5)])
    assert own.breaks == [] and own.extreme == 2.25, "a little way back is none, whatever follows"


def sure(own, status=TrackingStatus.OK, wavelength=1.7, sigma=1e-4, finding=None, **known):
    """A tracker in a state in which five searches have found this."""
    state = own.state
    found = SearchResult(status, 1 / wavelength, 1e-4, **(finding or {}))
    known = {"finding": found, "known": (1 / wavelength, sigma), "agreed": 5} | known
    for name, value in known.items():
        setattr(state.follower, name, value)
    own.state = state
    return own


def test_a_path_is_the_trapezoids_of_the_velocity_and_has_gaps_where_it_has():
    own = SpaceTracker(sample_rate_Hz=100.0)
    own.process([(1.0, 10.0), (1.0, 20.0), (1.0, -10.0)])
    assert own.state.place_mm == pytest.approx(0.15 + 0.05) and own.state.samples == 3
    # The step is a mean over a quarter of the path that is remembered: 64 mm.
    steady = SpaceTracker(wavelength_range_mm=(0.5, 4.0))
    steady.process([(1.0, 50.0)] * 321)
    assert steady.state.follower.step == pytest.approx(0.05 * (1 - math.exp(-1)), rel=0.01)
    # What it did while the velocity was not known is not known.
    for velocity, place, broken in ((math.nan, 0.2, True), (30.0, 0.2, True), (30.0, 0.5, False)):
        own.update((1.0, velocity))
        assert own.state.place_mm == pytest.approx(place)
        assert own.state.follower.cells.broken >= (broken and velocity != velocity)


K = 1 / 1.7


S = TrackingStatus


@pytest.mark.parametrize(
    "known, status",
    [
        ({}, S.OK), ({"status": S.CONSTANT_SPEED}, S.CONSTANT_SPEED), ({"agreed": 1}, S.SEARCHING),
        ({"agreed": 2, "hums_Hz": (50.0,)}, S.SEARCHING), ({"agreed": 3, "hums_Hz": (50.0,)}, S.OK),
        ({"status": S.SEARCHING}, S.SEARCHING), ({"status": S.AMBIGUOUS}, S.AMBIGUOUS),
        ({"status": S.INCOHERENT}, S.INCOHERENT), ({"status": S.TIME_LOCKED, "changed": True}, S.TIME_LOCKED),
        ({"status": S.OUT_OF_RANGE, "changed": True}, S.OUT_OF_RANGE), ({"changed": True}, S.NO_TEXTURE),
        ({"doubted": True, "status": S.TIME_LOCKED}, S.SEARCHING), ({"known": (0.0, 0.0)}, S.SEARCHING),
        ({"sigma": 0.024 * K}, S.OK), ({"sigma": 0.026 * K}, S.VAGUE), ({"wavelength": 0.985 * 0.5}, S.OK),
        ({"wavelength": 0.97 * 0.5}, S.OUT_OF_RANGE), ({"wavelength": 1.015 * 4.0}, S.OK),
        ({"wavelength": 1.03 * 4.0}, S.OUT_OF_RANGE),
    ],
)  # fmt: skip
def test_the_status_says_what_is_known(known, status):
    """A sigma of 2.5 % is vague; a wavelength within 2 % of the ends of the range is inside."""
    own = sure(SpaceTracker(scale_sigma=0.0, wavelength_range_mm=(0.5, 4.0)), **known)
    assert own.update((1.0, 50.0)).status == status


def test_what_stops_a_path_is_said_at_once():
    """A fifth of a second without movement; an unknown velocity; a missing reading; steps that alias the range."""
    own = sure(SpaceTracker(wavelength_range_mm=(0.5, 4.0)))
    own.process([(1.0, 50.0)] * 40)
    rest = own.process([(1.0, 0.0)] * 300).status == TrackingStatus.STANDSTILL
    assert 198 <= rest.argmax() <= 202 and rest[203:].all()
    assert own.update((1.0, 50.0)).status != TrackingStatus.STANDSTILL
    assert own.update((1.0, math.nan)).status == TrackingStatus.NO_VELOCITY
    assert own.update((math.nan, 50.0)).status == TrackingStatus.MISSING
    for step, aliased in ((4.0 / 2.1, True), (4.0 / 2.3, False)):
        found = SpaceTracker(wavelength_range_mm=(0.5, 4.0)).process([(1.0, 1000 * step)] * 12)
        assert (found.status[-1] == TrackingStatus.ALIASED) == aliased


def test_a_stated_lateness_is_certain_and_another_is_looked_for():
    stated, unknown = SpaceTracker(latency_s=0.012), SpaceTracker()
    assert (stated.latency_s, stated.latency_sigma_s) == (0.012, 0.0)
    assert (unknown.latency_s, unknown.latency_sigma_s) == (0.0, pytest.approx(0.01))
    with pytest.raises(InputError, match="the state is not of 2 gauges and this range of wavelengths"):
        FusedTracker(2).state = stated.state
    with pytest.raises(InputError, match="the state is not of 1 gauges"):
        SpaceTracker(wavelength_range_mm=(0.5, 40.0)).state = stated.state


@pytest.mark.parametrize(
    "status, told",
    [(TrackingStatus.OK, True), (TrackingStatus.CONSTANT_SPEED, True), (TrackingStatus.INCOHERENT, False)],
)
def test_phases_between_gauges_tell_where_the_wavelength_is_ok(status, told):
    phase, sigma = (2 * np.pi * PLACES / 1.7) / (2 * np.pi) % 1, (0.004, 0.008, 0.003, 0.01)
    own = sure(FusedTracker(tuple(PLACES)), status, finding={"phase": tuple(phase), "phase_sigma": sigma})
    found = own.update((1.0, 1.0, 1.0, 1.0, 50.0))
    assert math.isfinite(found.wavelength_by_phase_mm) == told
    if told:
        expected = wavelength_between(PLACES, 2 * np.pi * phase, 2 * np.pi * np.array(sigma), 1.7)
        assert (found.wavelength_by_phase_mm, found.wavelength_by_phase_sigma_mm) == pytest.approx(expected)
        assert found.wavelength_by_phase_mm == pytest.approx(1.7)
    # A phase that is not known to a tenth of a turn is none; one alone tells nothing.
    for sigma, known in (((0.004, 0.11, 0.003, 0.11), told), ((0.004, 0.11, 0.11, 0.11), False)):
        own = sure(FusedTracker(tuple(PLACES)), status, finding={"phase": tuple(phase), "phase_sigma": sigma})
        assert math.isfinite(own.update((1.0, 1.0, 1.0, 1.0, 50.0)).wavelength_by_phase_mm) == known
    assert math.isnan(
        sure(FusedTracker(4), status, finding={"phase": tuple(phase), "phase_sigma": sigma}).update((1.0,) * 5)[4]
    )
