"""The fit of softness against its definition written out: slopes as differences, elimination and filter as matrices."""

import math

import numpy as np
import pytest

from papilla.estimators import Doubts
from papilla.estimators.softness.channels import SPREAD_FORCE, ZERO_WALK, GaugeSurfaces, distance_curve
from papilla.estimators.softness.fitter import CELL_ERROR_SHARE, FilterState, Fitter, Residuals
from papilla.estimators.stream import completed

NOISE = np.array([50.0] * 5 + [0.005])
DOUBTS = Doubts(gauge_gain=0.03, creep=0.02, zero_microstrain=150.0, force_gain=0.04, force_offset_N=0.006,
                beside_mm=2.0, thickness_mm=6.0, thickness_error=0.1)  # fmt: skip
FORCE, MODULUS = 0.37, 0.21


@pytest.fixture(scope="module")
def own(five):
    return Fitter(GaugeSurfaces(five(0.01), False), 50.0, 0.005, DOUBTS, None)


def shaped_of(fitter):
    """The doubts whose effect changes with force by a shape that is not known exactly."""
    return slice(fitter.columns["the gain of the gauges"].start, fitter.columns["the calibration beside the apex"].stop)


def changed(state, **changes):
    """A belief in which some of what is known is another."""
    return FilterState(**dict(zip(FilterState.__annotations__, state, strict=True)) | changes)


def h_of(fitter, modulus):
    """The scale h of a modulus in MPa."""
    low, high = 0.0, fitter.top
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if fitter.ln_modulus(middle)[0] < math.log(modulus) else (low, middle)
    return low


def near(fitter, force=FORCE, modulus=MODULUS, thickness=0.0):
    return fitter.linear(math.log(force), 0.0, h_of(fitter, modulus), thickness)


def belief_of(fitter, linear, seed=0):
    """Some belief, of correlated doubts, that was learnt near a linearisation."""
    root = np.random.default_rng(seed).standard_normal((fitter.size, fitter.size)) * 0.1
    mean = 0.2 * np.random.default_rng(seed + 1).standard_normal(fitter.size)
    mean[0] = linear.at[2]
    covariance = root @ root.T + 0.3 * np.eye(fitter.size)
    return FilterState(
        mean, covariance, np.zeros(30), linear, linear, ln_force=linear.at[0], anchor=linear.at[2] - 0.1, samples=40.0
    )


def sample_of(linear, seed=0):
    """A sample near a linearisation, as sensors read it."""
    return (linear.expected + np.random.default_rng(seed).standard_normal(6)) * NOISE


def test_what_is_expected_is_the_calibrations_reading_of_a_block_of_this_thickness(own, five):
    """ln E is higher by 10.2 f^0.72 (h^-1.5 - h0^-1.5) for a block h mm thick, calibrated for 10."""
    shift, sigma = DOUBTS.thickness_shift(10.0)
    for steps in (0.0, 1.5):
        found = near(own, thickness=steps)
        apparent = MODULUS * math.exp((shift + sigma * steps) * FORCE**0.72)
        readings = five(0.01).predict_readings(FORCE, apparent)
        assert found.expected * NOISE == pytest.approx([*readings, FORCE], rel=1e-5)


def test_slopes_are_differences(own):
    found, step = near(own), 1e-5
    at, place, h, _ = found.at
    for column, (up, down) in {
        0: (own.linear(at, place, h + step), own.linear(at, place, h - step)),
        1: (own.linear(at, place, h, step), own.linear(at, place, h, -step)),
    }.items():
        np.testing.assert_allclose((up.expected - down.expected) / (2 * step), found.H[:, column], rtol=1e-4, atol=1e-4)
    up, down = own.linear(at + step, place, h), own.linear(at - step, place, h)
    np.testing.assert_allclose(SPREAD_FORCE * (up.expected - down.expected) / (2 * step), found.B[0], rtol=1e-3)
    np.testing.assert_array_equal(found.B[1], 0.0)


def test_every_doubt_moves_the_channels_by_its_standard_deviation(own, five):
    """Each column of H is what one standard deviation adds, over the noise."""
    found = near(own)
    readings, parts = found.expected[:5] * NOISE[:5], own.columns
    moved = {name: found.H[:, columns] * NOISE[:, None] for name, columns in parts.items()}
    np.testing.assert_allclose(moved["the zero of the gauges"][:5], 150.0 * np.eye(5), rtol=1e-12)
    np.testing.assert_allclose(moved["the gain of the gauges"][:5], np.diag(0.03 * readings), rtol=1e-12)
    np.testing.assert_allclose(moved["creep"][:5, 0], 0.02 * readings, rtol=1e-12)
    np.testing.assert_allclose(moved["the place across the row of gauges (y)"][:5, 0], -0.068 * readings, rtol=1e-12)
    for name, force in (("the gain of the force", 0.04 * FORCE), ("the offset of the force", 0.006)):
        np.testing.assert_allclose(moved[name][:, 0], [0, 0, 0, 0, 0, force], rtol=1e-12, atol=1e-15)
    # The thickness' effect grows with force by another power of it, of which 0.4 of its logarithm is not known.
    away = 2 * (math.log(FORCE) - 0.5 * (math.log(0.05) + math.log(1.0)))
    thickness = moved["the thickness of the specimen"]
    np.testing.assert_allclose(thickness[:, 1], 0.4 * away * thickness[:, 0], rtol=1e-9, atol=1e-12)
    # Errors of the calibration: of gauges that mirror each other the same, of others independent, a parabola in force.
    error = moved["the calibration"][:5]
    stated = [gauge.uncertainty.sigma_at(FORCE) * FORCE for gauge in five(0.01).gauges]
    z = away / math.log(1.0 / 0.05)
    np.testing.assert_allclose(error[[0, 4]].sum(axis=0), 2 * error[0])
    assert error[0] @ error[1] == error[1] @ error[2] == 0.0
    for row, sigma in zip(error, stated, strict=True):
        size = sigma * np.array([1.0, 0.5 * z, 0.75 * z * z - 0.25])
        assert row[row != 0] == pytest.approx(size, rel=0.02)


def test_noise_alone_is_least_squares_with_the_samples_own_force_eliminated(own):
    """Information a' S^-1 a and so on, S the covariance of a mean of n: noise, and a force of its own."""
    linear = near(own)
    state = belief_of(own, linear)
    h = own.h_of_noise(state)
    for count, rows in ((1, np.arange(6)), (7, np.arange(6)), (7, np.array([0, 2, 3, 5]))):
        y = sample_of(linear, count)
        found = own.noise_fit(y, rows, state, count)
        at, a, B = found.linear, found.linear.H[rows, 0], found.linear.B[:, rows]
        S = np.eye(len(rows)) / count + B.T @ B
        left = (y / NOISE)[rows] - at.expected[rows] - a * (h - at.at[2])
        away, solved = h - state.anchor, np.linalg.solve(S, np.column_stack([a, left]))
        at_anchor = left + a * away
        assert found.information == pytest.approx(a @ solved[:, 0], rel=1e-9)
        assert found.score == pytest.approx(at_anchor @ solved[:, 0], rel=1e-9)
        assert found.here == pytest.approx(left @ solved[:, 1], rel=1e-9)
        assert found.square == pytest.approx(at_anchor @ np.linalg.solve(S, at_anchor), rel=1e-9)
        step = (B @ solved[:, 1])[0]
        assert found.ln_force == pytest.approx(at.at[0] + SPREAD_FORCE * step, abs=1e-12)
        assert (found.own, found.samples, found.place_mm) == (len(rows) - 1, count, 0.0)


@pytest.mark.parametrize("keep", [1.0, 0.99])
def test_learning_is_kalmans_correction(own, keep):
    """With S = H P H' + B' B + 1 / n and the cell's own errors; zeros and creep fade; of noise alone a share stays."""
    linear = near(own)
    state = changed(belief_of(own, linear), information=50.0, score=5.0, square=30.0, freedom=70.0)
    rows, count, y = np.arange(6), 8, sample_of(linear, 3)
    fit = own.noise_fit(y, rows, state, count)
    residuals, learnt = own.learn(y, rows, state, fit, keep)
    H, B = state.node.H, fit.linear.B
    away = state.mean - [fit.linear.at[2], fit.linear.at[3], *[0.0] * (own.size - 2)]
    innovation = y / NOISE - fit.linear.expected - fit.linear.H @ away
    S = H @ state.covariance @ H.T + B.T @ B + np.eye(6) / count
    S += np.diag((CELL_ERROR_SHARE**2 * H[:, shaped_of(own)] ** 2).sum(axis=1))
    np.testing.assert_allclose(residuals.precision, np.linalg.inv(S), rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(residuals.weighted, np.linalg.solve(S, innovation), rtol=1e-6, atol=1e-8)
    assert residuals.misfit == pytest.approx(innovation @ np.linalg.solve(S, innovation), rel=1e-6)
    gain = state.covariance @ H.T @ np.linalg.inv(S)
    zero = own.columns["the zero of the gauges"]
    faded = np.ones(own.size)
    faded[zero], faded[own.columns["creep"]] = math.exp(-ZERO_WALK * count / 2), 0.99 ** (count / 2)
    expected = np.outer(faded, faded) * (state.covariance - gain @ H @ state.covariance) + np.diag(1 - faded**2)
    expected[0] /= keep ** (count / 4)
    expected[:, 0] /= keep ** (count / 4)
    np.testing.assert_allclose(learnt.covariance, expected, rtol=1e-5, atol=1e-7)
    np.testing.assert_allclose(learnt.mean, faded * (state.mean + gain @ innovation), rtol=1e-5, atol=1e-7)
    for name, added in (
        ("information", fit.information), ("score", fit.score), ("square", fit.square), ("freedom", fit.own),
        ("samples", count),
    ):  # fmt: skip
        assert getattr(learnt, name) == pytest.approx(keep**count * getattr(state, name) + added, rel=1e-12)
    assert (learnt.anchor, learnt.ln_force, learnt.place_mm) == (state.anchor, fit.ln_force, fit.place_mm)


def test_the_estimate_of_noise_alone_stands_while_it_explains_the_readings(own):
    """Then h is its best, score over information from the anchor; else the filter's. Sigma is the filter's."""
    h = 0.5 * own.top
    state = changed(
        belief_of(own, own.linear(math.log(FORCE), 0.0, h)),
        anchor=h - 0.2,
        information=400.0,
        score=100.0,
        freedom=1001.0,
        offset=(0.1, 0.2),
    )
    for misfit, noise_explains in ((1000.0, True), (1200.0, True), (1320.0, False)):
        known = changed(state, square=misfit + 25.0)
        assert own.noise_explains(known) == noise_explains
        best, sigma, offset = own.estimate(known)
        assert best == pytest.approx(h - 0.2 + 0.25 if noise_explains else state.mean[0])
        assert sigma == pytest.approx(math.sqrt(state.covariance[0, 0]))
        assert offset == ((0.0, 0.0) if noise_explains else state.offset)
        assert own.h_of_noise(known) == pytest.approx(h + 0.05)
    assert not own.noise_explains(changed(state, information=0.0))
    assert own.h_of_noise(changed(state, information=0.0)) == pytest.approx(h - 0.2)
    assert own.h_of_noise(changed(state, score=1e9)) == own.top and own.h_of_noise(changed(state, score=-1e9)) == 0.0


def test_the_doubt_that_dominates_is_the_one_that_would_take_most_off_sigma(own):
    """In a belief where h depends on creep, on the gauges' gains, or on nothing but noise."""
    size, h = own.size, near(own).at[2]
    for name in ("creep", "the gain of the gauges", "the offset of the force"):
        covariance = np.eye(size)
        columns = own.columns[name]
        covariance[0, columns] = covariance[columns, 0] = 0.6 / math.sqrt(columns.stop - columns.start)
        covariance[0, own.columns["the zero of the gauges"]] = covariance[own.columns["the zero of the gauges"], 0] = (
            0.1
        )
        state = FilterState(np.zeros(size), covariance, np.zeros(1), anchor=h, information=4.0)
        assert own.dominant(state) == name
        assert own.dominant(changed(state, information=2.0)) == "noise"
    assert own.dominant(changed(state, information=0.0)) == "noise"


def test_what_others_expect_of_a_channel_is_the_conditional_mean(own):
    """Of channels with a known covariance: left out, the misfit is that of the others; expected, the regression."""
    rng = np.random.default_rng(2)
    root = rng.standard_normal((5, 5))
    S, innovation, rows = root @ root.T + np.eye(5), rng.standard_normal(5), np.array([0, 1, 3, 4, 5])
    precision = np.linalg.inv(S)
    residuals = Residuals(precision @ innovation, precision, rows, float(innovation @ precision @ innovation))
    for gone, kept in (((3,), [0, 1, 3, 4]), ((0, 5), [1, 2, 3])):
        at = [int(np.searchsorted(rows, one)) for one in gone]
        others = np.ix_(kept, kept)
        left = innovation[list(others[1].ravel())]
        assert completed(residuals.misfits_without([gone]))[0] == pytest.approx(left @ np.linalg.solve(S[others], left))
        across = S[np.ix_(at, others[1].ravel())]
        mean = across @ np.linalg.solve(S[others], left)
        rest, variance = residuals.expected(*gone)
        assert rest == pytest.approx(innovation[at] - mean)
        conditional = S[np.ix_(at, at)] - across @ np.linalg.solve(S[others], across.T)
        assert variance == pytest.approx(np.diag(conditional))


def test_a_distance_curve_has_its_slopes_where_they_let_it_rise():
    """Between nodes it is their mean; a slope below a thousandth of the steepest counts as that."""
    slopes = np.array([2.0, 1.5, 1.0, 0.8, 0.0])
    curve = distance_curve(slopes, -3.0, 4.0)
    assert curve.values == pytest.approx(np.cumsum([0, 3.5 / 8, 2.5 / 8, 1.8 / 8, 0.802 / 8]))
    for node, slope in zip(-3.0 + np.arange(5) / 4.0, [*slopes[:4], 0.002], strict=True):
        at, found = curve.solve(curve.values[round(4 * (node + 3))], 0, 4)
        assert (at, found) == pytest.approx((node, slope), abs=1e-4)
    steep = distance_curve(np.array([9.0, 1.0, 0.01]), 0.0, 1.0)
    inner = [steep.solve(value, 0, 2)[1] for value in np.linspace(0, steep.values[-1], 50)]
    assert min(inner) > 0
