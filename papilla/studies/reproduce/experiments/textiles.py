"""The textile paper, and the textiles of 2011 Oddo: bands of vibration, a search over thousands, scores, runs."""

from dataclasses import dataclass

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
from papilla.studies.reproduce.claim import Found, Series, gathered
from papilla.studies.reproduce.signals import SEEDS, SNR_DB

SIMULATED = "made-up fabrics with the yarn counts of the paper: its recordings and scores are not published"
SCENE = (
    "the fabrics (five times the speed, white noise), the scores (shuffled), the choice of the band by amplitude (by"
    " concordance), the names (shuffled), the common approach",
    f"falling spectrum; {SNR_DB['2011_oddo']:g} dB white for runs",
    len(SEEDS),
)
RATE_Hz, SECONDS = 1000.0, 4.0
RECEPTORS_Hz = {"SA I": (2, 16), "RA": (2, 60), "PC": (40, 500), "SA II": (100, 500)}
"""Bands of the four kinds of mechanoreceptors, as the textile paper's introduction gives them."""
YARNS_PER_INCH = {"1": (95, 64), "2": (65, 100), "3": (175, 108), "4": (78, 59)}
"""Warp and weft yarns of the four fabrics per inch. The printed table says per 10 cm, but these counts agree with the
printed weights only per inch."""
STROKE_MM_S = 10.0
CHANCES, SEARCHES = 400, 20
"""Number of random draws: for the choice by amplitude, and for searches by concordance over all bands."""
HARMONICS = (1, 2, 3)
"""Harmonics k of a weave, whose amplitudes fall as 1 / k."""
BETWEEN = 0.84
"""Correlation between textiles, the middle of the printed 0.78 to 0.90; it determines the power of the common
approach."""
STARTS_APART = 0.05
"""Standard deviation of the start of a stereotyped run, in periods of the weave."""


@dataclass(frozen=True)
class Fibres:
    """Noise of a fabric's fibres, which is not printed: its rms relative to that of the weave, and the exponent with
    which its amplitude falls with the frequency from 10 Hz on."""

    fibres_share: float = 0.5
    fibres_slope: float = 0.5


ASSUMED = Fibres()


def run(tell, cause: bool = True) -> Found:
    """Bands of vibration against roughness scores, and what a search over all bands proves.

    Four made-up fabrics have the printed numbers of yarns an inch, slide at 10 mm/s, and have noise whose spectrum
    falls. All 11,770 bands are searched for the greatest amplitude, and for the amplitude that follows scores. What
    chance gives is the concordance of four random scores with four unrelated spectra in the band of their greatest
    amplitude. Five made-up textiles have six runs each, with an approach that all share.
    """
    all_bands, drawn = printed_bands(), random_bands(2000, 3)
    tell("bands of four fabrics")
    values = gathered(
        lambda: _bands(drawn, all_bands),
        lambda: _fabrics(ASSUMED, cause),
        lambda: _scores(np.random.default_rng(30)),
        lambda: _searches(all_bands, cause),
        _weaves,
    )
    tell("runs on textiles")
    values |= gathered(lambda: _textiles(np.random.default_rng(31), cause))
    falling = fabric("1", np.random.default_rng(30))
    edges = np.arange(501.0)
    total = np.concatenate([[0.0], np.cumsum(band_amplitudes(falling, RATE_Hz, edges))])
    low = np.arange(0, 300)
    series = tuple(Series(f"{width} Hz wide", low, total[low + width] - total[low]) for width in (20, 50, 100))
    title = "Of a fabric's vibration the lowest and widest band has the most: the corner of the grid"
    return Found(values, title, "lower end of the band, Hz", "amplitude of the band", series)


def fabric(name: str, rng, speed_mm_s: float = STROKE_MM_S, fibres: Fibres = ASSUMED) -> np.ndarray:
    """Vibration (n,) of one of the four fabrics: its warp and weft with harmonics, and noise that falls."""
    time, weave = np.arange(round(RATE_Hz * SECONDS)) / RATE_Hz, 0.0
    for yarns in YARNS_PER_INCH[name]:
        for k in HARMONICS:
            weave = weave + np.sin(2 * np.pi * k * speed_mm_s * yarns / 25.4 * time + rng.uniform(0, 2 * np.pi)) / k
    noise = _coloured(rng, 1, slope=fibres.fibres_slope)[:, 0]
    return weave + fibres.fibres_share * np.std(weave) / noise.std() * noise


def _fabrics(assumed: Fibres, cause: bool = True) -> dict:
    """Frequencies with the amplitude of the four fabrics, and the band of the grid with most of it."""
    shares, corners, rng, all_bands = [], [], np.random.default_rng(32), printed_bands()
    speed = STROKE_MM_S if cause else 5 * STROKE_MM_S
    for seed in SEEDS:
        own = np.random.default_rng(seed)
        records = [fabric(name, own, speed, assumed) for name in YARNS_PER_INCH]
        if not cause:
            records[0] = rng.standard_normal(len(records[0]))
        both = np.array([band_amplitudes(record, RATE_Hz, (0, 100, 500)) for record in records])
        shares.append(both[:, 0] / both.sum(axis=1))
        best = best_band(np.column_stack(records), RATE_Hz, all_bands)
        corners.append((best.low_Hz, best.high_Hz) == (18.0, 118.0))
    return {
        "main": float(np.mean(shares, axis=0).min()),
        "mains": ", ".join(f"{share:.0%}" for share in np.mean(shares, axis=0)),
        "found_118": float(np.mean(corners)),
        "best_words": best.sentence,
    }


def _searches(all_bands, cause: bool) -> dict:
    """The band whose amplitude follows the scores, among all bands; and the concordance by chance in the band of
    largest amplitude."""
    found, lin = [], concordance([0.7, 0.8, 0.9, 1.0], _shifted(0.985))
    for seed in range(SEARCHES):
        rng = np.random.default_rng(seed)
        scores, (low, high) = np.sort(rng.uniform(0.3, 1.0, 4)), (100 * rng.integers(0, 4), 20 * rng.integers(2, 5))
        records = _unrelated(rng, planted=(low, low + high), gains=scores)
        match = matching_band(records, RATE_Hz, scores if cause else scores[[2, 0, 3, 1]], all_bands)
        found.append(low - 2 <= match.low_Hz and match.high_Hz <= low + high + 2)
    null = np.array(
        [_chance(np.random.default_rng(seed), all_bands, cause) for seed in range(CHANCES if cause else 40)]
    )
    return {
        "planted": float(np.mean(found)),
        "null_q95": float(np.quantile(null, 0.95)),
        "null_median": float(np.median(null)),
        "null_share": float(np.mean(null > 0.985)),
        "draws": len(null),
        "tried": len(all_bands),
        "lin_low": lin.low,
        "lin_high": lin.high,
    }


def _coloured(rng, records: int, slope: float) -> np.ndarray:
    """Noise (n, records) whose amplitude falls as frequency^-slope from 10 Hz on."""
    count = round(RATE_Hz * SECONDS)
    frequency = np.fft.rfftfreq(count, 1 / RATE_Hz)
    shape = np.maximum(frequency, 10.0) ** -slope
    spectrum = np.fft.rfft(rng.standard_normal((count, records)), axis=0) * shape[:, None]
    return np.fft.irfft(spectrum, count, axis=0)


def _unrelated(rng, planted=(0, 0), gains=1.0) -> np.ndarray:
    """Records (1000, 4) whose spectra fall and differ randomly by 20 % every 20 Hz; in a planted band by `gains`."""
    count = 1000
    frequency = np.fft.rfftfreq(count, 1 / RATE_Hz)
    shapes = np.exp(0.2 * rng.standard_normal((26, 4)))[(frequency // 20).astype(int)]
    inside = (frequency >= planted[0]) & (frequency < planted[1])
    shapes[inside] = gains
    phases = np.exp(2j * np.pi * rng.uniform(size=shapes.shape))
    return np.fft.irfft(shapes * phases / np.maximum(frequency, 10.0)[:, None] ** 0.5, count, axis=0)


def _chance(rng, bands, by_amplitude: bool) -> float:
    """Concordance of four random scores with four unrelated spectra, in the band of largest amplitude (as in the paper)
    or in the one that agrees best."""
    records, scores = _unrelated(rng), rng.uniform(0.3, 1.0, 4)
    if not by_amplitude:
        return matching_band(records, RATE_Hz, scores, bands).agreement.coefficient
    best = best_band(records, RATE_Hz, bands)
    amplitude = band_amplitudes(records, RATE_Hz, (best.low_Hz, best.high_Hz))[0]
    return concordance(amplitude / amplitude.max(), scores / scores.max()).coefficient


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
    """Simulated assessors, each with a different scale; concordance and outliers compared with their formulas."""
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


def _textiles(rng, cause: bool) -> dict:
    """Five made-up textiles, six runs each: the accuracy of classification, and the correlation of raw runs with and
    without a common approach."""
    time, records, labels, alone = np.arange(4000) / RATE_Hz, [], [], []
    approach = np.sin(np.pi * np.clip(time / time[-1], 0, 1)) ** 2 * cause
    noise = 10 ** (-SNR_DB["2011_oddo"] / 20)
    for number, base in enumerate((11.0, 15.0, 20.0, 27.0, 36.0)):
        turns = rng.uniform(0, 2 * np.pi, len(HARMONICS))
        for _ in range(6):
            place = 2 * np.pi * (base * time + STARTS_APART * rng.standard_normal())
            surface = sum(np.sin(k * place + turn) / k for k, turn in zip(HARMONICS, turns, strict=True))
            surface = surface / surface.std() + noise * rng.standard_normal(len(time))
            alone.append(surface)
            # Powers add, so the approach's share of the power is the correlation between textiles
            records.append(np.sqrt(BETWEEN) * approach / max(approach.std(), 1e-9) + np.sqrt(1 - BETWEEN) * surface)
            labels.append(f"textile {number}")
    features = [log_band_features(record[1000:3000], RATE_Hz, 24) for record in records]
    named = labels if cause else np.random.default_rng(6).permutation(labels).tolist()
    accuracy = leave_m_out(features, named, 15, seed=2, splits=60).accuracy
    related, group = np.corrcoef(records), np.arange(len(records)) // 6
    same = (group[:, None] == group) & ~np.eye(len(records), dtype=bool)
    return {
        "told_apart": accuracy,
        "within": float(related[same].mean()),
        "within_alone": float(np.corrcoef(alone)[same].mean()),
        "between": float(related[group[:, None] != group].mean()),
    }


VARIED = {"main": _fabrics, "found_118": _fabrics}
