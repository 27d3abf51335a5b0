"""Discriminates fabrics, and estimates their roughness from vibration: bands, concordance, outliers, neighbours.

The textile paper cuts 0-500 Hz into ten bands whose edges grow by random steps (its equation (1) is the amplitude in a
band), and finds 18-118 Hz. **That is a corner of its search grid, not a finding**: 18 Hz is the smallest sixth edge
that the steps allow (1 + 1 + 1 + 5 + 5 + 5), 118 Hz the largest seventh edge from there (+ 100). A band of the greatest
width at the lowest start collects the most amplitude of any spectrum that falls slowly with frequency, whatever was
touched; `Band.corner` says so of each answer.
"""

from dataclasses import dataclass

import numpy as np

from papilla.core import checks
from papilla.core.errors import InputError
from papilla.estimators.spectral_bands import integral

STEPS_HZ = (range(1, 11), *2 * (range(1, 21),), *3 * (range(5, 51, 5),), *3 * (range(10, 101, 10),))
"""Widths in Hz that bands 1 to 9 may have; table 2 of the paper searches these nine, the tenth band is the
remainder."""
HIGHEST_HZ = 500.0


@dataclass(frozen=True)
class Concordance:
    """coefficient : Lin's concordance; low, high : its interval of the stated level; correlation : Pearson's.

    bias : coefficient / correlation, 1 without a difference of mean or scale; count : pairs.
    """

    coefficient: float
    low: float
    high: float
    correlation: float
    bias: float
    count: int


def concordance(first, second, level: float = 0.95) -> Concordance:
    """Concordance of pairs (n,) and (n,), n >= 4: 2 s12 / (s1^2 + s2^2 + (m1 - m2)^2), moments with divisor n.

    Interval by Fisher's transformation (Lin 1989, Biometrics 45:255, doi 10.2307/2532051, with the variance as
    corrected in Biometrics 56:324, 2000). It is asymptotic and holds for many pairs: of the four fabrics of the textile
    paper its formula gives, at best, an interval of 0.78 to 1.00 for 0.985; for fewer than ten pairs the true interval
    is wider. Raises `InputError` for unequal or short columns, values that are not finite, and columns that do not
    change.
    """
    from scipy.stats import norm

    level = checks.within("level", level, 0.5, 0.9999)
    x, y = np.asarray(first, float), np.asarray(second, float)
    if x.ndim != 1 or x.shape != y.shape or x.size < 4:
        raise InputError(f"concordance needs two equal columns of 4 or more values, got {x.shape} and {y.shape}")
    if not (np.isfinite(x).all() and np.isfinite(y).all()):
        raise InputError("concordance needs finite values")
    dx, dy = x - x.mean(), y - y.mean()
    sx, sy = float(np.sqrt(dx @ dx / x.size)), float(np.sqrt(dy @ dy / x.size))
    if not (sx > 0 and sy > 0):
        raise InputError("concordance of a column that does not change is not defined")
    r = float(np.clip(dx @ dy / (x.size * sx * sy), -1, 1))
    shift = float(x.mean() - y.mean())
    bias = 2 * sx * sy / (sx**2 + sy**2 + shift**2)
    c = r * bias
    if 1 - abs(c) < 1e-12:
        return Concordance(c, c, c, r, bias, x.size)
    # The variance of arctanh(c), in a form that also holds at r = 0, where c / r is the bias.
    u2 = shift**2 / (sx * sy)
    room = 1 - c**2
    variance = (
        (1 - r**2) * bias**2 / room + 2 * c**2 * bias * (1 - c) * u2 / room**2 - 0.5 * (c * bias * u2 / room) ** 2
    )
    half = float(norm.ppf(0.5 + 0.5 * level)) * np.sqrt(max(variance, 0.0) / (x.size - 2))
    z = np.arctanh(c)
    return Concordance(c, float(np.tanh(z - half)), float(np.tanh(z + half)), r, bias, x.size)


@dataclass(frozen=True)
class Band:
    """low_Hz, high_Hz; number : of the band in its cut of the axis, from 1; amplitude : mean over the signals.

    corner : the start is the lowest and the width the greatest that the grid has for this number, so a wider or lower
    band might have been better: the grid decided, not the signal. `sentence` states this.
    """

    low_Hz: float
    high_Hz: float
    number: int
    amplitude: float

    @property
    def corner(self) -> bool:
        """Whether the band is the lowest and widest that the grid has for its number."""
        first = sum(steps[0] for steps in STEPS_HZ[: self.number - 1])
        return self.low_Hz == first and self.high_Hz - self.low_Hz == STEPS_HZ[self.number - 1][-1]

    @property
    def sentence(self) -> str:
        """The band in words, and whether it is a corner of the grid."""
        text = f"{self.low_Hz:g}-{self.high_Hz:g} Hz (band {self.number})"
        if self.corner:
            return f"{text}: a corner of the search grid, its lowest start and greatest width"
        return text


@dataclass(frozen=True)
class BandMatch(Band):
    """A band, and the agreement of its amplitude with the scores, both over their greatest. The interval of `agreement`
    does not account for the search: the best of many bands agrees with anything (see `matching_band`)."""

    agreement: Concordance


def band_amplitudes(samples, sample_rate_Hz: float, edges_Hz) -> np.ndarray:
    """Integral of the amplitude spectrum over bands (b,) between rising edges (b + 1,) in Hz, equation (1).

    samples (n,) or (n, channels), which gives (b, channels); in units of the samples times Hz. The mean is removed; the
    spectrum is one-sided, a sinusoid of amplitude 1 has a line of height 1 and width 1 / duration.
    Raises `InputError` for samples that are not finite and for edges that do not rise from 0 or more to at most half
    the sampling rate.
    """
    rate = checks.positive("sample_rate_Hz", sample_rate_Hz)
    values, edges = np.asarray(samples, float), np.asarray(edges_Hz, float)
    if values.ndim not in (1, 2) or len(values) < 8 or not np.isfinite(values).all():
        raise InputError(f"band amplitudes need 8 or more finite samples, got {values.shape}")
    if edges.ndim != 1 or edges.size < 2 or not (np.diff(edges) > 0).all() or edges[0] < 0 or edges[-1] > rate / 2:
        raise InputError(f"edges_Hz must rise from 0 or more to at most {rate / 2:g} Hz, half the sampling rate")
    amplitude = 2 / len(values) * np.abs(np.fft.rfft(values - values.mean(axis=0), axis=0))
    width = rate / len(values)
    return width * integral(amplitude, edges / width)


def log_band_features(window, sample_rate_Hz: float, bands: int) -> np.ndarray:
    """(bands x channels,) logarithm of the amplitude in bands evenly spaced in log frequency, channel by channel.

    The bands go from two periods a window to 0.95 of half the sampling rate. A straight line is removed first.
    Raises `InputError` for samples that are not finite or a channel that does not change.
    """
    from scipy.signal import detrend

    rate = checks.positive("sample_rate_Hz", sample_rate_Hz)
    rows = np.atleast_2d(np.asarray(window, float).T).T
    if not np.isfinite(rows).all():
        raise InputError("features need finite samples")
    if not np.ptp(rows, axis=0).all():
        raise InputError("a channel does not change in this window: its amplitude has no logarithm")
    edges = np.geomspace(2 * rate / len(rows), 0.475 * rate, bands + 1)
    return np.log(band_amplitudes(detrend(rows, axis=0), rate, edges)).T.ravel()


def printed_bands() -> list[tuple[int, int, int]]:
    """Every (number, low_Hz, high_Hz) that the grid of the paper can have: the exhaustive search."""
    starts, bands = {0}, []
    for number, steps in enumerate(STEPS_HZ, start=1):
        pairs = {(start, start + step) for start in starts for step in steps}
        bands += [(number, *pair) for pair in sorted(pairs)]
        starts = {high for _, high in pairs}
    return bands


def random_bands(draws: int, seed: int) -> list[tuple[int, int, int]]:
    """The bands (number, low_Hz, high_Hz) of `draws` random cuts of the axis: the random search of the paper."""
    if draws < 1:
        raise InputError(f"draws must be at least 1, got {draws}")
    generator = np.random.default_rng(seed)
    highs = np.cumsum([generator.choice(steps, draws) for steps in STEPS_HZ], axis=0)
    lows = np.vstack([np.zeros((1, draws), int), highs[:-1]])
    numbers = np.broadcast_to(1 + np.arange(len(STEPS_HZ))[:, None], highs.shape)
    return sorted(set(zip(*(column.ravel().tolist() for column in (numbers, lows, highs)), strict=True)))


def best_band(samples, sample_rate_Hz: float, bands: list[tuple[int, int, int]]) -> Band:
    """The band with the greatest amplitude, averaged over the signals of samples (n,) or (n, signals).

    Raises `InputError` if there is no band, or for a sampling rate below 1000 Hz, which cannot show 0-500 Hz.
    """
    amplitude = _amplitudes(samples, sample_rate_Hz, bands).mean(axis=1)
    best = int(amplitude.argmax())
    number, low, high = bands[best]
    return Band(float(low), float(high), number, float(amplitude[best]))


def matching_band(samples, sample_rate_Hz: float, scores, bands: list[tuple[int, int, int]]) -> BandMatch:
    """The band whose amplitude over fabrics has the greatest concordance with scores (fabrics,) > 0.

    samples (n, fabrics), one record a fabric; bands as `printed_bands` (exhaustive) or `random_bands` gives them.
    Amplitudes and scores are divided by their greatest; the textile paper normalises, but does not say how.

    What a match proves: with the four fabrics of the paper, spectra that differ at random by 20 % a band of 20 Hz and
    scores drawn without any relation to them, the best of the 11,770 bands of the exhaustive search still reached a
    concordance of 0.78 (median of 200 draws) and more than 0.9 in 23 % of them.
    Raises `InputError` for scores that do not fit, or are not positive, and as `best_band` does.
    """
    records, wanted = np.asarray(samples, float), np.asarray(scores, float)
    fitting = records.ndim == 2 and wanted.shape == (records.shape[1],)
    if not (fitting and np.isfinite(wanted).all() and (wanted > 0).all()):
        raise InputError(f"scores must be positive, one for each record of samples {records.shape}, got {wanted.shape}")
    amplitudes = _amplitudes(records, sample_rate_Hz, bands)
    amplitude = amplitudes / amplitudes.max(axis=1, keepdims=True)
    wanted = wanted / wanted.max()
    # Lin's 2 s12 / (s1^2 + s2^2 + (m1 - m2)^2), of which the denominator is 2 s12 plus the mean square of x - y.
    twice = 2 * (amplitude - amplitude.mean(axis=1, keepdims=True)) @ (wanted - wanted.mean())
    best = int(np.argmax(twice / (twice + np.square(amplitude - wanted).sum(axis=1))))
    number, low, high = bands[best]
    agreement = concordance(amplitude[best], wanted)
    return BandMatch(float(low), float(high), number, float(amplitudes[best].mean()), agreement)


def _amplitudes(samples, sample_rate_Hz: float, bands: list[tuple[int, int, int]]) -> np.ndarray:
    """(b, signals) amplitude of each signal in each of the bands."""
    if sample_rate_Hz < 2 * HIGHEST_HZ:
        raise InputError(f"the bands go up to {HIGHEST_HZ:g} Hz, which a rate of {sample_rate_Hz:g} Hz cannot show")
    if not bands:
        raise InputError("there is no band to search")
    lines = band_amplitudes(np.atleast_2d(np.asarray(samples, float).T).T, sample_rate_Hz, np.arange(HIGHEST_HZ + 1))
    total = np.concatenate([np.zeros((1, lines.shape[1])), np.cumsum(lines, axis=0)])
    edges = np.array(bands)
    return total[edges[:, 2]] - total[edges[:, 1]]


@dataclass(frozen=True)
class Accuracy:
    """accuracy : fraction of the tests that were right; low, high : the worst and the best split."""

    accuracy: float
    low: float
    high: float


def leave_m_out(features, labels, left_out: int, *, seed: int, splits: int = 1000, neighbours: int = 1) -> Accuracy:
    """Accuracy over random splits with `left_out` of the runs as test and the same number of each label in training.

    features (n, d), labels (n,). As printed (2011 Oddo): 24 runs of three gratings, M = 3, 6, ... 21, 10,000 splits,
    features f_MP of two channel pairs, not scaled. The number of neighbours is not stated; more than one is not
    possible in the worst case of one training run per label.

    It measures how well runs repeat, including their speed: f_MP = v / period, so a spread of 1, 2, 3, 5 % of the speed
    between runs caps three gratings 10 % apart, one training run each, at about 100, 94, 82, 66 %. Raises `InputError`
    for shapes that do not fit or splits that cannot be even.
    """
    from scipy.spatial.distance import cdist

    table = np.asarray(features, float)
    names, codes = np.unique(np.asarray(labels), return_inverse=True)
    if table.ndim != 2 or len(table) != len(codes) or not np.isfinite(table).all():
        raise InputError(f"features (n, d) must be finite and fit {len(codes)} labels, got {table.shape}")
    if len(names) < 2:
        raise InputError("there must be at least two different labels")
    counts = np.bincount(codes)
    per_label, rest = divmod(len(codes) - left_out, len(names))
    if rest or per_label < 1 or per_label >= counts.min():
        raise InputError(
            f"left_out = {left_out} of {len(codes)} runs does not leave an equal training set of each of "
            f"{len(names)} labels and something to test"
        )
    if per_label < neighbours:
        raise InputError(f"{neighbours} neighbours need as many training runs of each label, got {per_label}")
    generator = np.random.default_rng(seed)
    places = [np.flatnonzero(codes == code) for code in range(len(names))]
    distance, votes, right = cdist(table, table), np.eye(len(names))[codes], []
    for _ in range(splits):
        training = np.concatenate([generator.choice(runs, per_label, replace=False) for runs in places])
        test = np.setdiff1d(np.arange(len(codes)), training)
        order = distance[np.ix_(test, training)].argsort(axis=1, kind="stable")[:, :neighbours]
        nearest = votes[training[order]].sum(axis=1).argmax(axis=1)
        right.append(float(np.mean(nearest == codes[test])))
    return Accuracy(float(np.mean(right)), min(right), max(right))


def grubbs_critical(count: int, level: float = 0.05) -> float:
    """Largest deviation over standard deviation (ddof 1) of `count` normal values, exceeded with this chance.

    Two-sided: (n - 1) / sqrt(n) sqrt(t^2 / (n - 2 + t^2)), t the quantile of Student's t with n - 2 degrees of freedom
    exceeded with level / (2 n) (Grubbs 1969, Technometrics 11:1, doi 10.1080/00401706.1969.10490657).
    Raises `InputError` for fewer than three values.
    """
    from scipy.stats import t as student

    if count < 3:
        raise InputError(f"Grubbs' test needs three values or more, got {count}")
    t2 = float(student.isf(checks.within("level", level, 1e-9, 0.5) / (2 * count), count - 2)) ** 2
    return (count - 1) / np.sqrt(count) * np.sqrt(t2 / (count - 2 + t2))


def grubbs_outliers(values, level: float = 0.05) -> np.ndarray:
    """(n,) bool: values that Grubbs' test rejects, one at a time, the largest deviation first.

    Testing stops at the first value that stays, and with three values left. Raises `InputError` for fewer than three
    values or values that are not finite.
    """
    samples = np.asarray(values, float)
    if samples.ndim != 1 or samples.size < 3 or not np.isfinite(samples).all():
        raise InputError(f"Grubbs' test needs one column of three or more finite values, got {samples.shape}")
    outlier = np.zeros(samples.size, bool)
    while (~outlier).sum() > 3 or not outlier.any():
        inliers = samples[~outlier]
        deviation = np.where(outlier, 0.0, np.abs(samples - inliers.mean()))
        if not deviation.max() > grubbs_critical(inliers.size, level) * inliers.std(ddof=1):
            break
        outlier[int(deviation.argmax())] = True
    return outlier


def normalised_scores(scores) -> np.ndarray:
    """Magnitude estimates (assessors, items) > 0 without each assessor's own scale.

    Each row is divided by its geometric mean and multiplied by that of all, as usual for magnitude estimates; the
    textile paper normalises, but does not say how. Raises `InputError` for what is not a table of positive numbers.
    """
    table = np.asarray(scores, float)
    if table.ndim != 2 or table.size == 0 or not (np.isfinite(table).all() and (table > 0).all()):
        raise InputError("scores must be a table (assessors, items) of positive finite numbers")
    logs = np.log(table)
    return np.exp(logs - logs.mean(axis=1, keepdims=True) + logs.mean())
