"""Phases of a line along the path, their regression, and its newest periods, against closed forms."""

import numpy as np
import pytest

from papilla.estimators.stream import completed
from papilla.estimators.wavelength.refine import MOST_BLOCKS, Phases, phases_of, regressed, share_kept

WAVENUMBER, NOISE, COUNT = 0.8, 0.1, 1200


def waves(sizes, seed=0, shift=0.0, place=None):
    """place (m,), and readings (m, g) of harmonics of these amplitudes (h, g)."""
    place = np.linspace(0, 60, COUNT, endpoint=False) if place is None else place
    orders = np.arange(1, len(sizes) + 1)
    turns = np.outer(WAVENUMBER * place + shift, orders)
    readings = np.cos(2 * np.pi * turns + orders) @ np.atleast_2d(sizes)
    return place, readings + NOISE * np.random.default_rng(seed).standard_normal(readings.shape)


def phases(place, readings, noise, seen=None, count=1.0, stroke=None, off=0.0):
    return completed(phases_of(
        (WAVENUMBER + off) * place, place[:, None], np.full(len(place), 0.05), np.full(len(place), count), readings,
        np.ones_like(readings, bool) if seen is None else seen,
        np.zeros(len(place), int) if stroke is None else stroke, noise,
    ))  # fmt: skip


def test_information_is_that_of_all_harmonics_and_gauges_together():
    """2 pi^2 n^2 A^2 N / sigma^2 a squared cycle, for each harmonic n and gauge; of a harmonic in noise, none."""
    sizes = np.array([[1.0, 0.5], [0.3, 0.4], [1e-3, 0.0]])
    place, readings = waves(sizes)
    found = phases(place, readings, np.full((3, 2), NOISE**2))
    orders = np.array([1, 2, 3])[:, None]
    expected = 2 * np.pi**2 * COUNT / NOISE**2 * (orders**2 * sizes**2)[:2].sum()
    assert found.information.sum() == pytest.approx(expected, rel=0.02)
    assert len(found.information) == MOST_BLOCKS and (found.information > 0).all()
    assert np.abs(found.amplitude) == pytest.approx(sizes[:1], abs=0.02)
    assert np.angle(found.amplitude[0]) == pytest.approx([1.0, 1.0], abs=0.02)
    assert found.regressors[:, 0] == pytest.approx(2.5 * np.arange(MOST_BLOCKS) + 1.225)
    assert found.cycles == pytest.approx(0.0, abs=0.01) and found.coherence > 0.99
    # A row that stands for four samples has a quarter of their noise.
    assert phases(place, readings, np.full((3, 2), NOISE**2), count=4.0).information.sum() == pytest.approx(
        4 * found.information.sum(), rel=1e-3
    )
    no_second = phases(place, readings, np.array([[NOISE**2] * 2, [np.inf] * 2, [np.inf] * 2]))
    assert no_second.information.sum() == pytest.approx(2 * np.pi**2 * COUNT / NOISE**2 * 1.25, rel=0.02)


def test_what_is_no_whole_period_at_the_end_of_a_stroke_does_not_count():
    """Blocks of whole periods from each stroke's begin; 3.5 periods are three, 3.95 all but four."""
    for periods, blocks in ((3.5, 3), (3.95, 4), (4.02, 4)):
        place = np.arange(0, periods / WAVENUMBER, 0.02)
        found = phases(*waves([[1.0]], place=place), np.array([[NOISE**2]]))
        assert (found.information > 0).sum() == blocks
    place = np.concatenate([np.linspace(0, 10, 400), np.linspace(10, 0, 400)])
    found = phases(*waves([[1.0]], place=place), np.array([[NOISE**2]]), stroke=np.repeat([0, 1], 400))
    assert np.bincount(found.stroke[found.information > 0]).tolist() == [8, 8] and found.amplitude.shape == (2, 1)
    long = np.linspace(0, 60 / WAVENUMBER, 4000)
    found = phases(*waves([[1.0]], place=long), np.array([[NOISE**2]]))
    assert (found.information > 0).sum() == 20, "24 at most, each of three periods then"


def blocks(cycles, sigma=0.01, strokes=1, seen=1.0):
    """Phases of blocks a millimetre apart, each known to sigma."""
    count = len(cycles)
    place = np.arange(count) - 0.5 * (count - 1)
    stroke = np.arange(count) * strokes // count
    return Phases(cycles, np.full(count, seen * sigma**-2), place[:, None], stroke, np.ones((strokes, 1)), 1.0)


def test_a_regression_is_least_squares_with_a_mean_for_each_stroke():
    """step = 3, whatever the strokes' own phases; its variance sigma^2 / sum of squares about the strokes' means."""
    for strokes in (1, 3):
        own = blocks(np.zeros(24), strokes=strokes)
        x, stroke = own.regressors[:, 0], own.stroke
        found = completed(regressed(blocks(0.003 * x + 5.0 * stroke, strokes=strokes), np.array([1e-9]), np.zeros(1)))
        centred = x - np.array([x[stroke == one].mean() for one in range(strokes)])[stroke]
        assert found.step[0] == pytest.approx(0.003, rel=1e-6) and found.scatter == 0.0
        assert found.covariance[0, 0] == pytest.approx(1e-4 / (centred @ centred), rel=1e-6)
    # What is known beforehand draws: as sure as the phases are, half of the way.
    sure = 1 / (1e-4 / (centred @ centred))
    known = completed(regressed(blocks(0.003 * x, strokes=3), np.array([sure]), np.array([0.001])))
    assert known.step[0] == pytest.approx(0.002, rel=1e-5) and known.covariance[0, 0] == pytest.approx(0.5 / sure)


@pytest.mark.parametrize("times", [1.0, 3.0, 6.0])
def test_blocks_that_scatter_by_more_than_noise_are_known_less(times):
    """Birge's ratio: the covariance grows with the square; scatter is what is left beside the noise."""
    ratios, scatters, sigmas = [], [], []
    for seed in range(40):
        own = blocks(0.01 * times * np.random.default_rng(seed).standard_normal(24))
        found = completed(regressed(own, np.array([1e-9]), np.zeros(1)))
        x = own.regressors[:, 0]
        ratios.append(found.step[0] / found.covariance[0, 0] ** 0.5)
        sigmas.append(found.covariance[0, 0] * (x @ x) / 1e-4)
        scatters.append(found.scatter)
    assert np.sqrt(np.mean(np.square(ratios))) == pytest.approx(1.0, abs=0.35)
    assert np.mean(sigmas) == pytest.approx(max(times**2, 1.0), rel=0.3)
    assert np.median(scatters) == pytest.approx(0.01 * np.sqrt(times**2 - 1), abs=0.006 * times)


def test_blocks_far_from_the_others_hardly_count():
    cycles = 0.01 * np.random.default_rng(1).standard_normal(24)
    clean = completed(regressed(blocks(cycles), np.array([1e-9]), np.zeros(1)))
    odd = cycles.copy()
    odd[-1] = 0.4
    spoilt = completed(regressed(blocks(odd), np.array([1e-9]), np.zeros(1)))
    x = blocks(cycles).regressors[:, 0]
    plain = 0.4 * x[-1] / (x @ x)
    assert abs(spoilt.step[0] - clean.step[0]) < 0.03 * plain


def kept(readings, place, wanted=(1.0,), noise=(0.01,), periods=3, seen=None):
    seen = np.ones_like(readings, bool) if seen is None else seen
    return share_kept(place, readings, seen, WAVENUMBER, np.array(wanted, complex), noise, periods)


def test_the_share_of_an_amplitude_is_known_to_what_the_rest_leaves():
    """sigma = sqrt(2 / N) s / A over N samples of rest s; by all gauges, each by its own noise."""
    place = np.arange(0, 8 / WAVENUMBER, 0.01)
    rng, told = np.random.default_rng(3), []
    clean = np.cos(2 * np.pi * WAVENUMBER * place)[:, None] * (2.0, 0.5) + (7.0, -3.0)
    for _ in range(60):
        share, sigma = kept(clean * 0.7 + 0.3 * rng.standard_normal(clean.shape), place, (2.0, 0.5), (0.09, 0.09))
        told.append((share, sigma))
    shares, sigmas = np.array(told).T
    count = 3 / WAVENUMBER / 0.01
    expected = np.sqrt(2 / count) * 0.3 / np.sqrt(4.25)
    assert shares.mean() == pytest.approx(0.7, abs=0.01) and sigmas.mean() == pytest.approx(expected, rel=0.05)
    assert shares.std() == pytest.approx(expected, rel=0.35)
    # A noisy gauge that lost it says less than a sure one that has it.
    mixed = np.column_stack([clean[:, 0], np.full(len(place), 1.0)])
    share, _ = kept(mixed, place, (2.0, 2.0), (0.01, 0.09))
    assert share == pytest.approx(0.9, abs=0.01)
    # The wave turned by half a period is the opposite one.
    assert kept(-clean[:, :1], place, (2.0,))[0] == pytest.approx(-1.0, abs=0.01)
    quarter = 2 * np.sin(2 * np.pi * WAVENUMBER * place)[:, None]
    assert kept(quarter, place, (2.0,))[0] == pytest.approx(0.0, abs=0.01)


def test_a_share_needs_a_period_more_than_it_is_of_and_a_gauge_that_is_seen():
    step = 0.01
    for periods, told in ((3.9, False), (4.1, True)):
        place = np.arange(0, periods / WAVENUMBER, step)
        assert (kept(np.cos(2 * np.pi * WAVENUMBER * place)[:, None], place) is not None) == told
    wave = np.cos(2 * np.pi * WAVENUMBER * place)[:, None]
    newest = place > place[-1] - 3 / WAVENUMBER
    for share, told in ((0.55, True), (0.45, False)):
        seen = (place > place[-1] - share * 3 / WAVENUMBER)[:, None] | ~newest[:, None]
        assert (kept(np.where(seen, wave, 0.0), place, seen=seen) is not None) == told
    assert kept(wave[::-1], place[::-1])[0] == pytest.approx(1.0, abs=0.02), "whichever way it went"
