"""How a touch begins, ends and is doubted: each decision by itself, on both sides of its limit."""

import math

import numpy as np
import pytest

from papilla.calibration import SoftnessStatus
from papilla.estimators import Doubts, GaugeSoftness, Softness
from papilla.estimators.health import MISSING, STUCK, Fault
from papilla.estimators.softness.channels import SPREAD_FORCE
from papilla.estimators.softness.fitter import FilterState, NoiseFit
from papilla.estimators.softness.touch import TouchState
from papilla.estimators.stream import completed

NOISE = np.array([50.0] * 5 + [0.005])


@pytest.fixture(scope="module")
def made(five):
    """made(**options) -> an estimator of five gauges."""
    found = five(0.01)
    return lambda **options: GaugeSoftness(found, **({"gauge_sigma": 50.0, "force_sigma_N": 0.005} | options))


@pytest.fixture(scope="module")
def own(made):
    return made()


def exact(own, force, modulus):
    """The channels that a contact is expected to have."""
    fitter = own._fitter
    h = np.interp(math.log(modulus), [fitter.ln_modulus(one)[0] for one in np.linspace(0, fitter.top, 400)],
                  np.linspace(0, fitter.top, 400))  # fmt: skip
    return fitter.linear(math.log(force), 0.0, float(h)).expected / fitter.whiten, float(h)


def test_the_table_has_the_squared_misfit_of_a_sample_at_each_of_its_contacts(own):
    """r' S^-1 r, S of noise, doubts, half a table's step of h, and all of the sample's own force."""
    start, fitter = own._start, own._fitter
    y, _ = exact(own, 0.3, 0.2)
    for rows in (np.arange(6), np.array([0, 2, 5])):
        found = start.misfits(y, rows)
        forces = sorted({node[0] for node in start._nodes})
        hs = sorted({node[2] for node in start._nodes})
        assert (len(found), len(forces), len(hs)) == (63, 9, 7) and forces[0] == fitter.low and hs[-1] == fitter.top
        for number in (0, 17, 40, 62):
            linear = fitter.linear(*start._nodes[number])
            prior = np.ones(fitter.size)
            prior[0] = (hs[1] - hs[0]) ** 2
            B = linear.B[0] * (forces[1] - forces[0]) / SPREAD_FORCE
            S = (linear.H * prior) @ linear.H.T + np.outer(B, B) + np.eye(6)
            rest = (y * fitter.whiten - linear.expected)[rows]
            assert found[number] == pytest.approx(rest @ np.linalg.solve(S[np.ix_(rows, rows)], rest), rel=1e-6)


@pytest.mark.parametrize("force", [0.06, 0.3, 0.95])
@pytest.mark.parametrize("modulus", [0.03, 0.2, 3.0])
def test_a_touch_begins_at_the_contact_that_explains_its_first_sample(made, force, modulus):
    """From the force and all gauges, or from the gauges alone."""
    own = made(doubts=Doubts.NONE)
    y, h = exact(own, force, modulus)
    for rows, most in ((np.arange(6), 0.03), (np.arange(5), 0.1)):
        residuals, state = completed(own._start(y, rows, own._fitter.prior(1.0)))
        assert residuals.misfit < 1.0 and state.ln_force == pytest.approx(math.log(force), abs=0.05)
        assert state.anchor == pytest.approx(h, abs=most * own._fitter.top)
        assert state.mean[0] == state.anchor and state.place_mm == 0.0


def test_of_a_sample_that_fits_badly_the_likeliest_explanations_are_worked_out(own):
    """Misfits are those of beginning without the channels; what is not among the likeliest four is not tried."""
    y, _ = exact(own, 0.3, 0.2)
    y[1] *= -1.0
    rows, prior = np.arange(6), own._fitter.prior(1.0)
    some = [(number,) for number in range(6)]
    found = completed(own._start.misfits_without(y, rows, prior, some))
    tried = [number for number, misfit in enumerate(found) if misfit < math.inf]
    assert len(tried) == 4 and int(np.argmin(found)) == 1 and found[1] < 5.0
    for number in tried:
        again, _ = completed(own._start(y, np.delete(rows, number), prior))
        assert found[number] == pytest.approx(again.misfit, rel=0.05, abs=0.5)


@pytest.mark.parametrize("sigma", [100.0, 300.0])
def test_s_d_of_noisy_readings_is_that_without_their_noise(calibration, sigma):
    """On average of 4000 samples; left in, the noise would add 8 %."""
    own = Softness(calibration, gauge_sigma=sigma, force_sigma_N=0.005)
    own._gather = lambda y, faults: y
    rng, pattern = np.random.default_rng(0), np.array([-0.9, -0.4, 1.7, -0.6, -0.3])
    clean = 200.0 * sigma / 100 * (pattern - pattern.mean()) / pattern.std()
    told = np.array([own.feel(tuple(clean + sigma * rng.standard_normal(5)), 0.3, ()) for _ in range(4000)])
    assert told[:, 0].mean() == pytest.approx(2 * sigma, rel=0.02) and (told[:, 1] == 0.3).all()
    assert own._sd((1.0, 2.0, 3.0, 4.0, 5.0)) == pytest.approx(math.sqrt(2)), "population standard deviation"


def test_s_d_is_refused_outside_the_forces_by_more_than_their_noise(calibration):
    own = Softness(calibration, gauge_sigma=50.0, force_sigma_N=0.005)
    own._gather = lambda y, faults: "heard"
    loud = (-9e3, 0.0, 9e3, 0.0, 0.0)
    for force, told in ((0.031, "heard"), (0.029, SoftnessStatus.FORCE_BELOW), (1.019, "heard"),
                        (1.021, SoftnessStatus.FORCE_ABOVE)):  # fmt: skip
        answer = own.feel(loud, force, ())
        assert (answer if told == "heard" else answer.status) == told
    assert own.feel(loud, 0.3, (0, 0, STUCK, 0, 0)).status == SoftnessStatus.BAD_GAUGE
    assert own.feel(loud, 0.01, (0, 0, STUCK, 0, 0)).status == SoftnessStatus.NO_CONTACT
    assert own.feel(loud, math.nan, (0, 0, STUCK, 0, 0)).status == SoftnessStatus.BAD_INPUT


def test_a_light_force_ends_a_touch_where_the_readings_agree_or_it_lasts(made):
    """Readings below those of contact; or 50 samples of what zeros may have moved to, 8 standard deviations."""
    own = made(doubts=Doubts(zero_microstrain=100.0))
    least = own._lowest
    size = np.linalg.norm(least) / math.sqrt(5)
    assert own._is_away(np.full(5, 0.99 * size), least, 0.01) and not own._is_away(np.full(5, 1.01 * size), least, 0.01)
    own.reset()
    for reading, force, away in ((799.0, 0.01, True), (801.0, 0.01, False), (799.0, math.nan, False)):
        own._memory.light = 0
        found = [own._is_away(np.full(5, reading), 1e-3 * least, force) for _ in range(52)]
        assert found == [False] * 50 + [away] * 2
    fitter = own._fitter
    assert least == pytest.approx(fitter.least_reading() * 0.02 / 0.05)
    nodes = [fitter.surfaces.at(math.log(0.05), node, 0.0).reading for node in fitter.surfaces.ln_nodes.tolist()]
    assert fitter.least_reading() == pytest.approx(np.abs(nodes).min(axis=0))


def test_zeros_are_learnt_from_rests_that_agree_and_known_better_after_fifty_samples(made):
    own, rest = made(), (5.0,) * 5 + (0.02,)
    own._lose_contact(rest, False)
    assert own.state.rest.samples == 0, "not with a channel missing"
    for count in range(1, 161):
        own._lose_contact(rest, True)
        assert own.state.airborne == min(max(count // 20 - 1, 0) * 20, 100)
        known = own._unknown().covariance.diagonal()
        for name in ("the zero of the gauges", "the offset of the force"):
            assert known[own._fitter.columns[name]] == pytest.approx(0.25 if count >= 80 else 1.0)
    assert own.state.zeros == pytest.approx(rest, rel=0.01)


@pytest.mark.parametrize("step, learnt", [((3.0,) * 5 + (0.0,), True), ((60.0,) * 5 + (0.0,), False)])
def test_a_rest_is_learnt_only_when_the_next_one_agrees(made, step, learnt):
    """Twenty samples of noise 20 each, so 3 microstrain are noise and 60 the begin of a press."""
    own = made()
    for sample in [(5.0,) * 5 + (0.0,)] * 20 + [step] * 20:
        own._lose_contact(sample, True)
    assert (own.state.airborne == 20) == learnt
    assert own._in_contact(np.array([0.0] * 5 + [2 * own._low]), np.arange(5), sample, True)
    assert own.state.rest.before is None


def test_a_contact_outside_is_named(own):
    low, high = math.log(0.05), 0.0
    for ln_force, place, status in (
        (low - 0.01, 0.0, SoftnessStatus.FORCE_BELOW), (high + 0.01, 0.0, SoftnessStatus.FORCE_ABOVE),
        (low + 0.01, 0.0, None), (high - 0.01, 0.0, None), (-1.0, 0.1, SoftnessStatus.OFF_REACH),
    ):  # fmt: skip
        fit = NoiseFit(1.0, 0.0, 0.0, 0.0, 5, ln_force, place, 1, None)
        assert own._outside(fit) == status


def told(made, **known):
    own = made()
    fitter = own._fitter
    h = 0.5 * fitter.top
    mean = np.zeros(fitter.size)
    mean[0] = h
    covariance = 1e-6 * np.eye(fitter.size)
    state = FilterState(
        mean, covariance, np.zeros(1), anchor=h, information=1e4, freedom=50.0, offset=(0.1, 0.2), place_sigma_mm=0.3
    )
    known = {name: value(state) if callable(value) else value for name, value in known.items()}
    remember(own, filter=state._replace(**known))
    return *own._modulus(), fitter, h


def changed(place, by):
    def mean(state):
        new = state.mean.copy()
        new[place] += by
        return new

    return mean


def test_what_is_told_of_a_touch(made):
    """The modulus with a relative sigma of sigma_h / slope; where noise alone stands, its contact too."""
    found, offset, fitter, h = told(made)
    ln_modulus, slope = fitter.ln_modulus(h)
    assert found.modulus_MPa == pytest.approx(math.exp(ln_modulus)) and found.status == SoftnessStatus.OK
    assert found.modulus_sigma_MPa == pytest.approx(1e-3 / slope * found.modulus_MPa)
    assert offset == (0.0, 0.0) and told(made, square=1e4)[1] == (0.1, 0.2)
    for information, score, status in ((1e4, 0.51, SoftnessStatus.HARDER), (1e4, -0.51, SoftnessStatus.SOFTER)):
        found, *_ = told(made, score=score * 1e4 * fitter.top, square=(score * fitter.top) ** 2 * information)
        assert found.status == status and math.isnan(found.modulus_MPa)
    for by, status in ((7.7, SoftnessStatus.OK), (7.8, SoftnessStatus.MISFIT)):
        assert told(made, mean=changed(3, by))[0].status == status, "sixty squared standard deviations of the doubts"
    for relative, status in ((0.49, SoftnessStatus.OK), (0.51, SoftnessStatus.NOT_IDENTIFIABLE)):
        found, *_ = told(made, covariance=(relative * slope) ** 2 * np.eye(fitter.size))
        assert found.status == status and found.modulus_MPa > 0


def misfits_of(table, rest=1e9):
    """What is left when a set of channels is left out, in one piece."""

    def misfits(some):
        yield
        return [table.get(own, rest) for own in some]

    return misfits


def remember(own, **changes):
    """Set what an estimator remembers."""
    for name, value in changes.items():
        setattr(own._memory, name, value)


@pytest.mark.parametrize(
    "table, single, blamed",
    [
        ({}, False, None),
        ({(1,): 19.0}, False, (1,)),
        ({(1,): 21.0}, False, None),
        ({(1,): 5.0, (3,): 14.0}, False, (1, 3)),
        ({(1,): 5.0, (3,): 16.0}, False, (1,)),
        ({(1, 2): 5.0}, False, (1, 2)),
        ({(1, 2): 5.0}, True, None),
        ({(1,): 19.0, (2, 4): 1.0}, False, (1,)),
        ({(0, 4): 2.0}, True, (0, 4)),
        ({(0,): 4.0, (0, 4): 2.0}, True, (0,)),
        ({(0,): 15.0, (0, 4): 2.0}, True, (0, 4)),
        ({(5,): 3.0}, False, (5,)),
        ({(0,): 3.0, (2,): 4.0, (3,): 5.0}, False, (0, 2, 3)),
        ({(0,): 3.0, (2,): 4.0, (3,): 5.0, (5,): 6.0}, False, None),
    ],
)
def test_who_is_blamed(own, table, single, blamed):
    """One before two, mirrored gauges as one; who cannot be told apart together; and three channels must be left."""
    assert completed(own._to_blame(np.arange(6), misfits_of(table), single)) == blamed
    assert completed(own._to_blame(np.arange(3), misfits_of({(0,): 1.0}))) is None
    assert completed(own._to_blame(np.arange(4), misfits_of({(0,): 1.0}))) == (0,)


def test_distrust_wears_off_by_good_samples_and_lasts_longer_each_time(made):
    own = made()
    for patience in (480, 720, 1080, 1620, 1920, 1920):
        own._distrust()
        assert own.state.distrust == patience and not own._trusted()
    remember(own, distrust=300)
    assert not own._trusted(99) and own.state.distrust == 201 and own.state.patience == 1920
    assert own._trusted(1) and own.state.distrust == 200
    assert own._trusted(500) and (own.state.distrust, own.state.patience) == (0, 480)


def test_a_channel_that_fits_ten_times_in_a_row_is_used_again(made):
    own = made(doubts=Doubts.NONE)
    y, h = exact(own, 0.3, 0.2)
    remember(own, faults=(0, int(Fault.OFF_SURFACE), 0, 0, 0, 0))
    rows = np.array([0, 2, 3, 4, 5])
    _, state = completed(own._start(y, rows, own._fitter.prior(1.0)))
    fit = own._fitter.noise_fit(y, rows, state)
    _, state = own._fitter.learn(y, rows, state, fit)

    def watch(off, samples=1):
        moved = y.copy()
        moved[1] += off
        own._watch_returning(moved, rows, state, fit._replace(samples=samples))
        return own.state.returning[1], own.state.faults[1]

    assert [watch(0.0)[0] for _ in range(9)] == list(range(1, 10))
    assert watch(1e4) == (0, int(Fault.OFF_SURFACE)), "one that does not fit begins the count anew"
    assert watch(math.nan) == (0, int(Fault.OFF_SURFACE))
    assert watch(0.0, 9) == (9, int(Fault.OFF_SURFACE)) and watch(0.0) == (0, 0)


def test_a_fault_is_named_by_what_would_explain_the_reading(made):
    own = made(doubts=Doubts.NONE)
    y, _ = exact(own, 0.3, 0.2)
    _, state = completed(own._start(y, np.arange(6), own._fitter.prior(1.0)))
    off, flipped, swapped = (int(Fault[name]) for name in ("OFF_SURFACE", "SIGN_FLIPPED", "SWAPPED"))

    def named(*blamed, **changes):
        spoilt = y.copy()
        for name, value in changes.items():
            spoilt[int(name[1])] = value
        return own._named(spoilt, blamed, state)

    assert named(1, g1=-y[1]) == {1: flipped} and named(1, g1=-y[1] + 3000) == {1: off}
    assert named(1, 2, g1=y[2], g2=y[1]) == {1: swapped, 2: swapped}
    assert named(1, 2, g1=y[2], g2=-y[2]) == {1: off, 2: flipped}
    assert named(5, g5=-y[5]) == {5: off}, "a force has no sign to flip"


def test_faults_of_a_sample_are_what_stands_and_what_it_shows(made):
    own = made()
    remember(own, faults=(0, 4, 0, 0, 0, 0))
    assert own._watched((), 0.3) == (0, 4, 0, 0, 0, 0)
    assert own._watched((), math.nan) == (0, 4, 0, 0, 0, MISSING)
    assert own._watched((MISSING, MISSING, 0, 0, 0), 0.3) == (MISSING, MISSING, 0, 0, 0, 0)
    assert made(force_sigma_N=math.inf)._watched((), math.nan) == (0,) * 6
    # A gauge that has just become stuck voids what was learnt; one that stays so does not.
    for before, void in (((), True), ((0, 0, STUCK, 0, 0), False)):
        remember(own, found=before, filter="known", distrust=7, faults=(0, 4, 0, 0, 0, 0))
        own._watched((0, 0, STUCK, 0, MISSING), 0.3)
        state = own.state
        assert (state.filter is None, state.distrust == 0, not any(state.faults)) == (void,) * 3
    assert own._of((0, 0, 3, 0, 0, 0)).tolist() == [0, 1, 3, 4, 5] and own._of((0, 0, 0, 0, 1, 1)).tolist() == [
        0,
        1,
        2,
        3,
    ]
    assert made(force_sigma_N=math.inf)._of((0,) * 6).tolist() == [0, 1, 2, 3, 4]


def test_a_force_that_all_sensors_place_outside_is_said_to_be_there(made):
    own, blind = made(), made(force_sigma_N=math.inf)
    low, high = own._fitter.low, own._fitter.high
    for ln_force, force, status in (
        (low, 0.049, SoftnessStatus.FORCE_BELOW), (low, 0.051, None), (low + 0.1, 0.01, None),
        (high, 1.01, SoftnessStatus.FORCE_ABOVE), (high, 0.99, None), (high - 0.1, 2.0, None),
    ):  # fmt: skip
        state = FilterState(np.zeros(1), np.eye(1), np.zeros(1), ln_force=ln_force)
        assert own._beyond(np.array([0.0] * 5 + [force]), state) == status
    assert (
        blind._beyond(np.full(6, math.nan), FilterState(np.zeros(1), np.eye(1), np.zeros(1), ln_force=low))
        == SoftnessStatus.FORCE_BELOW
    )
    assert (
        blind._beyond(np.full(6, math.nan), FilterState(np.zeros(1), np.eye(1), np.zeros(1), ln_force=high))
        == SoftnessStatus.FORCE_ABOVE
    )


def test_a_state_is_of_this_many_gauges(own):
    with pytest.raises(ValueError, match="the state is of 3 gauges, the calibration has 5"):
        own.state = TouchState(None, (0.0,) * 4)
    assert own.state.filter is None
