"""Bands, concordance, outliers, scores, nearest neighbours: against tables, definitions and known signals."""

import numpy as np
import pytest
from scipy.signal import detrend
from scipy.stats import norm

from papilla.core.errors import InputError
from papilla_papers.methods.texture import (
    Band,
    band_amplitudes,
    best_band,
    concordance,
    grubbs_critical,
    grubbs_outliers,
    leave_m_out,
    log_band_features,
    matching_band,
    normalised_scores,
    printed_bands,
    random_bands,
)  # fmt: skip

RATE = 2000.0
LARGE = [494, 395, 516, 434, 476, 557, 413, 442, 650, 433, 417, 656, 267, 478, 178, 423, 427]
MINI = [512, 430, 520, 428, 500, 600, 364, 380, 658, 445, 432, 626, 260, 477, 259, 350, 451]


def shaped(exponent: float, seed: int, count=8000) -> np.ndarray:
    """Noise whose amplitude spectrum is exactly (1 + f / 60)^-exponent, with random phases."""
    frequency = np.fft.rfftfreq(count, 1 / RATE)
    phase = np.random.default_rng(seed).uniform(0, 2 * np.pi, frequency.size)
    return np.fft.irfft((1 + frequency / 60) ** -exponent * np.exp(1j * phase), count)


def test_a_sinusoid_is_counted_in_its_band_with_its_amplitude():
    time = np.arange(4000) / RATE
    found = band_amplitudes(5 + 3 * np.sin(2 * np.pi * 40 * time), RATE, [1, 30, 50, 200])
    np.testing.assert_allclose(found, [0, 3 * 0.5, 0], atol=1e-9)
    two = band_amplitudes(np.column_stack([np.sin(80 * np.pi * time), np.cos(20 * np.pi * time)]), RATE, [5, 20, 60])
    np.testing.assert_allclose(two, [[0, 0.5], [0.5, 0]], atol=1e-9)
    split = band_amplitudes(shaped(0.5, 0), RATE, [10, 33.3, 90])
    assert split.sum() == pytest.approx(band_amplitudes(shaped(0.5, 0), RATE, [10, 90])[0])


def test_the_grid_is_that_of_table_2():
    """Steps of 1, 5 and 10 Hz, three bands of each: the widest cut ends at 500 Hz, every edge is on the grid."""
    bands = np.array(printed_bands())
    number, low, high = bands.T
    ends = [[edge(high[number == n]) for n in range(1, 10)] for edge in (min, max)]
    assert ends == [[1, 2, 3, 8, 13, 18, 28, 38, 48], [10, 30, 50, 100, 150, 200, 300, 400, 500]]
    widths = [sorted(set((high - low)[number == n])) for n in (3, 6, 7, 8, 9)]
    assert widths == [list(range(1, 21)), list(range(5, 51, 5)), *[list(range(10, 101, 10))] * 3]
    drawn = random_bands(200, 1)
    assert drawn == random_bands(200, 1) != random_bands(200, 2)
    assert set(drawn) <= {tuple(band) for band in bands.tolist()} and len({band[0] for band in drawn}) == 9


@pytest.mark.parametrize("exponent", [0.25, 0.5, 1.0, 1.5])
def test_18_to_118_hz_is_a_corner_of_the_grid_and_not_of_the_fabric(exponent):
    bands = printed_bands()
    for seed in range(3):
        found = best_band(shaped(exponent, seed), RATE, bands)
        assert (found.low_Hz, found.high_Hz, found.corner) == (18, 118, True)
        assert "corner of the search grid" in found.sentence
    narrow = best_band(np.sin(2 * np.pi * 200 * np.arange(8000) / RATE) + 1e-4 * shaped(0.0, 1), RATE, bands)
    assert narrow.low_Hz < 200 < narrow.high_Hz and not narrow.corner and "corner" not in narrow.sentence


@pytest.mark.parametrize(
    "refused, message",
    [
        (lambda: best_band(shaped(1, 0), 999.0, printed_bands()), "a rate of 999 Hz cannot show"),
        (lambda: band_amplitudes(shaped(1, 0), RATE, [1, 10, 1200]), "rise from 0 or more to at most 1000 Hz"),
        (lambda: band_amplitudes([np.nan] * 10, RATE, [1, 2]), "finite"),
        (lambda: best_band(shaped(1, 0), RATE, []), "no band"),
        (lambda: random_bands(0, 1), "draws must be at least 1"),
        (lambda: matching_band(np.ones((9, 4)), RATE, [1, 2, 3], printed_bands()), "one for each record of samples"),
        (lambda: concordance([1, 2, 3], [1, 2, 3]), "4 or more"),
        (lambda: concordance([1, 1, 1, 1], [1, 2, 3, 4]), "does not change"),
        (lambda: concordance([1, 2, 3, np.nan], [1, 2, 3, 4]), "finite"),
        (lambda: grubbs_outliers([1.0, 2.0]), "three or more"),
        (lambda: normalised_scores([[1.0, -1.0]]), "positive"),
        (lambda: log_band_features(np.ones((128, 1)), 35.6, 4), "does not change"),
        (lambda: leave_m_out(*gratings(0.01, 0), 4, seed=0), "left_out = 4 of 24 runs does not leave an equal"),
        (lambda: leave_m_out(*gratings(0.01, 0), 21, seed=0, neighbours=3), "3 neighbours need as many"),
        (lambda: leave_m_out(np.ones((24, 2)), np.zeros(24), 3, seed=0), "at least two different labels"),
        (lambda: leave_m_out(np.ones((23, 2)), np.arange(24) % 3, 3, seed=0), "must be finite and fit 24 labels"),
    ],
)
def test_what_cannot_be_computed_is_refused(refused, message):
    with pytest.raises(InputError, match=message):
        refused()


def test_concordance_of_a_published_comparison():
    """Peak flow by two meters (Bland and Altman 1986, 17 subjects): 0.943."""
    found = concordance(LARGE, MINI)
    assert found.coefficient == pytest.approx(0.943, abs=5e-4)
    x, y = np.array(LARGE, float), np.array(MINI, float)
    apart = np.mean((x[:, None] - y[None, :]) ** 2)
    assert found.coefficient == pytest.approx(1 - np.mean((x - y) ** 2) / apart), "the definition by squared distance"
    assert found.low < found.coefficient < found.high < 1
    assert found.coefficient == pytest.approx(found.correlation * found.bias)
    assert concordance(3 * x + 7, 3 * y + 7).low == pytest.approx(found.low)
    same = concordance(x, x)
    assert same.coefficient == pytest.approx(1.0) and same.low == same.coefficient == same.high
    shifted = concordance(x, y + 100)
    assert shifted.correlation == pytest.approx(found.correlation) and shifted.coefficient < 0.7


@pytest.mark.parametrize("level, shift", [(0.95, 0.0), (0.8, 120.0), (0.5, -300.0), (0.9999, 40.0)])
def test_the_interval_is_that_of_the_published_variance(level, shift):
    """Lin 1989 as corrected in 2000, written with the squares of r below the line."""
    x, y = np.array(LARGE, float), np.array(MINI, float) + shift
    answer, r = concordance(x, y, level), np.corrcoef(x, y)[0, 1]
    u, c = (x.mean() - y.mean()) / np.sqrt(x.std() * y.std()), answer.coefficient
    terms = (1 - r**2) * c**2 / r**2 / (1 - c**2), 2 * c**3 * (1 - c) * u**2 / r / (1 - c**2) ** 2
    sd = np.sqrt((sum(terms) - c**4 * u**4 / (2 * r**2) / (1 - c**2) ** 2) / (len(x) - 2))
    half = norm.ppf(0.5 + level / 2) * sd
    assert (answer.low, answer.high) == pytest.approx(tuple(np.tanh(np.arctanh(c) + np.array([-half, half]))))
    assert (answer.correlation, answer.count) == (pytest.approx(r), 17)
    assert concordance(x, -x).coefficient == pytest.approx(concordance(-x, x).coefficient)
    assert concordance(x[:4], y[:4]).count == 4


def test_the_best_bands_are_those_of_all_bands_tried_one_by_one():
    rng, bands = np.random.default_rng(3), printed_bands()[::97] + random_bands(1, 8)
    records, scores = rng.standard_normal((2000, 4)), rng.uniform(0.3, 1.0, 4)
    cut = np.array(random_bands(1, 8))
    assert cut[:, 0].tolist() == [*range(1, 10)] and cut[0, 1] == 0 and (cut[1:, 1] == cut[:-1, 2]).all()
    every = np.array([band_amplitudes(records, RATE, [low, high])[0] for _, low, high in bands])
    agreed = [concordance(amplitude / amplitude.max(), scores / scores.max()).coefficient for amplitude in every]
    answer, loudest = matching_band(records, RATE, scores, bands), best_band(records, RATE, bands)
    assert (answer.number, answer.low_Hz, answer.high_Hz) == bands[np.argmax(agreed)]
    assert answer.agreement.coefficient == pytest.approx(max(agreed))
    assert answer.amplitude == pytest.approx(every[np.argmax(agreed)].mean())
    assert (loudest.number, loudest.low_Hz, loudest.high_Hz) == bands[every.mean(axis=1).argmax()]
    assert loudest.amplitude == pytest.approx(every.mean(axis=1).max())
    assert best_band(records[:, 0], 1000.0, bands).amplitude > 0 and Band(0.0, 10.0, 1, 1.0).corner
    for low, high, number, corner in ((3.0, 53.0, 4, True), (3.0, 48.0, 4, False), (4.0, 54.0, 4, False)):
        assert (
            Band(low, high, number, 1.0).corner == corner
            and f"{low:g}-{high:g} Hz" in Band(low, high, number, 1).sentence
        )


def test_features_are_amplitudes_between_edges_even_in_log_frequency():
    window = np.random.default_rng(1).normal(size=200).cumsum()
    edges = np.geomspace(2 * 50.0 / 200, 0.95 * 25.0, 7)
    np.testing.assert_allclose(
        log_band_features(window, 50.0, 6), np.log(band_amplitudes(detrend(window), 50.0, edges)), rtol=1e-9
    )
    few = np.random.default_rng(1).normal(size=8)
    assert band_amplitudes(few, 8.0, [0, 4]).size == 1 and normalised_scores([[2.0]]) == pytest.approx(2.0)
    amplitude = 2 / 8 * np.abs(np.fft.rfft(few - few.mean()))
    np.testing.assert_allclose(band_amplitudes(few, 8.0, [1.5, 2.5]), amplitude[2])
    of_runs = gratings(0.01, 0)
    for function, *arguments in (
        (band_amplitudes, few[:7], 8.0, [0, 4]), (band_amplitudes, few, 8.0, [-1, 4]), (band_amplitudes, few, 8.0, [1]),
        (band_amplitudes, few, 8.0, [1, 1]), (grubbs_critical, 2), (grubbs_outliers, [[1.0, 2.0, 3.0]] * 3),
        (concordance, few, few, 0.4999), (concordance, few, few, 0.99995), (best_band, few, 999.9, [(1, 0, 1)]),
        (normalised_scores, np.zeros((0, 3))),
    ):  # fmt: skip
        with pytest.raises(InputError):
            function(*arguments)
    for left_out in (24, 0):
        with pytest.raises(InputError):
            leave_m_out(*of_runs, left_out, seed=0)
    assert grubbs_outliers([1.0, 1.0, 1.0, 1.0, 9.0, 9.0]).tolist() == [False] * 6


@pytest.mark.parametrize(
    "count, one_sided, two_sided",
    [(3, 1.153, 1.155), (4, 1.463, 1.481), (5, 1.672, 1.715), (10, 2.176, 2.290), (20, 2.557, 2.709)],
)
def test_critical_values_are_those_of_the_tables(count, one_sided, two_sided):
    assert grubbs_critical(count, 0.05) == pytest.approx(two_sided, abs=1.1e-3)
    assert grubbs_critical(count, 0.10) == pytest.approx(one_sided, abs=1.1e-3)


def test_outliers_are_rejected_one_by_one_and_seldom_without_cause():
    # The worked example of the NIST handbook: uranium isotope, 245.57 is an outlier.
    uranium = [199.31, 199.53, 200.19, 200.82, 201.92, 201.95, 202.18, 245.57]
    for values, kept in ((uranium, 7), ([10, 11, 12, 11, 10, 11, 12, 10, 11, 40, 500], 9)):
        assert grubbs_outliers(values).tolist() == [place >= kept for place in range(len(values))]
    generator = np.random.default_rng(0)
    rate = np.mean([grubbs_outliers(generator.normal(size=12)).any() for _ in range(600)])
    assert rate == pytest.approx(0.05, abs=0.025)
    assert not grubbs_outliers([2.0, 2.0, 2.0]).any()


def test_scores_lose_the_scale_of_the_assessor_only():
    truth = np.array([1.0, 2.0, 4.0, 3.0])
    found = normalised_scores(np.outer([1.0, 10.0, 0.3], truth))
    np.testing.assert_allclose(found / found[:, :1], np.tile(truth, (3, 1)))
    np.testing.assert_allclose(found, found[:1].repeat(3, axis=0))
    generator = np.random.default_rng(0)
    window = generator.normal(size=(128, 3))
    one = log_band_features(window, 35.6, 4)
    other = log_band_features(window + 100 + np.linspace(0, 9, 128)[:, None], 35.6, 4)
    assert one.shape == (12,)
    np.testing.assert_allclose(one, other, atol=1e-9)
    np.testing.assert_allclose(log_band_features(2 * window, 35.6, 4) - one, np.log(2))
    np.testing.assert_allclose(one.reshape(3, 4), [log_band_features(own, 35.6, 4) for own in window.T])


def gratings(spread: float, seed: int):
    """f_MP of two channel pairs of 24 runs over three gratings, the speed repeating within `spread`."""
    generator = np.random.default_rng(seed)
    labels = np.repeat([400, 440, 480], 8)
    frequency = 26_000 / labels * (1 + spread * generator.normal(size=24))
    return frequency[:, None] * (1 + 0.002 * generator.normal(size=(24, 2))), labels


@pytest.mark.parametrize("left_out, neighbours", [(15, 1), (9, 3)])
def test_accuracy_is_that_of_nearest_neighbours_written_out(left_out, neighbours):
    """Second implementation: distances by hand, the same random splits drawn once more; the majority of neighbours, of
    equal votes the lowest label."""
    features, labels = gratings(0.04, 5)
    found = leave_m_out(features, labels, left_out, seed=9, splits=40, neighbours=neighbours)
    generator, right = np.random.default_rng(9), []
    for _ in range(40):
        places = [np.flatnonzero(labels == label) for label in (400, 440, 480)]
        training = np.concatenate([generator.choice(place, 8 - left_out // 3, replace=False) for place in places])
        test = np.setdiff1d(np.arange(24), training)
        distance = np.linalg.norm(features[test][:, None] - features[training][None], axis=2)
        nearest = labels[training][np.argsort(distance, axis=1, kind="stable")[:, :neighbours]]
        named = [max((400, 440, 480), key=votes.tolist().count) for votes in nearest]
        right.append(np.mean(named == labels[test]))
    assert found.accuracy == pytest.approx(np.mean(right)) and found.accuracy < 1
    assert (found.low, found.high) == (min(right), max(right))


def test_random_search_finds_no_more_than_the_exhaustive_one_and_some_of_its_bands():
    drawn, every, signal = random_bands(300, seed=4), printed_bands(), shaped(0.5, 0)
    assert set(drawn) <= set(every) and drawn == random_bands(300, seed=4) != random_bands(300, seed=5)
    assert best_band(signal, RATE, drawn).amplitude <= best_band(signal, RATE, every).amplitude
