"""The parts of the velocity-blind tracker by themselves: what a step learns, where a design begins, what is refused."""

import math

import numpy as np
import pytest

from papilla.estimators.stream import completed
from papilla.estimators.wavelength.chirp import HOP_S, LEARNT_S, ChirpStatus, ChirpTracker
from papilla.estimators.wavelength.frequency_search import (
    CHIRPS,
    OCTAVE,
    STIFFNESS,
    FrequencySearch,
    SubharmonicTest,
    nominated,
    price_of,
)
from papilla.estimators.wavelength.motion_fit import (
    KNOTS,
    MOTION,
    SHAPE,
    TREND,
    MotionFit,
    designed,
    moved,
    phase_at,
    profile,
    solved,
    trend_of,
)

RATE = 1000.0
SIZE = MOTION + KNOTS + TREND + SHAPE


def stroke_of(frequency=60.0, noise=0.04, size=1.0, count=300, **some):
    """A fit of a wave with its second harmonic, that leaves this noise."""
    shape = np.zeros(SHAPE)
    shape[:2] = size, 0.4 * size
    residual = math.sqrt(noise) * np.random.default_rng(0).standard_normal(count)
    plain = MotionFit(
        np.array([0.3, frequency, 0.0, 0.0]), np.zeros(KNOTS), 0.02, 0.0375, np.zeros(TREND), shape,
        1e-4 * np.eye(SIZE), noise, residual, 1e6,
    )  # fmt: skip
    return plain._replace(**some)


def tracker_of(stroke=None, readings=None, **known):
    """A tracker that follows this, and remembers these readings and this."""
    own = ChirpTracker()
    memory = own._memory
    memory.stroke = stroke
    filled = np.random.default_rng(1).standard_normal(own._window) if readings is None else readings
    memory.readings[: len(filled)], memory.count = filled, len(filled)
    memory.swing, memory.span = 3600.0, own._window
    for name, value in known.items():
        setattr(memory, name, value)
    return own


@pytest.mark.parametrize(
    "options, usable",
    [
        ({"frequency_range_Hz": (20, 40)}, True),
        ({"frequency_range_Hz": (20, 39)}, False),
        ({"frequency_range_Hz": (4, 400)}, True),
        ({"frequency_range_Hz": (3.9, 400)}, False),
        ({"frequency_range_Hz": (100, 401)}, False),
        ({"lag_s": 0.03}, True),
        ({"lag_s": 0.0}, True),
        ({"lag_s": 0.0301}, False),
        ({"sample_rate_Hz": 75.0}, True),
        ({"sample_rate_Hz": 74.0}, False),
        ({"sample_rate_Hz": 1e4}, True),
    ],
)
def test_the_limits_are_where_they_are_said_to_be(options, usable):
    """15 to 400 Hz by default, or to 0.4 of the sampling rate; a factor of 2 to 100; at most 30 ms of age."""
    if usable:
        assert ChirpTracker(**options)
    else:
        with pytest.raises(ValueError, match="frequency_range_Hz must span|lag_s must"):
            ChirpTracker(**options)


def test_the_windows_hold_so_many_periods_of_the_lowest_frequency():
    for rate, lowest in ((1000.0, 15.0), (4000.0, 40.0)):
        own = ChirpTracker(sample_rate_Hz=rate, frequency_range_Hz=(lowest, 10 * lowest), lag_s=0.01)
        assert own._window == math.ceil(4.5 * rate / lowest) and len(own._middle) == round(2 * rate / lowest)
        assert own._times[0] == pytest.approx(-(own._window - 1) / rate) and own._times[-1] == 0.0
        assert own._middle.sum() == pytest.approx(0.0, abs=1e-9) and np.diff(own._middle) == pytest.approx(1 / rate)
        assert own._spacing * KNOTS == pytest.approx((own._window - 1) / rate) and own.lag_s == 0.01
    assert ChirpTracker(lag_s=0.0126).lag_s == 0.013
    assert ChirpTracker(sample_rate_Hz=75.0)._window == 32, "22 samples are too few to fit"


def test_a_spread_grows_where_what_is_found_scatters_by_more_than_was_expected():
    """Estimates under a prior scatter by its variance less their own; a ratio of 5 at most counts."""
    own, values = ChirpTracker(), np.array([3.0, -3.0, 3.0, -3.0])
    weight = HOP_S / LEARNT_S
    assert own._grown(3.0, values, np.zeros(4)) == pytest.approx(3.0)
    assert own._grown(1.5, values, np.zeros(4)) == pytest.approx(1.5 * math.exp(0.5 * weight * 3))
    assert own._grown(6.0, values, np.zeros(4)) == pytest.approx(6.0 * math.exp(-0.5 * weight * 0.75))
    assert own._grown(0.1, values, np.zeros(4)) == pytest.approx(0.1 * math.exp(0.5 * weight * 4))
    # Half of the prior's variance is the estimates' own: what they say counts half, of half of it.
    assert own._grown(3.0, values / math.sqrt(2), np.full(4, 4.5)) == pytest.approx(3.0)
    assert own._grown(3.0, values, np.full(4, 4.5)) == pytest.approx(3.0 * math.exp(0.5 * 0.5 * weight))
    # Nothing is told where they are as uncertain as before.
    assert own._grown(3.0, 100 * values, np.full(4, 9.0)) == pytest.approx(3.0)
    assert own._grown(3.0, 100 * values, np.full(4, 20.0)) == pytest.approx(3.0)


def test_readings_that_change_by_noise_alone_are_still():
    """In the newest half of a design's window, of which more than eight are known."""
    own = tracker_of()
    half = len(own._middle) // 2
    readings = own._memory.readings
    readings[: own._memory.count - half] = 1e6
    readings[own._memory.count - half : own._memory.count] = np.resize([1.0, -1.0], half)
    assert own._still(0.95, 1.0) and own._still(0.0, 10.1) and own._still(1.0, 0.0)
    assert not own._still(0.85, 1.0) and not own._still(0.0, 9.9)
    readings[own._memory.count - half : own._memory.count - 9] = np.nan
    assert own._still(1.0, 1.0)
    readings[own._memory.count - 9] = np.nan
    assert not own._still(1.0, 1.0)
    own._memory.count = 9
    readings[:9] = 0.0
    assert own._still(0.0, 0.0)


def test_a_profile_is_learnt_from_what_the_window_soon_leaves_behind():
    """Normal equations of a hop a quarter into the window; what was known fades, what is missing adds nothing."""
    own, stroke = tracker_of(), stroke_of()
    true = np.random.default_rng(3).standard_normal(SHAPE)
    rows = slice(own._window // 4, own._window // 4 + own._hop)
    columns, _ = profile(*phase_at(stroke, own._times[rows]), RATE)
    residual = np.full(own._window, 1e3)
    residual[rows] = columns @ (true - stroke.shape)
    readings = np.zeros(own._window)
    fitted = stroke._replace(residual=residual)
    own._memory.known, own._memory.about = 50 * np.eye(SHAPE), true
    own._learn_profile(fitted, readings)
    faded = 50 * (1 - HOP_S / 0.5) * np.eye(SHAPE)
    np.testing.assert_allclose(own._memory.known, faded + columns.T @ columns, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(own._memory.about, true, rtol=1e-6)
    readings[rows] = np.nan
    residual[rows] = 0.0
    own._memory.known, own._memory.about = 50 * np.eye(SHAPE), true
    own._learn_profile(fitted, readings)
    np.testing.assert_allclose(own._memory.known, faded)
    np.testing.assert_allclose(own._memory.about, true, rtol=1e-6)


def loose(own, stroke):
    prior, about = own._prior(stroke)
    with np.errstate(divide="ignore"):
        return np.diag(prior) ** -0.5, about, prior


def test_what_is_known_before_the_readings_goes_with_the_size_and_the_speed_of_the_wave():
    own, stroke = tracker_of(), stroke_of()
    plain, about, prior = loose(own, stroke)
    motion, jumps = slice(MOTION), slice(MOTION, MOTION + KNOTS)
    offset, slope, kinks, shape = (
        MOTION + KNOTS,
        MOTION + KNOTS + 1,
        slice(MOTION + KNOTS + 2, -SHAPE),
        slice(-SHAPE, None),
    )
    assert plain[offset] == math.inf and np.count_nonzero(prior - np.diag(np.diag(prior))) == 0
    assert plain[:3] == pytest.approx([0.25, 30.0, 1200.0]) and plain[slope] == pytest.approx(2.0)
    assert plain[jumps] == pytest.approx(60.0 * math.sqrt(own._spacing)) and plain[kinks] == pytest.approx(0.1)
    assert plain[shape] == pytest.approx(10.0)
    # Three times the wave: offset and profile may be three times as far; the motion is no other.
    more, _, _ = loose(own, stroke._replace(shape=3 * stroke.shape))
    assert more[slope:] == pytest.approx(3 * plain[slope:]) and more[motion] == pytest.approx(plain[motion])
    # Twice as fast, and twice as lively.
    own._memory.swing = 4 * 3600.0
    fast, _, _ = loose(own, stroke)
    assert fast[1:3] == pytest.approx(2 * plain[1:3]) and fast[jumps] == pytest.approx(2 * plain[jumps])
    own._memory.swing, own._memory.lively, own._memory.wander = 3600.0, 3.0, 0.5
    lively, _, _ = loose(own, stroke)
    assert lively[jumps] == pytest.approx(3 * plain[jumps]) and lively[kinks] == pytest.approx(5 * plain[kinks])
    assert lively[3] < plain[3]
    # A frequency now above its usual size counts, and next to none is 1 Hz.
    assert own._swing(stroke._replace(motion=np.array([0, -90.0, 0, 0]))) == 90.0 and own._swing(stroke) == 60.0
    own._memory.swing = 0.0
    assert own._swing(stroke._replace(motion=np.zeros(4))) == 1.0


def test_the_prior_is_about_the_motion_and_what_was_learnt_of_profile_and_stiffness():
    own = tracker_of(known=7.0 * np.eye(SHAPE), about=np.arange(9.0), stiffness=(20.0, 100.0))
    stroke = stroke_of(motion=np.array([0.3, 60.0, 5.0, 40.0]), jumps=np.ones(KNOTS), trend=np.arange(1.0, 11.0))
    known, about, prior = loose(own, stroke)
    assert about[: MOTION - 1] == pytest.approx([0.3, 60.0, 5.0]) and about[-SHAPE:] == pytest.approx(np.arange(9.0))
    assert not about[MOTION : MOTION + KNOTS].any() and about[MOTION + KNOTS : -SHAPE] == pytest.approx(
        [1, 2, *[0] * 8]
    )
    assert np.diag(prior)[-SHAPE:] == pytest.approx(0.01 + 7.0 / stroke.noise)
    # Between what was learnt and where it is now, by what is known of the one and how firmly the other is held.
    firm = known[3] ** -2 - 1 / 100.0
    # As firmly as the jumps could stand for it: what it bends over the window, to the fifth power of that.
    assert firm == pytest.approx(10 * 60.0 * 0.299**5) and about[MOTION - 1] == pytest.approx(
        (20.0 / 100 + 40.0 * firm) / (1 / 100 + firm)
    )


def learnt(stroke, hopped=None, **known):
    own = tracker_of(stroke, **known)
    own._learn(stroke, np.zeros(own._window) if hopped is None else hopped)
    return own._memory


def test_the_noise_is_that_of_the_residual_and_a_fit_far_above_it_is_doubted():
    """Each parameter of the motion and four more take a reading's worth; the noise fades in within 0.5 s / 3."""
    for more in (1.0, 1.3, 1.5):
        stroke = stroke_of()
        residual = stroke.residual * math.sqrt(more * 0.04 * 292 / (stroke.residual @ stroke.residual))
        memory = learnt(stroke._replace(residual=residual))
        assert memory.doubt == pytest.approx(more)
        step = 3 * HOP_S / 0.5 * (more < 1.4)
        assert memory.stroke.noise == pytest.approx(0.04 * (1 + step * (more - 1)))
    part = np.zeros(300)
    part[:100] = np.nan
    residual = np.where(np.isnan(part), 0.0, stroke.residual)
    assert learnt(stroke._replace(residual=residual), part).doubt == pytest.approx(residual @ residual / 192 / 0.04)
    # However exactly they fit: rounding is 1e-8 of the wave.
    assert learnt(stroke._replace(residual=np.zeros(300))).doubt == pytest.approx(1e-8 / 0.04)


def test_the_stiffness_is_learnt_by_what_a_hop_adds():
    """A Kalman filter: of the window's information a hop's share is new, and the stiffness wanders."""
    for found, spread in ((50.0, 4.0), (-30.0, 1.0)):
        covariance = 1e-4 * np.eye(SIZE)
        covariance[3, 3] = spread**2
        stroke = stroke_of(motion=np.array([0.3, 60.0, 0.0, found]), covariance=covariance)
        mean, variance = learnt(stroke, stiffness=(10.0, 100.0)).stiffness
        new = (1 / spread**2 - 0.01) * 8 / 300
        assert mean == pytest.approx((10.0 * 0.01 + found * new) / (0.01 + new))
        assert variance == pytest.approx(1 / (0.01 + new) + 10.0**2 * HOP_S)
    covariance[3, 3] = 200.0
    assert learnt(stroke._replace(covariance=covariance), stiffness=(10.0, 100.0)).stiffness == (10.0, 100.8)
    covariance[3, 3] = 1e6
    assert learnt(stroke._replace(covariance=covariance)).stiffness[1] == STIFFNESS**2


def test_a_motion_livelier_than_expected_is_expected_to_be_so():
    usual = 60.0 * math.sqrt(ChirpTracker()._spacing)
    calm, lively = (learnt(stroke_of(jumps=size * usual * np.ones(KNOTS))).lively for size in (0.0, 2.0))
    assert calm < 1.0 < lively
    doubted = stroke_of(noise=0.02, residual=stroke_of().residual)
    assert learnt(doubted).lively == pytest.approx(2 * calm, rel=0.05)
    kinked = stroke_of(trend=np.array([0.0, 0.0, *[0.3] * KNOTS]))
    assert learnt(kinked).wander > 0.11 and learnt(stroke_of()).wander == 0.1
    assert learnt(stroke_of(jumps=1e9 * np.ones(KNOTS)), lively=99.0).lively == 100.0
    assert learnt(stroke_of(), lively=0.1001).lively == 0.1


def test_a_fit_is_given_up_above_what_the_rate_shows_and_quiet_where_it_crawls():
    assert learnt(stroke_of(399.0)).stroke is not None and learnt(stroke_of(401.0)).stroke is None
    still = np.zeros(300)
    for frequency, quiet in ((14.0, True), (16.0, False), (-14.0, True)):
        assert learnt(stroke_of(frequency), readings=still).quiet == quiet
    assert not learnt(stroke_of(14.0), readings=np.resize([9.0, -9.0], 300)).quiet


def chosen(look_price, **known):
    """Whether a design's fit of 100 Hz is followed instead of one of 60 Hz."""
    own = tracker_of(**({"stroke": stroke_of(), "doubt": 1.0, "rival": -100.0, "waited": 30} | known))
    own._choose(stroke_of(100.0), look_price)
    return own


def test_another_fit_is_followed_where_it_is_better_by_far_or_the_own_is_lost():
    for price, known, followed in (
        (-101.0, {}, True), (-99.0, {}, False), (-99.0, {"doubt": 5.9}, False), (-99.0, {"doubt": 6.1}, True),
        (-99.0, {"stroke": None}, True), (-99.0, {"stroke": stroke_of(gain=77.0)}, True),
        (-99.0, {"stroke": stroke_of(gain=78.0)}, False), (-101.0, {"waited": 400}, True),
        (-101.0, {"waited": 401}, False),
    ):  # fmt: skip
        own = chosen(price, **known)
        memory = own._memory
        if not followed:
            assert memory.stroke is known.get("stroke", memory.stroke) and memory.swing == 3600.0
            continue
        # It is told of the end of the design's window, and catches up with what came since.
        late = own._middle[-1]
        assert memory.stroke.motion == pytest.approx(moved(np.array([0.3, 100.0, 0.0, 0.0]), late))
        assert memory.since == known.get("waited", 30) and memory.span == len(own._middle) and memory.swing == 1e4
        assert (memory.followed, memory.doubt, memory.lively) == (0.0, 1.0, 1.0) and not memory.known.any()
        assert memory.stiffness == (0.0, STIFFNESS**2) and memory.stroke.spacing == own._spacing
        assert memory.stroke.age == pytest.approx(own._spacing / 2) and memory.about == pytest.approx(stroke_of().shape)


@pytest.mark.parametrize(
    "doubt, waited, begins", [(1.0, 999, False), (1.0, 1000, True), (1.7, 99, False), (1.7, 100, True)]
)
def test_a_better_fit_is_looked_for_once_a_second_or_sooner_in_doubt(doubt, waited, begins):
    own = tracker_of(stroke_of(), doubt=doubt, waited=waited, price=-70.0)
    own._search()
    memory = own._memory
    assert (memory.search is not None) == begins
    if begins:
        assert memory.rival == -90.0 and memory.waited == 0
        np.testing.assert_array_equal(memory.search.task.readings, own._latest()[-len(own._middle) :])
    moving = np.random.default_rng(1).standard_normal(own._window) + 2 * np.sin(0.3 * np.arange(own._window))
    for readings, idle in ((None, True), (moving, False), (moving - 2 * np.linspace(-5, 5, own._window) ** 2, False)):
        own = tracker_of(None, readings, waited=0)
        own._search()
        assert own._memory.idle == idle == (own._memory.search is None), "at once, but not in noise alone"


@pytest.mark.parametrize(
    "known, ok, held",
    [
        ({}, True, False),
        ({"followed": 2.9}, False, True),
        ({"followed": 3.1}, True, False),
        ({"doubt": 1.39}, True, False),
        ({"doubt": 1.41}, False, True),
        ({"since": 16}, False, True),
        ({"since": 15}, True, False),
        ({"swing": 60.0**2 * 15.8}, True, False),
        ({"swing": 60.0**2 * 16.2}, True, True),
        ({"stroke": stroke_of(gain=77.0)}, False, True),
        ({"stroke": stroke_of(covariance=np.diag([1e-4, 8.0, *[1e-8] * 29]))}, True, False),
        ({"stroke": stroke_of(covariance=np.diag([1e-4, 10.0, *[1e-8] * 29]))}, True, True),
        ({"stroke": stroke_of(covariance=np.diag([1e-4, 35.0, *[1e-8] * 29]))}, True, True),
        ({"stroke": stroke_of(covariance=np.diag([1e-4, 38.0, *[1e-8] * 29]))}, False, True),
    ],
)
def test_a_frequency_is_ok_once_it_was_followed_and_a_wavelength_where_it_does_not_crawl(known, ok, held):
    """|v| / f; held where the frequency is not known to 5 %, and it is not ok where it is not known to 10 %."""
    usual = {"stroke": stroke_of(), "followed": 9.0, "doubt": 1.0, "since": 3, "lively": 1e-6, "other": 0.0,
             "held": (7.0, 0.1)}  # fmt: skip
    own = tracker_of(**(usual | known))
    found = own._answer(90.0, True)
    assert found.frequency_Hz == pytest.approx(60.0) and (found.status == ChirpStatus.OK) == ok
    assert found.wavelength_mm == pytest.approx(7.0 if held else 1.5)
    if not held:
        assert found.wavelength_sigma_mm == pytest.approx(1.5 * found.frequency_sigma_Hz / 60.0)
    spread = own._memory.stroke.covariance[1, 1] * max(own._memory.doubt, 1.0)
    assert found.frequency_sigma_Hz == pytest.approx(math.sqrt(spread), rel=0.02)
    assert own._answer(math.nan, True).wavelength_mm == own._memory.held[0]
    assert own._answer(90.0, False).status == ChirpStatus.MISSING


def test_sigma_holds_what_a_jump_since_the_youngest_knot_would_add():
    own = tracker_of(stroke_of(covariance=1e-12 * np.eye(SIZE)), lively=2.0)
    more = 0.3 * 2.0 * 60.0 * own._spacing**1.5
    assert own._answer(90.0, True).frequency_sigma_Hz == pytest.approx(more, rel=1e-3)


def test_a_step_moves_the_fit_and_its_knots_on():
    """In a stride of 16 ms at most; a knot is left behind where it is one and a half spacings old."""
    wave = np.cos(2 * np.pi * (60.0 * np.arange(-299, 1) / RATE + 0.3))
    for age, since, aged in ((0.02, 8, 0.028), (0.05, 8, 0.058 - 0.037375), (0.02, 40, 0.036)):
        jumps = np.arange(1.0, 9.0)
        own = tracker_of(stroke_of(age=age, jumps=jumps, spacing=0.037375), wave, since=since, span=200)
        stepped(own)
        memory = own._memory
        assert memory.stroke.age == pytest.approx(aged) and memory.since == max(since - 16, 0)
        assert memory.span == 200 + min(since, 16) and memory.followed == pytest.approx(60.0 * min(since, 16) / RATE)
        assert 0 <= memory.stroke.motion[0] < 1.5


def test_without_readings_the_motion_goes_on_and_sigma_grows_by_e_in_50_ms():
    own = tracker_of(stroke_of(), np.full(300, np.nan), since=8)
    stepped(own)
    found = own._memory.stroke
    assert found.motion == pytest.approx([(0.3 + 60 * 0.008) % 1, 60.0, 0.0, 0.0])
    assert found.covariance[5, 5] ** 0.5 == pytest.approx(1e-2 * math.exp(0.008 / 0.05))


def test_the_price_of_a_fit_is_schwarz_s_less_what_twice_its_frequency_could_explain():
    """Five harmonics of which those below 0.4 of the rate count: 60 Hz has all, 120 Hz three."""
    count, noise = 133, 0.04
    at_60, at_120 = (price_of(stroke_of(frequency), noise, count, RATE) for frequency in (60.0, -120.0))
    assert at_60 == pytest.approx(count * math.log(noise) + 10 * math.log(count) - OCTAVE * math.log2(60.0))
    assert at_120 - at_60 == pytest.approx(-4 * math.log(count) - OCTAVE)
    assert price_of(stroke_of(0.1), noise, count, RATE) == pytest.approx(at_60 + OCTAVE * math.log2(60.0))


def stepped(own):
    """A whole step."""
    own._follow()
    while own._memory.step is not None:
        own._follow()


def judged(frequency, chirp=0.0, noise=0.02, count=133):
    time = (np.arange(count) - 0.5 * (count - 1)) / RATE
    turns = frequency * (time + 0.5 * chirp * time**2)
    readings = 5.0 + np.cos(2 * np.pi * turns + 0.4) + 0.3 * np.cos(4 * np.pi * turns)
    return FrequencySearch(readings + noise * np.random.default_rng(2).standard_normal(count), time, 15.0, 400.0, RATE)


@pytest.mark.parametrize("frequency, chirp", [(60.0, 0.0), (90.0, 2.0), (45.0, -5.0), (150.0, 2.0)])
def test_a_look_finds_a_chirp_in_the_middle_of_its_window(frequency, chirp):
    assert sum(1 for _ in judged(frequency, chirp).run()) < 400
    best = fitted(judged(frequency, chirp))
    assert best.motion[1] == pytest.approx(frequency, rel=0.01)
    assert best.motion[2] == pytest.approx(frequency * chirp, abs=0.6 * frequency)
    assert best.noise == pytest.approx(0.02**2, rel=0.6) and best.proved


def test_the_places_that_are_tried_differ_and_are_the_best():
    places = [place for chirp in CHIRPS for place in completed(judged(60.0)._spectrum(chirp))]
    scores = [score for score, _ in places]
    tried = [motion[1] for motion in nominated(places)]
    assert len(scores) > 4 >= len(tried) > 1 and tried[0] == pytest.approx(60.0, rel=0.03)
    apart = np.abs(np.array(tried)[:, None] / tried - 1) + np.eye(len(tried))
    assert apart.min() > 0.045
    places = [(1.0, np.array([0, 50.0, 0, 0])), (3.0, np.array([0, 52.4, 0, 0])), (2.0, np.array([0, 70.0, 0, 0]))]
    assert [motion[1] for motion in nominated(places)] == [52.4, 70.0]


def test_a_try_begins_at_the_phase_of_the_readings_and_inside_the_range():
    design = judged(60.0, noise=0.0)
    begun = design._begun(np.array([0.0, 60.0, 0.0, 0.0]))
    assert begun.motion == pytest.approx([0.4 / (2 * np.pi), 60.0, 0.0, 0.0], abs=0.01)
    assert begun.noise == pytest.approx(np.var(design.readings))
    for frequency, tried in ((13.5, False), (13.7, True), (399.0, True), (401.0, False)):
        assert (design._begun(np.array([0.0, frequency, 0.0, 0.0])) is not None) == tried
    assert design._replace(readings=np.full(133, 3.0))._begun(np.array([0.0, 60.0, 0.0, 0.0])) is None


def test_too_few_readings_have_no_lines():
    for known, lines in ((31, False), (33, True)):
        design = judged(60.0)
        design.readings[known:] = np.nan
        assert bool(completed(design._spectrum(0.0))) == lines


def test_a_step_turns_the_phase_by_a_tenth_at_most():
    """And a stiffness bends it by no more than is linear in it."""
    stroke = stroke_of(count=300)
    time = np.arange(-299, 1) / RATE
    columns, _ = profile(*phase_at(stroke._replace(motion=np.array([0.3, 60.4, 0.0, 0.0])), time), RATE)
    loose_prior = 1e-9 * np.eye(SIZE)
    found = solved(designed(stroke, columns @ stroke.shape, time, RATE), loose_prior, stroke.values)
    turned = phase_at(found, time)[0] - phase_at(stroke, time)[0]
    assert np.abs(turned).max() <= 0.1 + 1e-6
    near, _ = profile(*phase_at(stroke._replace(motion=np.array([0.31, 60.0, 0.0, 0.0])), time), RATE)
    found = solved(designed(stroke, near @ stroke.shape, time, RATE), loose_prior, stroke.values)
    assert phase_at(found, time)[0] - phase_at(stroke, time)[0] == pytest.approx(0.01, abs=2e-3)
    waves = near @ found.shape
    assert found.gain == pytest.approx(waves @ waves / stroke.noise, rel=0.05)


def fitted(design):
    """The best fit of a design."""
    return completed(design.run())[0]


def test_a_look_does_not_depend_on_the_unit_the_offset_or_the_sign_of_the_readings():
    design = judged(60.0, 2.0)
    plain = fitted(design)
    for scale, offset in ((1e4, 0.0), (1e-3, 0.01), (-1.0, 0.0)):
        found = fitted(design._replace(readings=scale * design.readings + offset))
        assert found.motion[1:] == pytest.approx(plain.motion[1:], rel=1e-3, abs=0.05)
        assert found.noise == pytest.approx(scale**2 * plain.noise, rel=0.02)


def test_time_told_backwards_is_the_same_wave_with_the_opposite_chirp():
    forth = judged(80.0, 3.0)
    one, other = fitted(forth).motion, fitted(forth._replace(readings=forth.readings[::-1].copy())).motion
    assert abs(other[1]) == pytest.approx(one[1], rel=2e-3)
    assert other[2] / other[1] == pytest.approx(-one[2] / one[1], abs=0.15)


@pytest.mark.parametrize("frequency", [45.0, 70.0])
def test_a_wave_whose_second_harmonic_is_louder_has_the_fundamental_s_frequency(frequency):
    """And one whose third is; the multiples of the best fit are tried as well."""
    for order in (2, 3):
        design = judged(frequency)
        turns = frequency * design.time
        noise = 0.02 * np.random.default_rng(1).standard_normal(len(turns))
        readings = 0.4 * np.cos(2 * np.pi * turns) + np.cos(2 * np.pi * order * turns + 1) + noise
        assert fitted(design._replace(readings=readings)).motion[1] == pytest.approx(frequency, rel=0.01)


def test_missing_readings_do_not_move_the_fit():
    design = judged(60.0, 2.0)
    design.readings[[5, 40, 41, 42, 90, 128]] = np.nan
    found = fitted(design)
    assert found.motion[1] == pytest.approx(60.0, rel=0.01) and found.noise == pytest.approx(0.02**2, rel=0.6)


def test_noise_alone_has_no_fit_that_is_proved():
    design = judged(60.0)._replace(readings=np.random.default_rng(3).standard_normal(133))
    assert completed(design.run()) == (None, math.inf)


def test_the_chirps_that_are_looked_at_are_those_of_a_stroke_and_its_way_back():
    assert sorted(CHIRPS) == sorted(-chirp for chirp in CHIRPS) and len(set(CHIRPS)) == 7


@pytest.mark.parametrize("chirp", [0.0, 5.0, -9.0])
def test_a_line_over_warped_time_is_a_chirp_of_that_rate(chirp):
    """Its place is its frequency in the middle of the window, and a chirp of another rate stands out less."""
    design = judged(110.0, chirp)
    places = [place for tried in CHIRPS for place in completed(design._spectrum(tried))]
    score, motion = max(places, key=lambda place: place[0])
    assert motion[1] == pytest.approx(110.0, rel=0.02) and motion[2] == pytest.approx(chirp * motion[1])
    assert motion[0] == motion[3] == 0.0 and score > 0
    assert all(15.0 <= place[1][1] <= 400.0 for place in places)


def test_a_try_takes_its_phase_from_the_middle_where_any_chirp_is_nearly_right():
    design = judged(60.0, 3.0, noise=0.0)
    begun = design._begun(np.array([0.0, 60.0, 0.0, 0.0]))
    assert begun.motion[0] == pytest.approx(0.4 / (2 * np.pi), abs=0.05)


def test_what_a_step_learns_does_not_depend_on_the_unit_of_the_readings():
    spread = np.concatenate([np.full(MOTION + KNOTS, 1e-4), np.full(TREND + SHAPE, 4e-4)])
    plain = stroke_of(trend=np.array([0.0, 0.1, *[0.3] * KNOTS]), jumps=5 * np.ones(KNOTS), covariance=np.diag(spread))
    scale = 8.0
    spread = np.concatenate([np.full(MOTION + KNOTS, 1e-4), np.full(TREND + SHAPE, 4e-4 * scale**2)])
    other = plain._replace(
        trend=scale * plain.trend, shape=scale * plain.shape, residual=scale * plain.residual,
        noise=scale**2 * plain.noise, covariance=np.diag(spread),
    )  # fmt: skip
    one, two = learnt(plain), learnt(other)
    for name in ("lively", "wander", "doubt", "stiffness", "quiet"):
        assert getattr(two, name) == pytest.approx(getattr(one, name), rel=1e-9), name
    assert two.stroke.noise == pytest.approx(scale**2 * one.stroke.noise)
    assert two.price - one.price == pytest.approx(133 * 2 * math.log(scale))


def test_what_was_learnt_of_a_profile_fades_within_half_a_second():
    own = tracker_of(stroke_of(), known=50.0 * np.eye(SHAPE))
    own._learn_profile(stroke_of(), np.full(300, np.nan))
    np.testing.assert_allclose(own._memory.known, 50 * (1 - HOP_S / 0.5) * np.eye(SHAPE))


def test_the_offset_rises_over_the_window_by_the_second_parameter_of_the_trend():
    time = np.arange(-299, 1) / RATE
    before = np.minimum(time[:, None] + 0.0375 * np.arange(1, KNOTS + 1), 0.0)
    columns = trend_of(time, before)
    assert columns.shape == (300, TREND) and (columns[:, 0] == 1).all()
    assert columns[-1, 1] - columns[0, 1] == pytest.approx(1.0) and columns[-1, 1] == 0.0
    np.testing.assert_allclose(columns[:, 2:], before / 0.299)


@pytest.mark.parametrize(
    "sizes, told",
    [
        ((1.0, 0.5, 0.3), 0.0),
        ((0.0, 0.0, 1.0, 0.0, 0.0, 0.4), 0.0),
        ((0.15, 0.0, 1.0, 0.0, 0.0, 0.4), 1 / 3),
        ((0.0, 0.3, 1.0), 1 / 3),
        ((0.0, 1.0, 0.0, 0.7, 0.6), 1 / 2),
    ],
)
def test_what_may_be_a_harmonic_names_the_other_frequency(sizes, told):
    """Of harmonics 1, 2 ... of a period whose loudest the tracker may follow; there and back as well."""
    for turns in (np.linspace(0, 60, 1000), 30 - np.abs(np.linspace(-30, 30, 1000))):
        waves = sum(size * np.cos(2 * np.pi * n * turns + n) for n, size in enumerate(sizes, 1))
        loudest = 1 + int(np.argmax(sizes)) if sizes[0] < 1 else 1
        noise = 0.1 * np.random.default_rng(3).standard_normal(1000)
        design = SubharmonicTest(loudest * turns, 5.0 + waves + noise, 0.1)
        assert completed(design.run()) == pytest.approx(told)
        few = SubharmonicTest(design.phase[:20], design.readings[:20], 0.1)
        assert math.isnan(completed(few.run()))


@pytest.mark.parametrize("weak, told", [(0.06, 1 / 2), (0.0, 0.0)])
def test_a_wave_too_weak_for_a_line_still_names_the_lower_frequency(weak, told):
    """Odd harmonics of half the followed frequency, under noise in which a search finds no line of them."""
    turns = np.linspace(0, 60, 1000)
    waves = sum(size * np.cos(2 * np.pi * n * turns + n) for n, size in enumerate((weak, 1.0, weak, 0.0, weak), 1))
    noise = 0.3 * np.random.default_rng(3).standard_normal(1000)
    assert completed(SubharmonicTest(2 * turns, 5.0 + waves + noise, 0.1).run()) == pytest.approx(told)
