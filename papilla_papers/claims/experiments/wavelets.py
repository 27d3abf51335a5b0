"""2011 Oddo: frequency, time and phase of the common signal of two channels, by cross-wavelets; gratings of 0.40-0.48
mm."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import lfilter

from papilla.core.units import MS_PER_S, PER_CENT
from papilla.estimators.wavelength.trackers import wavelength_between
from papilla_papers.claims.claim import Experiment, gathered
from papilla_papers.claims.scenes import scene
from papilla_papers.claims.signals import SHARED_SIGNALS, listed, share_of_noise, times
from papilla_papers.methods.texture import leave_m_out
from papilla_papers.methods.wavelet import cross_quantile, cross_wavelet, morlet, octaves, periods_of_phase
from papilla_papers.methods.wavelet.cross import SAMPLES_AFTER, SAMPLES_BEFORE, CrossWavelet, RidgeWindow

WAVELET_SCENE = scene("wavelets")
PASSIVE_TOUCH, ACTIVE_TOUCH = WAVELET_SCENE.passive, WAVELET_SCENE.active
PERIODS_MM: tuple[float, ...] = WAVELET_SCENE.periods_mm
RATE_Hz: float = WAVELET_SCENE.rate_Hz
SPEEDS_MM_S = (PASSIVE_TOUCH.way_mm / PASSIVE_TOUCH.first_s, PASSIVE_TOUCH.way_mm / PASSIVE_TOUCH.second_s)
RUNS_A_GRATING: int = WAVELET_SCENE.runs
PASSIVE_S = 2 * PASSIVE_TOUCH.rest_s + PASSIVE_TOUCH.first_s + PASSIVE_TOUCH.second_s
"""Duration of a passive run."""


@dataclass(frozen=True)
class RunParameters:
    """Parameters of active touch that are not printed: standard deviation of the speed from run to run, time in which a
    unit gains or loses contact, and the noise."""

    speed_spread: float
    edge_s: float
    snr_dB: float = SHARED_SIGNALS.snr_dB["2011_oddo"]


ASSUMED_RUNS = RunParameters(**WAVELET_SCENE.assumed)
STEADY_RUNS = replace(ASSUMED_RUNS, speed_spread=0.0)


def run(tell, cause: bool = True) -> dict:
    """Cross-wavelets of Oddo 2011 on simulated runs in passive and active touch, phases, and nearest neighbours.

    Three channels, two side by side and one 2.36 mm along the path, over gratings of 0.40, 0.44 and 0.48 mm, sampled
    at 300 Hz. Passive touch: 10 mm in 1.5 s, then 10 mm in 1.0 s, eight runs each. Active touch: distal channels feel
    the grating for 115 ms, the proximal one too, 35 ms later, so that both do for 80 ms; the speed rises from 22 to 31
    mm/s within 67 ms. Each run goes the whole way of the paper: wavelets, f_MP, t_MP, window, mean of two pairs,
    nearest neighbour. Its speed differs by 1 % from run to run; other spreads are beside it. Formulas are written once
    more.
    """
    rng = np.random.default_rng(PASSIVE_TOUCH.seed)
    tell("passive touch")
    passive = [(period, _passive(period, rng, cause)) for period in PERIODS_MM for _ in range(RUNS_A_GRATING)]
    tell("active touch")
    return gathered(
        lambda: _constant_parts(passive),
        lambda: _contours(np.random.default_rng(WAVELET_SCENE.contours.seed), cause),
        lambda: _active_touch(cause),
        lambda: _formulas(np.random.default_rng(WAVELET_SCENE.formulas.seed)),
        lambda: _phases(cause),
    )


def _expected() -> np.ndarray:
    return np.array([[speed / period for speed in SPEEDS_MM_S] for period in PERIODS_MM])


def channels(place: np.ndarray, period: float, rng, places_mm=(0.0, 0.0), felt=1.0, snr_dB=STEADY_RUNS.snr_dB):
    """Records (n,) of channels at places along the path over a grating; felt (channels, n) or 1 : pressure on each
    channel. A channel further along passes the same spot later."""
    noise = share_of_noise(snr_dB)
    felt = np.broadcast_to(felt, (len(places_mm), len(place)))
    waves = [np.sqrt(2) * np.sin(2 * np.pi * (place - shift) / period) for shift in places_mm]
    pairs = zip(felt, waves, strict=True)
    return [pressure * wave + noise * rng.standard_normal(len(place)) for pressure, wave in pairs]


def passive_speed(time: np.ndarray) -> np.ndarray:
    """The speed (n,) of the plate in mm/s."""
    edges = np.cumsum([PASSIVE_TOUCH.rest_s, PASSIVE_TOUCH.first_s, PASSIVE_TOUCH.second_s])
    return np.select([time < edges[0], time < edges[1], time < edges[2]], [0.0, *SPEEDS_MM_S], 0.0)


def _passive(period: float, rng, cause: bool = True, grating: bool = True) -> CrossWavelet:
    """A passive run of two channels side by side; without its cause the period is the next one, and the speed
    drifts."""
    time, (slow, rise) = times(PASSIVE_S, RATE_Hz), PASSIVE_TOUCH.drift
    speed = passive_speed(time) * (1.0 if cause else slow + rise * time)
    place = np.cumsum(speed) / RATE_Hz + rng.uniform(*WAVELET_SCENE.starts_mm)
    felt = grating * (speed > 0)
    first, second = channels(place, period + PASSIVE_TOUCH.other_period_mm * (not cause), rng, felt=felt)
    return cross_wavelet(first, second, RATE_Hz, octaves(*WAVELET_SCENE.passive_Hz))


@dataclass(frozen=True, eq=False)
class ActiveRun:
    """One active run: its grating, f_MP around t_MP of the pairs (S4, S1) and (S1, S2), 20 samples each, and the
    windows' statistics."""

    period_mm: float
    frequency_Hz: tuple[np.ndarray, np.ndarray]
    windows: tuple[RidgeWindow, RidgeWindow]


def active_records(period: float, rng, assumed: RunParameters = STEADY_RUNS, cause: bool = True):
    """Speed (n,) in mm/s, and records (n,) of S1, S2 and S4 in one active run."""
    time = times(ACTIVE_TOUCH.seconds, RATE_Hz) - ACTIVE_TOUCH.begin_s
    # Contact time of a unit with the grating; both units touch it about the middle
    contact_s = (ACTIVE_TOUCH.encoded_s + ACTIVE_TOUCH.shared_s) / 2
    middle = (ACTIVE_TOUCH.encoded_s + contact_s) / 2 / 2 + (SAMPLES_AFTER - SAMPLES_BEFORE) / 2 / RATE_Hz
    slowest, fastest = ACTIVE_TOUCH.slowest_mm_s, ACTIVE_TOUCH.fastest_mm_s
    slope = (fastest - slowest) / ((SAMPLES_BEFORE + SAMPLES_AFTER) / RATE_Hz) * cause
    meant = np.clip((slowest + fastest) / 2 + slope * (time - middle), *ACTIVE_TOUCH.limits_mm_s)
    speed = meant * (1 + assumed.speed_spread * rng.standard_normal())
    place = np.cumsum(speed) / RATE_Hz + rng.uniform(*WAVELET_SCENE.starts_mm)
    felt = []
    for begin in (0.0, 0.0, ACTIVE_TOUCH.encoded_s - contact_s):
        inside = np.minimum(time - begin, begin + contact_s - time)
        felt.append(np.clip(inside / assumed.edge_s, 0, 1))
    return speed, channels(place, period, rng, (0.0, 0.0, WAVELET_SCENE.pitch_mm), felt, assumed.snr_dB)


def active_run(period: float, rng, assumed: RunParameters, cause: bool = True) -> ActiveRun:
    """A run through the whole chain of the method."""
    _, (first, second, fourth) = active_records(period, rng, assumed, cause)
    pairs = (fourth, first), (first, second)
    ridges = [cross_wavelet(upper, lower, RATE_Hz, octaves(*WAVELET_SCENE.active_Hz)).ridge for upper, lower in pairs]
    windows = [ridge.around_strongest() for ridge in ridges]
    frequency = [r.frequency_Hz[window.first : window.last + 1] for r, window in zip(ridges, windows, strict=True)]
    return ActiveRun(period, (frequency[0], frequency[1]), (windows[0], windows[1]))


def campaign(seed: int, assumed: RunParameters = ASSUMED_RUNS, cause: bool = True) -> list[ActiveRun]:
    """24 active runs, eight a grating."""
    rng = np.random.default_rng(seed)
    return [active_run(period, rng, assumed, cause) for period in PERIODS_MM for _ in range(RUNS_A_GRATING)]


def table_3(runs: list[ActiveRun]) -> np.ndarray:
    """(gratings, pairs, 4): mean, standard deviation of all samples, mean greatest and mean least f_MP in Hz."""
    by_period = [[run.frequency_Hz for run in runs if run.period_mm == period] for period in PERIODS_MM]
    return np.array([[indices(np.array([pairs[pair] for pairs in some])) for pair in range(2)] for some in by_period])


def indices(samples: np.ndarray) -> tuple[float, float, float, float]:
    """Mean, standard deviation of all samples (runs, n), mean greatest and mean least."""
    ends = samples.max(axis=1).mean(), samples.min(axis=1).mean()
    return samples.mean(), samples.std(ddof=1), *ends


def accuracy(runs: list[ActiveRun], left_out: int, cause: bool = True) -> float:
    """Percentage of runs that the nearest neighbour classifies correctly; features: the mean f_MP of both pairs."""
    features = [[window.mean_Hz for window in run.windows] for run in runs]
    names = [f"{run.period_mm:g}" for run in runs]
    if not cause:
        names = np.random.default_rng(WAVELET_SCENE.shuffle_seed).permutation(names).tolist()
    how = {"seed": WAVELET_SCENE.split_seed, "splits": WAVELET_SCENE.splits}
    return PER_CENT * leave_m_out(features, names, left_out, **how).accuracy


def _modulated(assumed: RunParameters, sets=None) -> dict:
    """Table III: means over sets of runs, or of one set by default."""
    sets = sets or [campaign(WAVELET_SCENE.first_campaign, assumed)]
    table = np.mean([table_3(runs) for runs in sets], axis=0)
    speeds = table[..., 2:] * np.array(PERIODS_MM)[:, None, None]
    rising = [bool((np.diff(pair) >= 0).all()) for runs in sets for run in runs for pair in run.frequency_Hz]
    return {
        "rising": float(np.mean(rising)),
        "active_sd": PER_CENT * float((table[..., 1] / table[..., 0]).max()),
        "table_3": "; ".join(
            f"{pairs[0, 0]:.1f} ± {pairs[0, 1]:.1f}, {pairs[1, 0]:.1f} ± {pairs[1, 1]:.1f}" for pairs in table
        ),
        "speed_off": float(np.abs(speeds - [ACTIVE_TOUCH.fastest_mm_s, ACTIVE_TOUCH.slowest_mm_s]).max()),
        "speeds": f"{speeds[..., 1].min():.1f}-{speeds[..., 1].max():.1f} to {speeds[..., 0].min():.1f}-"
        f"{speeds[..., 0].max():.1f} mm/s",
    }


def _active_touch(cause: bool) -> dict:
    """Tables III and IV: means over the campaigns; other spreads of the speed from one campaign each."""
    seeds = range(WAVELET_SCENE.first_campaign, WAVELET_SCENE.first_campaign + WAVELET_SCENE.campaigns)
    sets = [campaign(seed, ASSUMED_RUNS, cause) for seed in seeds]
    single, several = ([accuracy(runs, left_out, cause) for runs in sets] for left_out in WAVELET_SCENE.left_out)
    seed, spreads = WAVELET_SCENE.campaign_of_spreads, WAVELET_SCENE.spreads if cause else ()
    others = [campaign(seed, replace(ASSUMED_RUNS, speed_spread=spread)) for spread in spreads]
    curve = [[f"{accuracy(runs, left_out):.1f}" for runs in others] for left_out in WAVELET_SCENE.left_out]
    return _modulated(ASSUMED_RUNS, sets) | {
        "knn_runs": float(len(sets[0])),
        "one_run": float(np.mean(single)),
        "four_runs": float(np.mean(several)),
        "curve": " / ".join(curve[0]) + " %",
        "curve4": " / ".join(curve[1]) + " %",
    }


def _constant_parts(passive) -> dict:
    """Table II: f_MP over 200 samples of each speed, its deviation, and the grating by the nearest v over p."""
    begins = [round((PASSIVE_TOUCH.rest_s + begin) * RATE_Hz) for begin in PASSIVE_TOUCH.parts_s]
    parts = [slice(begin, begin + PASSIVE_TOUCH.samples) for begin in begins]
    values = np.array([[wavelet.ridge.frequency_Hz[samples] for samples in parts] for _, wavelet in passive])
    means = values.mean(axis=2).reshape(len(PERIODS_MM), RUNS_A_GRATING, 2)
    named = np.abs(means[:, :, None, :] - _expected()[None, None]).argmin(axis=2)
    return {
        "table": " ".join(f"{value:.2f}" for value in means.mean(axis=1).ravel()),
        "table_error": PER_CENT * float(np.abs(means.mean(axis=1) / _expected() - 1).max()),
        "passive_runs": float(RUNS_A_GRATING),
        "passive_sd": PER_CENT * float((values.std(axis=2, ddof=1) / values.mean(axis=2)).max()),
        "table_right": float(np.mean(named == np.arange(len(PERIODS_MM))[:, None, None])),
    }


def _contours(rng, cause: bool) -> dict:
    """Share of samples at which the ridge is over the 5 % level exactly while the grating slides."""
    agree = []
    for period in PERIODS_MM:
        ridge = _passive(period, rng, grating=cause).ridge
        time, ends = times(PASSIVE_S, RATE_Hz), (PASSIVE_TOUCH.rest_s, PASSIVE_S - PASSIVE_TOUCH.rest_s)
        sliding = passive_speed(time) > 0
        clear = np.all([np.abs(time - end) > WAVELET_SCENE.contours.edge_s for end in ends], axis=0)
        agree.append(np.mean((ridge.significant & ridge.inside)[clear] == sliding[clear]))
    return {"contour": float(np.mean(agree))}


def phase_deg(period_mm: float) -> float:
    """Phase of a channel before the one a pitch further along, by equation (4)."""
    return float(np.degrees(np.angle(np.exp(2j * np.pi * WAVELET_SCENE.pitch_mm / period_mm))))


def _formulas(rng) -> dict:
    """The definitions, implemented a second time."""
    setup = WAVELET_SCENE.formulas
    turn = 2 * np.pi * setup.line_Hz * times(setup.seconds, RATE_Hz)
    first, second = np.sin(turn), np.sin(turn - np.pi / 2)
    frequency = octaves(*WAVELET_SCENE.passive_Hz)
    pair = cross_wavelet(first, second, RATE_Hz, frequency)
    product = morlet(first, RATE_Hz, frequency).coefficients * np.conj(morlet(second, RATE_Hz, frequency).coefficients)
    ridge, magnitude = pair.ridge, np.abs(pair.product)
    top = magnitude.argmax(axis=0)
    strongest = int(magnitude.max(axis=0).argmax())
    at = int(np.clip(strongest, SAMPLES_BEFORE, len(top) - SAMPLES_AFTER - 1))
    values = frequency[top][at - SAMPLES_BEFORE : at + SAMPLES_AFTER + 1]
    window = ridge.window(at - SAMPLES_BEFORE, at + SAMPLES_AFTER)
    stated = (window.mean_Hz, window.sd_Hz, window.greatest_Hz, window.least_Hz)
    by_hand = (values.mean(), values.std(ddof=1), values.max(), values.min())
    kicks = rng.standard_normal((2, setup.red_samples))
    kicks[:, 0] = 0.0
    red = lfilter([1.0], [1.0, -setup.red_memory], kicks)
    low, high = WAVELET_SCENE.passive_Hz
    noise = cross_wavelet(red[0], red[1], RATE_Hz, octaves(low, high, setup.red_voices))
    return {
        "per_octave": 1 / float(np.log2(frequency[1] / frequency[0])),
        "product": float(np.abs(pair.product - product).max() / np.abs(product).max()),
        "red_share": float(noise.significant[noise.inside].mean()),
        "quantile": cross_quantile(setup.level),
        "lead": float(np.degrees(np.median(ridge.phase[slice(*setup.samples)]))),
        "f_mp": float(np.mean(ridge.frequency_Hz == frequency[top])),
        "t_mp": float(ridge.strongest == strongest),
        "window_ms": MS_PER_S * (SAMPLES_BEFORE + SAMPLES_AFTER + 1) / RATE_Hz,
        "indices": float(np.mean(np.isclose(stated, by_hand))),
    }


def _phases(cause: bool) -> dict:
    """Phases of pairs 2.36 mm apart over each grating at two speeds, and the periods that agree with them."""
    setup, pitch = WAVELET_SCENE.phases, WAVELET_SCENE.pitch_mm
    rng, measured = np.random.default_rng(setup.seed), []
    expected = [phase_deg(period) for period in PERIODS_MM]
    distance, time = pitch * (1.0 if cause else setup.nearer), times(setup.seconds, RATE_Hz)
    for period in PERIODS_MM:
        both = []
        for factor in setup.factors:
            place = np.cumsum(factor * (setup.from_mm_s + setup.rise_mm_s2 * time)) / RATE_Hz
            place = place + rng.uniform(*WAVELET_SCENE.starts_mm)
            first, second = channels(place, period, rng, (0.0, distance))
            ridge = cross_wavelet(first, second, RATE_Hz, octaves(*WAVELET_SCENE.active_Hz)).ridge
            both.append(np.angle(np.mean(np.exp(1j * ridge.phase[slice(*setup.samples)]))))
        measured.append(np.degrees(both))
    off = np.angle(np.exp(1j * np.radians(np.array(measured) - np.array(expected)[:, None])))
    many = periods_of_phase(np.radians(measured[1][0]), pitch, setup.range_mm)
    beyond = (2 * pitch + setup.rounding_mm, setup.longest_mm)
    single = periods_of_phase(2 * np.pi * pitch / setup.alone_mm, pitch, beyond)
    three = WAVELET_SCENE.irregular
    phases = tuple(float(np.angle(np.exp(2j * np.pi * place / three.period_mm))) for place in three.places_mm)
    period_of_three = wavelength_between(three.places_mm, phases, three.sigma, three.period_mm * three.guess)[0]
    return {
        "phases": listed((of_grating[0] for of_grating in measured), ".1f"),
        "phase_error": float(np.degrees(np.abs(off).max())),
        "many": len(many),
        "alone": float(len(single)),
        "irregular": float(period_of_three),
    }


experiment = Experiment.of(run, ASSUMED_RUNS, rising=_modulated, active_sd=_modulated, speed_off=_modulated)
