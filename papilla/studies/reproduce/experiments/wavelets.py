"""2011 Oddo: frequency, time and phase of what two channels share, by cross-wavelets; gratings of 0.40-0.48 mm."""

import numpy as np

from papilla.estimators.published.texture import leave_m_out
from papilla.estimators.published.wavelet import cross_quantile, cross_wavelet, morlet, octaves, periods_of_phase
from papilla.estimators.published.wavelet.cross import AFTER, BEFORE, CrossWavelet
from papilla.estimators.tracking.between_gauges import wavelength_between
from papilla.studies.reproduce.claim import Found, Series

SIMULATED = "simulated runs (a MEMS array on a robot finger in the paper)"
PERIODS_MM, PITCH_MM, RATE_Hz = (0.40, 0.44, 0.48), 2.36, 300.0
SPEEDS_MM_S = (10 / 1.5, 10.0)
RUNS = 8
SPREADS = (0.01, 0.02, 0.03, 0.05)
"""Standard deviations of the speed from run to run that nearest neighbours are tried with."""
CAMPAIGNS = 12
"""Sets of 24 runs that an accuracy is averaged over."""


def run(tell) -> Found:
    """Cross-wavelets of Oddo 2011 on simulated runs in passive and active touch, phases, and nearest neighbours.

    Two channels 2.36 mm apart over gratings of 0.40, 0.44 and 0.48 mm, sampled at 300 Hz at 20 dB. Passive touch: 10 mm
    in 1.5 s, then 10 mm in 1.0 s, eight runs each. Active touch: a ramp from 22 to 31 mm/s in 2 s. Formulas are written
    a second time. Nearest neighbours see the frequency of 24 runs whose speed differs by 1-5 % from run to run.
    """
    rng = np.random.default_rng(20)
    passive = [(period, run_, _passive(period, rng)) for period in PERIODS_MM for run_ in range(RUNS)]
    tell("passive touch")
    means, deviations, right, significant = _constant_parts(passive)
    tell("active touch")
    active = [_active(period, 1.0, rng) for period in PERIODS_MM]
    values = {
        "table": " ".join(f"{value:.2f}" for value in means.mean(axis=1).ravel()),
        "table_error": 100 * float(np.abs(means.mean(axis=1) / _expected() - 1).max()),
        "passive_runs": float(means.shape[1]),
        "passive_sd": 100 * deviations,
        "table_right": right,
        "significant": significant,
        **_speeds(active),
        **_formulas(rng),
        **_phases(active[1][1]),
    }
    tell("nearest neighbours")
    values |= _neighbours(rng)
    ridge = passive[0][2].ridge
    time = np.arange(len(ridge.frequency_Hz)) / RATE_Hz
    series = (
        Series("f_MP of two channels", time, ridge.frequency_Hz),
        Series("expected, v over p", time, np.where(time < 1.5, *(v / PERIODS_MM[0] for v in SPEEDS_MM_S))),
    )
    title = "A grating of 0.40 mm slides at 6.7, then at 10 mm/s: the cross-wavelet's ridge"
    return Found(values, title, "time, s", "frequency, Hz", series)


def _expected() -> np.ndarray:
    return np.array([[speed / period for speed in SPEEDS_MM_S] for period in PERIODS_MM])


def _channels(place: np.ndarray, period: float, rng, distance: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Two channels a distance apart over a grating, 20 dB: the second is over the same spot later."""
    wave = [np.sqrt(2) * np.sin(2 * np.pi * (place - shift) / period) for shift in (0.0, distance)]
    first, second = (one + 0.1 * rng.standard_normal(len(place)) for one in wave)
    return first, second


def _passive(period: float, rng) -> CrossWavelet:
    time = np.arange(round(2.5 * RATE_Hz)) / RATE_Hz
    place = np.where(time < 1.5, SPEEDS_MM_S[0] * time, 10 + SPEEDS_MM_S[1] * (time - 1.5)) + rng.uniform(0, 10)
    return cross_wavelet(*_channels(place, period, rng), RATE_Hz, octaves(5, 140))


def _active(period: float, factor: float, rng, distance: float = PITCH_MM):
    """Speed (n,) of a movement and the cross-wavelet of a pair."""
    time = np.arange(round(2 * RATE_Hz)) / RATE_Hz
    speed = factor * np.linspace(22, 31, time.size)
    place = np.cumsum(speed) / RATE_Hz + rng.uniform(0, 10)
    return speed, cross_wavelet(*_channels(place, period, rng, distance), RATE_Hz, octaves(20, 140))


def _constant_parts(passive) -> tuple[np.ndarray, float, float, float]:
    """Mean f_MP (gratings, runs, speeds), largest relative deviation, share of right names, share over the level."""
    parts = [slice(round(0.3 * RATE_Hz), round(1.2 * RATE_Hz)), slice(round(1.8 * RATE_Hz), round(2.3 * RATE_Hz))]
    means = np.zeros((len(PERIODS_MM), RUNS, 2))
    worst, significant = 0.0, []
    for period, number, wavelet in passive:
        ridge = wavelet.ridge
        for speed, part in enumerate(parts):
            values = ridge.frequency_Hz[part]
            means[PERIODS_MM.index(period), number, speed] = values.mean()
            worst = max(worst, float(values.std(ddof=1) / values.mean()))
            significant.append(ridge.significant[part].mean())
    named = np.abs(means[:, :, None, :] - _expected()[None, None]).argmin(axis=2)
    right = float(np.mean(named == np.arange(len(PERIODS_MM))[:, None, None]))
    return means, worst, right, float(np.mean(significant))


def _speeds(active) -> dict:
    """The speed out of f_MP of active runs, their ends, and the deviation in the window of t_MP."""
    errors, ends, deviations = [], [], []
    for (speed, wavelet), period in zip(active, PERIODS_MM, strict=True):
        rows = slice(round(0.1 * RATE_Hz), round(1.9 * RATE_Hz))
        found = wavelet.ridge.frequency_Hz * period
        errors.append(np.sqrt(np.mean((found[rows] / speed[rows] - 1) ** 2)))
        inside = np.flatnonzero(wavelet.ridge.inside)
        ends.append((found[inside[0]] / speed[inside[0]] - 1, found[inside[-1]] / speed[inside[-1]] - 1))
        strongest = int(np.clip(wavelet.ridge.strongest, BEFORE, len(found) - AFTER - 1))
        window = wavelet.ridge.window(strongest - BEFORE, strongest + AFTER)
        deviations.append(window.sd_Hz / window.mean_Hz)
    first = active[0][1].ridge.frequency_Hz * PERIODS_MM[0]
    return {
        "inverted": 100 * float(np.max(errors)),
        "active_ends": 100 * float(np.abs(ends).max()),
        "active_mm_s": f"{first[10]:.1f} and {first[-10]:.1f}",
        "active_sd": 100 * float(np.max(deviations)),
    }


def _formulas(rng) -> dict:
    """The definitions, written once more."""
    time = np.arange(900) / RATE_Hz
    first, second = np.sin(2 * np.pi * 25 * time), np.sin(2 * np.pi * 25 * time - np.pi / 2)
    frequency = octaves(5, 140)
    pair = cross_wavelet(first, second, RATE_Hz, frequency)
    product = morlet(first, RATE_Hz, frequency).coefficients * np.conj(morlet(second, RATE_Hz, frequency).coefficients)
    ridge, magnitude = pair.ridge, np.abs(pair.product)
    top = magnitude.argmax(axis=0)
    strongest = int(magnitude.max(axis=0).argmax())
    at = int(np.clip(strongest, BEFORE, len(top) - AFTER - 1))
    values = frequency[top][at - BEFORE : at + AFTER + 1]
    window = ridge.window(at - BEFORE, at + AFTER)
    indices = (window.mean_Hz, window.sd_Hz, window.greatest_Hz, window.least_Hz)
    by_hand = (values.mean(), values.std(ddof=1), values.max(), values.min())
    red = np.zeros((2, 12000))
    kicks = rng.standard_normal(red.shape)
    for row in range(1, red.shape[1]):
        red[:, row] = 0.7 * red[:, row - 1] + kicks[:, row]
    noise = cross_wavelet(red[0], red[1], RATE_Hz, octaves(5, 140, 12))
    return {
        "per_octave": 1 / float(np.log2(frequency[1] / frequency[0])),
        "product": float(np.abs(pair.product - product).max() / np.abs(product).max()),
        "red_share": float(noise.significant[noise.inside].mean()),
        "quantile": cross_quantile(0.05),
        "lead": float(np.degrees(np.median(ridge.phase[300:600]))),
        "f_mp": float(np.mean(ridge.frequency_Hz == frequency[top])),
        "t_mp": float(ridge.strongest == strongest),
        "window_ms": 1000 * (BEFORE + AFTER + 1) / RATE_Hz,
        "indices": float(np.mean(np.isclose(indices, by_hand))),
    }


def _phases(wavelet: CrossWavelet) -> dict:
    """Phases of pairs 2.36 mm apart over each grating, and what periods they leave."""
    rng, found = np.random.default_rng(21), []
    expected = [np.degrees(np.angle(np.exp(2j * np.pi * PITCH_MM / period))) for period in PERIODS_MM]
    for period in PERIODS_MM:
        both = []
        for factor in (1.0, 0.7):
            ridge = _active(period, factor, rng)[1].ridge
            both.append(np.angle(np.mean(np.exp(1j * ridge.phase[100:500]))))
        found.append(np.degrees(both))
    off = np.angle(np.exp(1j * np.radians(np.array(found) - np.array(expected)[:, None])))
    many = periods_of_phase(np.radians(found[1][0]), PITCH_MM, (0.25, 5.0))
    single = periods_of_phase(2 * np.pi * PITCH_MM / 6.0, PITCH_MM, (2 * PITCH_MM + 1e-6, 1e3))
    places = (0.0, 2.36, 3.1)
    phases = tuple(float(np.angle(np.exp(2j * np.pi * place / 0.44))) for place in places)
    told = wavelength_between(places, phases, (0.02, 0.02, 0.02), 0.44 * 1.02)[0]
    return {
        "phases": ", ".join(f"{one[0]:.1f}" for one in found),
        "phase_error": float(np.degrees(np.abs(off).max())),
        "many": len(many),
        "alone": float(len(single)),
        "irregular": float(told),
    }


def _neighbours(rng) -> dict:
    """Accuracy of nearest neighbours on f_MP of two pairs against the spread of the speed between runs."""
    labels, one, four = [p for p in PERIODS_MM for _ in range(RUNS)], [], []
    names = [f"{period:g}" for period in labels]
    for spread in SPREADS:
        accuracies = []
        for campaign in range(CAMPAIGNS):
            speed = 26.5 * (1 + spread * rng.standard_normal(len(labels)))
            frequency = (speed / labels)[:, None] * (1 + 0.002 * rng.standard_normal((len(labels), 2)))
            accuracies.append([leave_m_out(frequency, names, m, seed=campaign, splits=12).accuracy for m in (21, 12)])
        single, several = 100 * np.mean(accuracies, axis=0)
        one.append(float(single))
        four.append(float(several))
    return {
        "knn_runs": float(len(labels)),
        "one_run": one[0],
        "four_runs": four[0],
        "curve": " / ".join(f"{value:.1f}" for value in one) + " %",
        "curve4": " / ".join(f"{value:.1f}" for value in four) + " %",
    }
