"""The textile paper, and the textiles of 2011 Oddo: bands of vibration, a search over thousands, scores, runs."""

from dataclasses import dataclass

import numpy as np

from papilla.core.units import INCH_MM
from papilla_papers.claims.claim import Experiment, gathered
from papilla_papers.claims.scenes import scene
from papilla_papers.claims.signals import SCENE_SEEDS, SHARED_SIGNALS, listed, share_of_noise, times
from papilla_papers.methods import texture

TEXTILE_SCENE = scene("textiles")
RATE_Hz: float = TEXTILE_SCENE.rate_Hz
YARNS_PER_INCH: dict[str, tuple[int, int]] = TEXTILE_SCENE.yarns_per_inch
"""Warp and weft yarns of the four fabrics per inch. The printed table says per 10 cm, but these counts agree with the
printed weights only per inch."""


@dataclass(frozen=True)
class Fibres:
    """Noise of a fabric's fibres, which is not printed: its rms relative to that of the weave, and the exponent with
    which its amplitude falls with the frequency from 10 Hz on."""

    fibres_share: float
    fibres_slope: float


ASSUMED_FIBRES = Fibres(**TEXTILE_SCENE.assumed)


def run(tell, cause: bool = True) -> dict:
    """Bands of vibration against roughness scores, and what a search over all bands proves.

    Four made-up fabrics have the printed numbers of yarns an inch, slide at 10 mm/s, and have noise whose spectrum
    falls. All 11,770 bands are searched for the greatest amplitude, and for the amplitude that follows scores. What
    chance gives is the concordance of four random scores with four unrelated spectra in the band of their greatest
    amplitude. Five made-up textiles have six runs each, with an approach that all share.
    """
    all_bands = texture.printed_bands()
    drawn = texture.random_bands(TEXTILE_SCENE.drawn.count, TEXTILE_SCENE.drawn.seed)
    tell("bands of four fabrics")
    values = gathered(
        lambda: _bands(drawn, all_bands),
        lambda: _fabrics(ASSUMED_FIBRES, cause),
        lambda: _scores(np.random.default_rng(TEXTILE_SCENE.assessors.seed)),
        lambda: _searches(all_bands, cause),
        _weaves,
    )
    tell("runs on textiles")
    return values | gathered(lambda: _textiles(np.random.default_rng(TEXTILE_SCENE.runs.seed), cause))


def fabric(
    name: str, rng, speed_mm_s: float = TEXTILE_SCENE.stroke_mm_s, fibres: Fibres = ASSUMED_FIBRES
) -> np.ndarray:
    """Vibration (n,) of one of the four fabrics: its warp and weft with harmonics, and noise that falls."""
    time, weave = times(TEXTILE_SCENE.seconds, RATE_Hz), 0.0
    for yarns in YARNS_PER_INCH[name]:
        for k in TEXTILE_SCENE.harmonics:
            weave = weave + np.sin(2 * np.pi * k * speed_mm_s * yarns / INCH_MM * time + rng.uniform(0, 2 * np.pi)) / k
    noise = _coloured(rng, 1, slope=fibres.fibres_slope)[:, 0]
    return weave + fibres.fibres_share * np.std(weave) / noise.std() * noise


def _fabrics(assumed: Fibres, cause: bool = True) -> dict:
    """Frequencies with the amplitude of the four fabrics, and the band of the grid with most of it."""
    shares, corners, rng, all_bands = [], [], np.random.default_rng(TEXTILE_SCENE.fabrics.seed), texture.printed_bands()
    speed = TEXTILE_SCENE.stroke_mm_s * (1 if cause else TEXTILE_SCENE.fabrics.times_as_fast)
    for seed in SCENE_SEEDS:
        generator = np.random.default_rng(seed)
        records = [fabric(name, generator, speed, assumed) for name in YARNS_PER_INCH]
        if not cause:
            records[0] = rng.standard_normal(len(records[0]))
        edges = TEXTILE_SCENE.fabrics.edges_Hz
        both = np.array([texture.band_amplitudes(record, RATE_Hz, edges) for record in records])
        shares.append(both[:, 0] / both.sum(axis=1))
        best = texture.best_band(np.column_stack(records), RATE_Hz, all_bands)
        corners.append((best.low_Hz, best.high_Hz) == TEXTILE_SCENE.best_band_Hz)
    return {
        "main": float(np.mean(shares, axis=0).min()),
        "mains": listed(np.mean(shares, axis=0), ".0%"),
        "found_118": float(np.mean(corners)),
        "best_words": best.sentence,
    }


def _searches(all_bands, cause: bool) -> dict:
    """The band whose amplitude follows the scores, among all bands; and the concordance by chance in the band of
    largest amplitude."""
    setup, chance = TEXTILE_SCENE.searches, TEXTILE_SCENE.chance
    matches, lin = [], texture.concordance(chance.scores, _shifted(TEXTILE_SCENE.concordance))
    for seed in range(setup.count):
        rng = np.random.default_rng(seed)
        scores = np.sort(_any_scores(rng))
        low = setup.low_Hz.step * rng.integers(0, setup.low_Hz.most)
        high = low + setup.width_Hz.step * rng.integers(setup.width_Hz.least, setup.width_Hz.most)
        records = _unrelated(rng, planted=(low, high), gains=scores)
        match = texture.matching_band(records, RATE_Hz, scores if cause else scores[[*setup.shuffled]], all_bands)
        matches.append(low - setup.tolerance_Hz <= match.low_Hz and match.high_Hz <= high + setup.tolerance_Hz)
    draws = range(chance.draws if cause else chance.draws_without_cause)
    null = np.array([_chance(np.random.default_rng(seed), all_bands, cause) for seed in draws])
    return {
        "planted": float(np.mean(matches)),
        "null_q95": float(np.quantile(null, chance.quantile)),
        "null_median": float(np.median(null)),
        "null_share": float(np.mean(null > TEXTILE_SCENE.concordance)),
        "draws": len(null),
        "tried": len(all_bands),
        "lin_low": lin.low,
        "lin_high": lin.high,
    }


def _coloured(rng, records: int, slope: float) -> np.ndarray:
    """Noise (n, records) whose amplitude falls as frequency^-slope from 10 Hz on."""
    count = round(RATE_Hz * TEXTILE_SCENE.seconds)
    frequency = np.fft.rfftfreq(count, 1 / RATE_Hz)
    shape = np.maximum(frequency, TEXTILE_SCENE.corner_Hz) ** -slope
    spectrum = np.fft.rfft(rng.standard_normal((count, records)), axis=0) * shape[:, None]
    return np.fft.irfft(spectrum, count, axis=0)


def _unrelated(rng, planted=(0, 0), gains=1.0) -> np.ndarray:
    """Records (1000, 4) whose spectra fall and differ randomly by 20 % every 20 Hz; in a planted band by `gains`."""
    chance, count = TEXTILE_SCENE.chance, TEXTILE_SCENE.chance.samples
    frequency = np.fft.rfftfreq(count, 1 / RATE_Hz)
    section = (frequency // chance.width_Hz).astype(int)
    shapes = np.exp(chance.spread * rng.standard_normal((section[-1] + 1, chance.records)))[section]
    inside = (frequency >= planted[0]) & (frequency < planted[1])
    shapes[inside] = gains
    phases = np.exp(2j * np.pi * rng.uniform(size=shapes.shape))
    falling = np.maximum(frequency, TEXTILE_SCENE.corner_Hz)[:, None] ** chance.slope
    return np.fft.irfft(shapes * phases / falling, count, axis=0)


def _chance(rng, bands, by_amplitude: bool) -> float:
    """Concordance of four random scores with four unrelated spectra, in the band of largest amplitude (as in the paper)
    or in the one that agrees best."""
    records, scores = _unrelated(rng), _any_scores(rng)
    if not by_amplitude:
        return texture.matching_band(records, RATE_Hz, scores, bands).agreement.coefficient
    best = texture.best_band(records, RATE_Hz, bands)
    amplitude = texture.band_amplitudes(records, RATE_Hz, (best.low_Hz, best.high_Hz))[0]
    return texture.concordance(amplitude / amplitude.max(), scores / scores.max()).coefficient


def _any_scores(rng) -> np.ndarray:
    least, most = TEXTILE_SCENE.searches.scores
    return rng.uniform(least, most, TEXTILE_SCENE.chance.records)


def _shifted(coefficient: float) -> np.ndarray:
    """Values that have this concordance with even scores: only their mean differs."""
    first = np.array(TEXTILE_SCENE.chance.scores)
    noise = np.array([1.0, -1.0, -1.0, 1.0]) * first.std() * np.sqrt(2 * (1 / coefficient - 1))
    return first + noise


def _bands(drawn, all_bands) -> dict:
    time, setup = times(TEXTILE_SCENE.seconds, RATE_Hz), TEXTILE_SCENE.lines
    sine = setup.amplitude * np.sin(2 * np.pi * setup.frequency_Hz * time)
    amplitude = texture.band_amplitudes(sine, RATE_Hz, setup.band_Hz)[0]
    lines = {line: np.sin(2 * np.pi * line * time) for line in setup.of_receptors_Hz}
    split = []
    for line, wave in lines.items():
        receptors = TEXTILE_SCENE.receptors_Hz.items()
        felt = {name: texture.band_amplitudes(wave, RATE_Hz, edges)[0] for name, edges in receptors}
        inside = [name for name, amount in felt.items() if amount > setup.felt / TEXTILE_SCENE.seconds]
        split.append(f"{' and '.join(inside)} ({line} Hz)")
    allowed = set(all_bands)
    return {
        "receptors": float(len(felt)) if len({text.split(" (")[0] for text in split}) == len(split) else 0.0,
        "split": ", ".join(split),
        "random_inside": float(np.mean([band in allowed for band in drawn])),
        "grid": float(len(all_bands)),
        "integral": abs(amplitude / (setup.amplitude / TEXTILE_SCENE.seconds) - 1),
    }


def _scores(rng) -> dict:
    """Simulated assessors, each with a different scale; concordance and outliers compared with their formulas."""
    setup = TEXTILE_SCENE.assessors
    normalised = texture.normalised_scores(np.array(setup.truth) * np.exp(rng.standard_normal((setup.count, 1))))
    values = np.append(rng.standard_normal(setup.count - 1), setup.outlier)
    first, second = rng.standard_normal((2, setup.pairs))
    spread = first.var() + second.var() + (first.mean() - second.mean()) ** 2
    by_hand = 2 * np.cov(first, second, ddof=0)[0, 1] / spread
    return {
        "scales": float((normalised.std(axis=0) / normalised.mean(axis=0)).max()),
        "grubbs": float(texture.grubbs_critical(setup.count)),
        "rejected": "yes" if texture.grubbs_outliers(values)[-1] else "no",
        "lin": abs(texture.concordance(first, second).coefficient - by_hand),
    }


def _weaves() -> dict:
    """Fundamental frequencies of the four fabrics under a stroke of 10 mm/s, with either unit of the table."""
    yarns = np.array([count for pair in YARNS_PER_INCH.values() for count in pair], float)
    inch, metric = (TEXTILE_SCENE.stroke_mm_s * yarns / length for length in (INCH_MM, TEXTILE_SCENE.stated_mm))
    low, high = TEXTILE_SCENE.best_band_Hz
    return {
        "weaves": f"{inch.min():.0f}-{inch.max():.0f} Hz",
        "weaves_10cm": f"{metric.min():.0f}-{metric.max():.0f}",
        "weaves_inside": float(np.mean((inch >= low) & (inch <= high))),
    }


def _textiles(rng, cause: bool) -> dict:
    """Five made-up textiles, six runs each: the accuracy of classification, and the correlation of raw runs with and
    without a common approach."""
    runs, time, records, labels, alone = TEXTILE_SCENE.runs, times(TEXTILE_SCENE.seconds, RATE_Hz), [], [], []
    approach = np.sin(np.pi * np.clip(time / time[-1], 0, 1)) ** 2 * cause
    noise = share_of_noise(SHARED_SIGNALS.snr_dB["2011_oddo"])
    for number, base in enumerate(runs.fundamentals_Hz):
        turns = rng.uniform(0, 2 * np.pi, len(TEXTILE_SCENE.harmonics))
        for _ in range(runs.each):
            place = 2 * np.pi * (base * time + runs.starts_apart * rng.standard_normal())
            surface = sum(np.sin(k * place + turn) / k for k, turn in zip(TEXTILE_SCENE.harmonics, turns, strict=True))
            surface = surface / surface.std() + noise * rng.standard_normal(len(time))
            alone.append(surface)
            # Powers add, so the approach's share of the power is the correlation between textiles
            common = approach / (approach.std() or 1.0)
            records.append(np.sqrt(runs.between) * common + np.sqrt(1 - runs.between) * surface)
            labels.append(f"textile {number}")
    features = [texture.log_band_features(record[slice(*runs.samples)], RATE_Hz, runs.bands) for record in records]
    named = labels if cause else np.random.default_rng(runs.shuffle_seed).permutation(labels).tolist()
    accuracy = texture.leave_m_out(features, named, runs.left_out, seed=runs.split_seed, splits=runs.splits).accuracy
    related, group = np.corrcoef(records), np.arange(len(records)) // runs.each
    same = (group[:, None] == group) & ~np.eye(len(records), dtype=bool)
    return {
        "told_apart": accuracy,
        "within": float(related[same].mean()),
        "within_alone": float(np.corrcoef(alone)[same].mean()),
        "between": float(related[group[:, None] != group].mean()),
    }


experiment = Experiment.of(run, ASSUMED_FIBRES, main=_fabrics, found_118=_fabrics)
