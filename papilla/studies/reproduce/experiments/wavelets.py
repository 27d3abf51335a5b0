"""2011 Oddo: frequency, time and phase of the common signal of two channels, by cross-wavelets; gratings of 0.40-0.48
mm."""

from dataclasses import dataclass, replace

import numpy as np

from papilla.estimators.published.texture import leave_m_out
from papilla.estimators.published.wavelet import cross_quantile, cross_wavelet, morlet, octaves, periods_of_phase
from papilla.estimators.published.wavelet.cross import AFTER, BEFORE, CrossWavelet, Window
from papilla.estimators.tracking.between_gauges import wavelength_between
from papilla.studies.reproduce.claim import Found, Series, gathered
from papilla.studies.reproduce.signals import SNR_DB

CAMPAIGNS = 4
"""Sets of 24 active runs."""
SIMULATED = "simulated runs of a sine a grating (a MEMS array on a robot finger in the paper)"
SCENE = (
    "gratings of another period and a speed that drifts (passive), a constant speed (active), names that are shuffled,"
    " channels at another distance, no grating (contour)",
    f"white, {SNR_DB['2011_oddo']:g} dB",
    CAMPAIGNS,
)
PERIODS_MM, PITCH_MM, RATE_Hz = (0.40, 0.44, 0.48), 2.36, 300.0
SPEEDS_MM_S = (10 / 1.5, 10.0)
REST_S, FIRST_S, SECOND_S = 0.5, 1.5, 1.0
"""Durations (s) of a passive run: at rest before and after, at the first and at the second speed."""
RUNS = 8
SPREADS = (0.0, 0.01, 0.02, 0.03)
"""Standard deviations of the speed from run to run."""
ACTIVE_S, ENCODED_S, SHARED_S = 1.0, 0.150, 0.080
"""Durations (s) of an active run: its record; the contact of at least one unit with the grating; the contact of both
units (IV.B)."""
SLOWEST, FASTEST = 22.0, 31.0
"""Speeds in mm/s at the ends of the window of 67 ms (IV.B)."""


@dataclass(frozen=True)
class Assumed:
    """Parameters of active touch that are not printed: standard deviation of the speed from run to run (1 % for a
    position-controlled finger), time in which a unit gains or loses contact (a period of the finest grating at 26.5
    mm/s), and the noise."""

    speed_spread: float = 0.01
    edge_s: float = 0.015
    snr_dB: float = SNR_DB["2011_oddo"]


ASSUMED = Assumed()
STEADY = replace(ASSUMED, speed_spread=0.0)


def run(tell, cause: bool = True) -> Found:
    """Cross-wavelets of Oddo 2011 on simulated runs in passive and active touch, phases, and nearest neighbours.

    Three channels, two side by side and one 2.36 mm along the path, over gratings of 0.40, 0.44 and 0.48 mm, sampled
    at 300 Hz. Passive touch: 10 mm in 1.5 s, then 10 mm in 1.0 s, eight runs each. Active touch: distal channels feel
    the grating for 115 ms, the proximal one too, 35 ms later, so that both do for 80 ms; the speed rises from 22 to 31
    mm/s within 67 ms. Each run goes the whole way of the paper: wavelets, f_MP, t_MP, window, mean of two pairs,
    nearest neighbour. Its speed differs by 1 % from run to run; other spreads are beside it. Formulas are written once
    more.
    """
    rng = np.random.default_rng(20)
    tell("passive touch")
    passive = [(one, _passive(one, rng, cause)) for one in PERIODS_MM for _ in range(RUNS)]
    tell("active touch")
    values = gathered(
        lambda: _constant_parts(passive),
        lambda: _contours(np.random.default_rng(23), cause),
        lambda: _active_touch(cause),
        lambda: _formulas(np.random.default_rng(24)),
        lambda: _phases(cause),
    )
    ridge = passive[0][1].ridge
    time = np.arange(len(ridge.frequency_Hz)) / RATE_Hz
    series = (
        Series("f_MP of two channels", time, ridge.frequency_Hz),
        Series("expected, v over p", time, passive_speed(time) / PERIODS_MM[0]),
    )
    title = "A grating of 0.40 mm slides at 6.7, then at 10 mm/s: the cross-wavelet's ridge"
    return Found(values, title, "time, s", "frequency, Hz", series)


def _expected() -> np.ndarray:
    return np.array([[speed / period for speed in SPEEDS_MM_S] for period in PERIODS_MM])


def channels(place: np.ndarray, period: float, rng, places_mm=(0.0, 0.0), felt=1.0, snr_dB=STEADY.snr_dB):
    """Records (n,) of channels at places along the path over a grating; felt (channels, n) or 1 : pressure on each
    channel. A channel further along passes the same spot later."""
    noise = 10 ** (-snr_dB / 20)
    felt = np.broadcast_to(felt, (len(places_mm), len(place)))
    waves = [np.sqrt(2) * np.sin(2 * np.pi * (place - shift) / period) for shift in places_mm]
    return [own * wave + noise * rng.standard_normal(len(place)) for own, wave in zip(felt, waves, strict=True)]


def passive_speed(time: np.ndarray) -> np.ndarray:
    """The speed (n,) of the plate in mm/s."""
    edges = np.cumsum([REST_S, FIRST_S, SECOND_S])
    return np.select([time < edges[0], time < edges[1], time < edges[2]], [0.0, *SPEEDS_MM_S], 0.0)


def _passive(period: float, rng, cause: bool = True, grating: bool = True) -> CrossWavelet:
    """A passive run of two channels side by side; without its cause the period is the next one, and the speed
    drifts."""
    time = np.arange(round((2 * REST_S + FIRST_S + SECOND_S) * RATE_Hz)) / RATE_Hz
    speed = passive_speed(time) * (1.0 if cause else 0.8 + 0.15 * time)
    place = np.cumsum(speed) / RATE_Hz + rng.uniform(0, 10)
    felt = grating * (speed > 0)
    first, second = channels(place, period + 0.04 * (not cause), rng, felt=felt)
    return cross_wavelet(first, second, RATE_Hz, octaves(5, 140))


@dataclass(frozen=True, eq=False)
class ActiveRun:
    """One active run: its grating, f_MP around t_MP of the pairs (S4, S1) and (S1, S2), 20 samples each, and the
    windows' statistics."""

    period_mm: float
    frequency_Hz: tuple[np.ndarray, np.ndarray]
    windows: tuple[Window, Window]


def active_records(period: float, rng, assumed: Assumed = STEADY, cause: bool = True):
    """Speed (n,) in mm/s, and records (n,) of S1, S2 and S4 in one active run."""
    time = np.arange(round(ACTIVE_S * RATE_Hz)) / RATE_Hz - 0.4
    # Contact time of a unit with the grating
    own = (ENCODED_S + SHARED_S) / 2
    middle = (ENCODED_S + own) / 4 + (AFTER - BEFORE) / 2 / RATE_Hz
    slope = (FASTEST - SLOWEST) / ((BEFORE + AFTER) / RATE_Hz) * cause
    speed = np.clip((SLOWEST + FASTEST) / 2 + slope * (time - middle), 5, 50) * (
        1 + assumed.speed_spread * rng.standard_normal()
    )
    place = np.cumsum(speed) / RATE_Hz + rng.uniform(0, 10)
    felt = []
    for begin in (0.0, 0.0, ENCODED_S - own):
        inside = np.minimum(time - begin, begin + own - time)
        felt.append(np.clip(inside / assumed.edge_s, 0, 1))
    return speed, channels(place, period, rng, (0.0, 0.0, PITCH_MM), felt, assumed.snr_dB)


def active_run(period: float, rng, assumed: Assumed, cause: bool = True) -> ActiveRun:
    """A run through the whole chain of the method."""
    _, (first, second, fourth) = active_records(period, rng, assumed, cause)
    pairs = (fourth, first), (first, second)
    ridges = [cross_wavelet(one, other, RATE_Hz, octaves(20, 140)).ridge for one, other in pairs]
    windows = [ridge.around_strongest() for ridge in ridges]
    frequency = [ridge.frequency_Hz[own.first : own.last + 1] for ridge, own in zip(ridges, windows, strict=True)]
    return ActiveRun(period, (frequency[0], frequency[1]), (windows[0], windows[1]))


def campaign(seed: int, assumed: Assumed = ASSUMED, cause: bool = True) -> list[ActiveRun]:
    """24 active runs, eight a grating."""
    rng = np.random.default_rng(seed)
    return [active_run(period, rng, assumed, cause) for period in PERIODS_MM for _ in range(RUNS)]


def table_3(runs: list[ActiveRun]) -> np.ndarray:
    """(gratings, pairs, 4): mean, standard deviation of all samples, mean greatest and mean least f_MP in Hz."""
    table = np.zeros((len(PERIODS_MM), 2, 4))
    for row, period in enumerate(PERIODS_MM):
        own = [one for one in runs if one.period_mm == period]
        for pair in range(2):
            samples = np.array([one.frequency_Hz[pair] for one in own])
            ends = samples.max(axis=1).mean(), samples.min(axis=1).mean()
            table[row, pair] = (samples.mean(), samples.std(ddof=1), *ends)
    return table


def accuracy(runs: list[ActiveRun], left_out: int, cause: bool = True, splits: int = 1000) -> float:
    """Percentage of runs that the nearest neighbour classifies correctly; features: the mean f_MP of both pairs."""
    features = [[own.mean_Hz for own in one.windows] for one in runs]
    names = [f"{one.period_mm:g}" for one in runs]
    if not cause:
        names = np.random.default_rng(5).permutation(names).tolist()
    return 100 * leave_m_out(features, names, left_out, seed=0, splits=splits).accuracy


def _modulated(assumed: Assumed, sets=None) -> dict:
    """Table III: means over sets of runs, or of one set by default."""
    sets = sets or [campaign(100, assumed)]
    table = np.mean([table_3(runs) for runs in sets], axis=0)
    speeds = table[..., 2:] * np.array(PERIODS_MM)[:, None, None]
    rising = [bool((np.diff(own) >= 0).all()) for runs in sets for one in runs for own in one.frequency_Hz]
    return {
        "rising": float(np.mean(rising)),
        "active_sd": 100 * float((table[..., 1] / table[..., 0]).max()),
        "table_3": "; ".join(f"{own[0, 0]:.1f} ± {own[0, 1]:.1f}, {own[1, 0]:.1f} ± {own[1, 1]:.1f}" for own in table),
        "speed_off": float(max(abs(speeds[..., 0] - FASTEST).max(), abs(speeds[..., 1] - SLOWEST).max())),
        "speeds": f"{speeds[..., 1].min():.1f}-{speeds[..., 1].max():.1f} to {speeds[..., 0].min():.1f}-"
        f"{speeds[..., 0].max():.1f} mm/s",
    }


def _active_touch(cause: bool) -> dict:
    """Tables III and IV: means over the campaigns; other spreads of the speed from one campaign each."""
    sets = [campaign(100 + number, ASSUMED, cause) for number in range(CAMPAIGNS)]
    single, several = ([accuracy(runs, left, cause) for runs in sets] for left in (21, 12))
    others = [campaign(200, replace(ASSUMED, speed_spread=spread)) for spread in SPREADS if cause]
    curve = [[f"{accuracy(runs, left):.1f}" for runs in others] for left in (21, 12)]
    return _modulated(ASSUMED, sets) | {
        "knn_runs": float(len(sets[0])),
        "one_run": float(np.mean(single)),
        "four_runs": float(np.mean(several)),
        "curve": " / ".join(curve[0]) + " %",
        "curve4": " / ".join(curve[1]) + " %",
    }


def _constant_parts(passive) -> dict:
    """Table II: f_MP over 200 samples of each speed, its deviation, and the grating by the nearest v over p."""
    parts = [slice(round(begin * RATE_Hz), round(begin * RATE_Hz) + 200) for begin in (REST_S + 0.4, REST_S + 1.7)]
    values = np.array([[wavelet.ridge.frequency_Hz[part] for part in parts] for _, wavelet in passive])
    means = values.mean(axis=2).reshape(len(PERIODS_MM), RUNS, 2)
    named = np.abs(means[:, :, None, :] - _expected()[None, None]).argmin(axis=2)
    return {
        "table": " ".join(f"{value:.2f}" for value in means.mean(axis=1).ravel()),
        "table_error": 100 * float(np.abs(means.mean(axis=1) / _expected() - 1).max()),
        "passive_runs": float(RUNS),
        "passive_sd": 100 * float((values.std(axis=2, ddof=1) / values.mean(axis=2)).max()),
        "table_right": float(np.mean(named == np.arange(len(PERIODS_MM))[:, None, None])),
    }


def _contours(rng, cause: bool) -> dict:
    """Share of samples at which the ridge is over the 5 % level exactly while the grating slides."""
    agree = []
    for period in PERIODS_MM:
        ridge = _passive(period, rng, grating=cause).ridge
        time = np.arange(len(ridge.frequency_Hz)) / RATE_Hz
        sliding, edge = passive_speed(time) > 0, 0.15  # A wavelet of 14 Hz blurs an end over this time
        clear = np.all([np.abs(time - end) > edge for end in (REST_S, REST_S + FIRST_S + SECOND_S)], axis=0)
        agree.append(np.mean((ridge.significant & ridge.inside)[clear] == sliding[clear]))
    return {"contour": float(np.mean(agree))}


def _formulas(rng) -> dict:
    """The definitions, implemented a second time."""
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


def _phases(cause: bool) -> dict:
    """Phases of pairs 2.36 mm apart over each grating at two speeds, and the periods that agree with them."""
    rng, found = np.random.default_rng(21), []
    expected = [np.degrees(np.angle(np.exp(2j * np.pi * PITCH_MM / period))) for period in PERIODS_MM]
    distance, time = PITCH_MM if cause else 0.9 * PITCH_MM, np.arange(600) / RATE_Hz
    for period in PERIODS_MM:
        both = []
        for factor in (1.0, 0.7):
            place = np.cumsum(factor * (22 + 4.5 * time)) / RATE_Hz + rng.uniform(0, 10)
            first, second = channels(place, period, rng, (0.0, distance))
            ridge = cross_wavelet(first, second, RATE_Hz, octaves(20, 140)).ridge
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


VARIED = {"rising": _modulated, "active_sd": _modulated, "speed_off": _modulated}
