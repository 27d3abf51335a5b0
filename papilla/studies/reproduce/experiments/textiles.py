"""The textile paper, and the textiles of 2011 Oddo: bands of vibration, a search over thousands, scores, runs."""

import numpy as np

from papilla.estimators.published.texture import (
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
)
from papilla.studies.reproduce.claim import Found, Series

SIMULATED = "made-up fabrics: the papers' recordings and scores are not published"
RATE_Hz, SECONDS = 1000.0, 4.0
RECEPTORS_Hz = {"SA I": (2, 16), "RA": (2, 60), "PC": (40, 500), "SA II": (100, 500)}
"""Bands of the four kinds of mechanoreceptors, as the textile paper's introduction gives them."""
YARNS_PER_INCH = {"1": (95, 64), "2": (65, 100), "3": (175, 108), "4": (78, 59)}
"""Warp and weft of its four fabrics; its table says per 10 cm, with which the weights do not agree."""
STROKE_MM_S = 10.0
DRAWS = 40


def run_correlation(runs, longest_lag: int) -> np.ndarray:
    """Greatest correlation (n, n) of each pair of records (n, rows), over lags up to `longest_lag`."""
    records = np.asarray(runs, float)
    records = records - records.mean(axis=1, keepdims=True)
    count, length = records.shape
    found = np.eye(count)
    for i in range(count):
        for j in range(i):
            values = []
            for lag in range(-longest_lag, longest_lag + 1):
                one, other = (
                    records[i, max(lag, 0) : length + min(lag, 0)],
                    records[j, max(-lag, 0) : length - max(lag, 0)],
                )
                values.append(float(np.corrcoef(one, other)[0, 1]))
            found[i, j] = found[j, i] = max(values)
    return found


def run(tell) -> Found:
    """Bands of vibration against roughness scores, and what a search over thousands of bands proves.

    Noise whose spectrum falls is searched for its strongest band, over the printed grid and at random. What chance
    gives is the best concordance of 11,770 bands with four random scores, 40 times. Five made-up textiles have six runs
    each.
    """
    rng = np.random.default_rng(30)
    falling = _coloured(rng, 1, slope=0.5)[:, 0]
    all_bands = printed_bands()
    best = best_band(falling, RATE_Hz, all_bands)
    drawn = random_bands(2000, 3)
    at_random = best_band(falling, RATE_Hz, drawn)
    tell("what chance gives")
    null = np.array([_chance(np.random.default_rng(seed), all_bands) for seed in range(DRAWS)])
    lin = concordance([0.7, 0.8, 0.9, 1.0], _shifted(0.985))
    values = {
        **_bands(drawn, all_bands),
        **_scores(rng),
        "random_best": at_random.amplitude / best.amplitude,
        "random_words": at_random.sentence,
        "exhaustive_words": best.sentence,
        "found_118": float((best.low_Hz, best.high_Hz) == (18.0, 118.0)),
        "null_q95": float(np.quantile(null, 0.95)),
        "null_median": float(np.median(null)),
        "null_share": float(np.mean(null > 0.985)),
        "draws": DRAWS,
        "tried": len(all_bands),
        "lin_low": lin.low,
        "lin_high": lin.high,
        **_weaves(),
    }
    tell("runs on textiles")
    values |= _textiles(rng)
    edges = np.arange(501.0)
    total = np.concatenate([[0.0], np.cumsum(band_amplitudes(falling, RATE_Hz, edges))])
    low = np.arange(0, 300)
    series = tuple(Series(f"{width} Hz wide", low, total[low + width] - total[low]) for width in (20, 50, 100))
    values["drawn"] = float(len(low) * len(series))
    title = "Of a spectrum that falls, the lowest and widest band has the most: the corner of the grid"
    return Found(values, title, "lower end of the band, Hz", "amplitude of the band", series)


def _coloured(rng, records: int, slope: float) -> np.ndarray:
    """Noise (n, records) whose amplitude falls as frequency^-slope from 10 Hz on."""
    count = round(RATE_Hz * SECONDS)
    frequency = np.fft.rfftfreq(count, 1 / RATE_Hz)
    shape = np.maximum(frequency, 10.0) ** -slope
    spectrum = np.fft.rfft(rng.standard_normal((count, records)), axis=0) * shape[:, None]
    return np.fft.irfft(spectrum, count, axis=0)


def _chance(rng, bands) -> float:
    """Concordance of the best band of four random spectra with scores that have nothing to do with them."""
    count = 1000
    frequency = np.fft.rfftfreq(count, 1 / RATE_Hz)
    gains = np.exp(0.2 * rng.standard_normal((26, 4)))[(frequency // 20).astype(int)]
    phases = np.exp(2j * np.pi * rng.uniform(size=gains.shape))
    records = np.fft.irfft(gains * phases / np.maximum(frequency, 10.0)[:, None] ** 0.5, count, axis=0)
    return matching_band(records, RATE_Hz, rng.uniform(0.3, 1.0, 4), bands).agreement.coefficient


def _shifted(coefficient: float) -> np.ndarray:
    """Values that have this concordance with 0.7, 0.8, 0.9, 1.0: only their mean differs."""
    first = np.array([0.7, 0.8, 0.9, 1.0])
    noise = np.array([1.0, -1.0, -1.0, 1.0]) * first.std() * np.sqrt(2 * (1 / coefficient - 1))
    return first + noise


def _bands(drawn, all_bands) -> dict:
    time = np.arange(4000) / RATE_Hz
    sine = 0.7 * np.sin(2 * np.pi * 100 * time)
    amplitude = band_amplitudes(sine, RATE_Hz, [95, 105])[0]
    lines = {line: np.sin(2 * np.pi * line * time) for line in (8, 30, 300)}
    split = []
    for line, wave in lines.items():
        inside = [
            name for name, edges in RECEPTORS_Hz.items() if band_amplitudes(wave, RATE_Hz, edges)[0] > 0.1 / SECONDS
        ]
        split.append(f"{' and '.join(inside)} ({line} Hz)")
    known = set(all_bands)
    return {
        "receptors": float(len(RECEPTORS_Hz)) if len({text.split(" (")[0] for text in split}) == 3 else 0.0,
        "split": ", ".join(split),
        "random_inside": float(np.mean([band in known for band in drawn])),
        "grid": float(len(all_bands)),
        "integral": abs(amplitude / (0.7 / SECONDS) - 1),
    }


def _scores(rng) -> dict:
    """Simulated assessors, each with a scale of his own; concordance and outliers against their formulas."""
    truth = np.array([1.0, 2.0, 3.0, 5.0])
    told = truth * np.exp(rng.standard_normal((30, 1)))
    left = normalised_scores(told)
    values = np.append(rng.standard_normal(29), 8.0)
    one, other = rng.standard_normal((2, 12))
    by_hand = 2 * np.cov(one, other, ddof=0)[0, 1] / (one.var() + other.var() + (one.mean() - other.mean()) ** 2)
    return {
        "scales": float((left.std(axis=0) / left.mean(axis=0)).max()),
        "grubbs": float(grubbs_critical(30)),
        "rejected": "yes" if grubbs_outliers(values)[-1] else "no",
        "lin": abs(concordance(one, other).coefficient - by_hand),
    }


def _weaves() -> dict:
    """Fundamental frequencies of the four fabrics under a stroke of 10 mm/s, with either unit of the table."""
    yarns = np.array([count for pair in YARNS_PER_INCH.values() for count in pair], float)
    inch, metric = STROKE_MM_S * yarns / 25.4, STROKE_MM_S * yarns / 100
    return {
        "weaves": f"{inch.min():.0f}-{inch.max():.0f} Hz",
        "weaves_10cm": f"{metric.min():.0f}-{metric.max():.0f}",
        "weaves_inside": float(np.mean((inch >= 18) & (inch <= 118))),
    }


def _textiles(rng) -> dict:
    """Five made-up textiles, six runs each: told apart, and how runs correlate."""
    surfaces = [
        sum(np.sin(2 * np.pi * (k * base * np.arange(4000) / RATE_Hz) + rng.uniform(0, 6)) / k for k in (1, 2, 3))
        for base in (11.0, 15.0, 20.0, 27.0, 36.0)
    ]
    records, labels = [], []
    for number, surface in enumerate(surfaces):
        for _ in range(6):
            shift = int(rng.integers(0, 20))
            records.append(np.roll(surface, shift) + 0.2 * np.std(surface) * rng.standard_normal(len(surface)))
            labels.append(f"textile {number}")
    features = [log_band_features(record[:2000], RATE_Hz, 24) for record in records]
    accuracy = leave_m_out(features, labels, 15, seed=2, splits=60).accuracy
    sample = [record[:1500:2] for record in records[::3]]
    related = run_correlation(sample, 12)
    group = np.arange(len(sample)) // 2
    same = (group[:, None] == group) & ~np.eye(len(sample), dtype=bool)
    within, between = float(related[same].mean()), float(related[group[:, None] != group].mean())
    return {"told_apart": accuracy, "within": within, "between": between, "runs_apart": within - between}
