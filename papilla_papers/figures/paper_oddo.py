"""The 2011 paper on roughness encoding: wavelets of pairs of channels over fine gratings, passive and active touch."""

from dataclasses import replace
from functools import cache

import numpy as np

from papilla.core.units import PER_CENT, UM_PER_MM
from papilla_papers.claims.experiments import wavelets
from papilla_papers.claims.experiments.wavelets import PERIODS_MM, WAVELET_SCENE, RATE_Hz, phase_deg
from papilla_papers.claims.signals import SHARED_SIGNALS, listed, share_of_noise, times
from papilla_papers.figures.picture import Curve, Panel, Picture, PrintedTable, Shade, dashed, printed
from papilla_papers.methods.wavelet import CrossWavelet, RedNoise, cross_wavelet, morlet, octaves

CHANNEL_NAMES = ("P1S4", "P1S1", "P1S2")
STEP_S = wavelets.PASSIVE_TOUCH.rest_s + wavelets.PASSIVE_TOUCH.first_s
"""When a passive run changes its speed: 2.0 s, as in print."""
BEGIN_S: float = WAVELET_SCENE.active.begin_s
"""Of the touch in an active record of `active_records`."""
WAVELET_FIGURES = WAVELET_SCENE.figures
SHOWN_WINDOWS, SPEED_STEP = WAVELET_FIGURES.windows, WAVELET_FIGURES.step

Records = tuple[np.ndarray, np.ndarray, np.ndarray]


@cache
def _passive(period: float = WAVELET_FIGURES.period_mm, seed: int = WAVELET_FIGURES.passive_seed) -> Records:
    """S4, S1 and S2 (n,) of a passive run."""
    rng = np.random.default_rng(seed)
    speed = wavelets.passive_speed(times(wavelets.PASSIVE_S, RATE_Hz))
    place = np.cumsum(speed) / RATE_Hz
    first, second, fourth = wavelets.channels(place, period, rng, (0.0, 0.0, WAVELET_SCENE.pitch_mm), speed > 0)
    return fourth, first, second


@cache
def _active(period: float = WAVELET_FIGURES.period_mm, seed: int = WAVELET_FIGURES.active_seed) -> Records:
    """S4, S1 and S2 (n,) of an active run."""
    first, second, fourth = wavelets.active_records(period, np.random.default_rng(seed))[1]
    return fourth, first, second


def _lines(records: Records, title: str, window: tuple[float, float]) -> Panel:
    time = np.arange(len(records[0])) / RATE_Hz
    pairs = enumerate(zip(CHANNEL_NAMES, records, strict=True))
    curves = tuple(Curve(name, time, values, color=k) for k, (name, values) in pairs)
    return Panel(title, "time, s", "output", curves, x_range=window)


def passive_record() -> Picture:
    """Passive touch of a grating of 0.48 mm: the frequency follows the step of the speed.

    Simulated channels of the grating's sine, noise at 20 dB, sampled at 300 Hz; S1 and S2 lie side by side, S4 2.36 mm
    along the path. The plate slides from 0.5 s on at 6.7 mm/s, from 2.0 s at 10 mm/s, until 3.0 s. Right: the step. In
    print the waves are those of a MEMS array, with harmonics and drift.
    """
    records = _passive()
    apart = phase_deg(PERIODS_MM[-1])
    finding = f"S1 and S2 are in phase; S4 is shifted by {apart:.0f} degrees before and after the step, equation (4)."
    windows = {"the run": SHOWN_WINDOWS.run_s, "the step of the speed": SHOWN_WINDOWS.step_s}
    panels = tuple(_lines(records, title, window_s) for title, window_s in windows.items())
    return Picture(panels, columns=2, found=finding)


def _maps(records: Records, window: tuple[float, float], mark: bool) -> tuple[tuple[Panel, ...], list[CrossWavelet]]:
    """Scalograms of three channels and of two pairs; mark : whether t_MP is marked."""
    frequency = octaves(*WAVELET_FIGURES.octaves_Hz)
    time = np.arange(len(records[0])) / RATE_Hz
    rows, columns = slice(None, None, WAVELET_FIGURES.drawn_every), (time >= window[0]) & (time <= window[1])

    def panel(title, power, over, phase=None, at=None) -> Panel:
        value = power[rows][:, columns] / power[:, columns].max()
        shade = Shade(
            time[columns], frequency[rows], value, "power over its greatest", over[rows][:, columns],
            None if phase is None else phase[rows][:, columns],
        )  # fmt: skip
        curves = () if at is None else (dashed(at, frequency[[0, -1]], "t_MP", origin="papilla", color=1),)
        return Panel(title, "time, s", "frequency, Hz", curves, shade, log="y")

    panels, pairs = [], []
    for name, reading in zip(CHANNEL_NAMES, records, strict=True):
        wavelet = morlet(reading, RATE_Hz, frequency)
        level = WAVELET_FIGURES.red_noise_5_percent * RedNoise.of(reading).power(frequency, RATE_Hz)
        panels.append(panel(name, wavelet.power, wavelet.power > level[:, None]))
    for first, second in ((0, 1), (1, 2)):
        pair = cross_wavelet(records[first], records[second], RATE_Hz, frequency)
        at = time[pair.ridge.strongest] if mark else None
        title = f"{CHANNEL_NAMES[first]} - {CHANNEL_NAMES[second]}"
        panels.append(panel(title, np.abs(pair.product), pair.significant, np.angle(pair.product), at))
        pairs.append(pair)
    return tuple(panels), pairs


def passive_maps() -> Picture:
    """Wavelets at the step of the speed: the ridge moves from 13.9 to 20.8 Hz.

    The run of figure 2. Three channels, then two pairs, with the contour of 5 % significance against red noise and, of
    the pairs, arrows of phase: right in phase, left in antiphase, down where the first channel leads by 90 degrees. The
    printed frequencies are points.
    """
    panels, pairs = _maps(_passive(), SHOWN_WINDOWS.step_map_s, False)
    mark = printed("printed", SPEED_STEP.marks_s, SPEED_STEP.printed_Hz)
    marked = tuple(replace(panel, curves=(mark,)) for panel in panels)
    ridge = pairs[1].ridge.frequency_Hz
    ends = [float(np.median(ridge[round(a * RATE_Hz) : round(b * RATE_Hz)])) for a, b in SPEED_STEP.parts_s]
    finding = (
        f"f_MP of P1S1 - P1S2 is {ends[0]:.2f} Hz before and {ends[1]:.2f} Hz after the step (printed 13.9, 20.8)."
    )
    return Picture(marked, columns=2, found=finding)


def _touched(window_s: tuple[float, float]) -> tuple[float, float]:
    """A window after the touch begins, as times of an active record."""
    return BEGIN_S + window_s[0], BEGIN_S + window_s[1]


def active_record() -> Picture:
    """Active touch of a grating of 0.48 mm: it is felt for 150 ms, by both rows of units for 80 ms.

    As figure 2, but the finger moves: its speed rises from 22 to 31 mm/s within 67 ms; distal units feel the grating
    first, the proximal one 35 ms later. Loading and unloading of the finger, which print shows, are not simulated.
    """
    records = _active()
    windows = {"the run": SHOWN_WINDOWS.record_s, "the rub": _touched(SHOWN_WINDOWS.rub_s)}
    panels = tuple(_lines(records, title, window_s) for title, window_s in windows.items())
    return Picture(panels, columns=2)


def active_maps() -> Picture:
    """Wavelets in active touch: the ridge rises with the speed, t_MP is where a pair has most in common.

    The run of figure 4, drawn as figure 3; t_MP of equation (3) is the dashed line. Where t_MP of the pairs differs,
    they feel the grating at different times.
    """
    panels, pairs = _maps(_active(), _touched(SHOWN_WINDOWS.rub_map_s), True)
    windows = [pair.ridge.around_strongest() for pair in pairs]
    words = "; ".join(
        f"{statistics.least_Hz:.1f} to {statistics.greatest_Hz:.1f} Hz ({panel.title})"
        for statistics, panel in zip(windows, panels[len(CHANNEL_NAMES) :], strict=True)
    )
    return Picture(panels, columns=2, found=f"f_MP in the 67 ms around t_MP: {words}.")


def three_gratings() -> Picture:
    """The rub over three gratings in time: S4 is shifted along, by another phase each.

    Active runs as in figure 4 over 0.40, 0.44 and 0.48 mm, with the same noise. Print has the recordings of the MEMS
    array.
    """
    window = _touched(SHOWN_WINDOWS.gratings_s)
    panels = tuple(_lines(_active(period), f"{UM_PER_MM * period:.0f} µm", window) for period in PERIODS_MM)
    words = listed(map(phase_deg, PERIODS_MM), ".0f")
    return Picture(panels, found=f"Phase of S1 before S4 by equation (4): {words} degrees for 400, 440, 480 µm.")


@cache
def _runs() -> list[wavelets.ActiveRun]:
    return wavelets.campaign(WAVELET_FIGURES.campaigns.first)


def _means() -> np.ndarray:
    """Means of f_MP (grating, run, pair)."""
    means = np.array([[window.mean_Hz for window in run.windows] for run in _runs()])
    return means.reshape(len(PERIODS_MM), wavelets.RUNS_A_GRATING, len(TEXTURE_PAIRS))


HZ_DIGITS = 6
"""Decimals of a table in Hz: equal samples have a deviation of zero, not of rounding."""
TEXTURE_PAIRS = ("P1S4, P1S1", "P1S1, P1S2")


def every_run() -> Picture:
    """f_MP around t_MP in 24 active runs: each run rises, their means do not overlap.

    Eight runs a grating, whose speed differs by 1 % from run to run: 20 samples of f_MP around t_MP of each pair, and
    their mean (black). Of the print, that the means part is text; its points are a picture.
    """
    panels = []
    runs = _runs()
    for pair, name in enumerate(TEXTURE_PAIRS):
        curves = []
        for color, period in enumerate(PERIODS_MM):
            samples = [(k, run.frequency_Hz[pair]) for k, run in enumerate(runs) if run.period_mm == period]
            place = np.concatenate([np.full(len(values), k + 1.0) for k, values in samples])
            frequencies = np.concatenate([values for _, values in samples])
            curves.append(Curve(f"{UM_PER_MM * period:.0f} µm", place, frequencies, "points", color=color))
        means = np.array([run.windows[pair].mean_Hz for run in runs])
        curves.append(Curve("mean of a run", np.arange(1.0, len(runs) + 1), means, "points", color=-1))
        panels.append(Panel(f"f_MP ({name})", "run", "frequency, Hz", tuple(curves)))
    means = _means()
    gap = (means.min(axis=1)[:-1] - means.max(axis=1)[1:]).min()
    finding = f"Between the means of neighbouring gratings there is a gap of {gap:.1f} Hz at least."
    return Picture(tuple(panels), found=finding)


def clusters() -> Picture:
    """Means of f_MP of two pairs: three clusters, finer gratings higher.

    The runs of figure 7; ellipses are centred on a cluster, each axis as long as twice the standard deviation, as in
    print.
    """
    curves, turn = [], np.linspace(0, 2 * np.pi, 61)
    means = _means()
    for color, (period, cluster) in enumerate(zip(PERIODS_MM, means, strict=True)):
        curves.append(Curve(f"{UM_PER_MM * period:.0f} µm", cluster[:, 1], cluster[:, 0], "points", color=color))
        centre, (values, axes) = cluster.mean(axis=0), np.linalg.eigh(np.cov(cluster.T))
        edge = centre[:, None] + axes @ (np.sqrt(values)[:, None] * np.stack([np.cos(turn), np.sin(turn)]))
        curves.append(Curve("", edge[1], edge[0], color=color))
    centres = ", ".join(f"{frequency:.1f}" for frequency in means.mean(axis=1)[:, 1])
    panel = Panel("", f"mean f_MP ({TEXTURE_PAIRS[1]}), Hz", f"mean f_MP ({TEXTURE_PAIRS[0]}), Hz", tuple(curves))
    return Picture((panel,), found=f"Centres at {centres} Hz for 400, 440, 480 µm.")


def textiles() -> Picture:
    """Cross-wavelets of S1 and S2 over five textiles in active touch, each with a pattern of its own.

    The paper's textiles are a fine and a coarse denim, each along two directions, and a nap; neither their periods nor
    the recordings are published. Here: made-up weaves with two periods along the stroke, and noise through a Gaussian
    of 0.15 mm for the nap, under the movement of figure 4, noise at 20 dB.
    """
    cloth, every = WAVELET_FIGURES.textiles, WAVELET_FIGURES.drawn_every
    panels, tops = [], []
    for number, (name, periods) in enumerate(cloth.weaves_mm.items()):
        rng = np.random.default_rng(cloth.first_seed + number)
        speed = wavelets.active_records(WAVELET_FIGURES.period_mm, np.random.default_rng(WAVELET_FIGURES.active_seed))[
            0
        ]
        time = np.arange(len(speed)) / RATE_Hz
        place = np.cumsum(speed) / RATE_Hz
        x = np.arange(place[0] - 1, place[-1] + 1, cloth.point_mm)
        if periods:
            strong, weak = (np.sin(2 * np.pi * x / period + 1) for period in periods)
            height = strong + 0.5 * weak + cloth.square * strong**2
        else:
            reach, sigma = round(cloth.nap_reach_mm / cloth.point_mm), cloth.nap_sigma_mm / cloth.point_mm
            window = np.exp(-0.5 * (np.arange(-reach, reach + 1) / sigma) ** 2)
            height = np.convolve(rng.standard_normal(len(x)), window, "same")
        surface = np.interp(place, x, height / height.std())
        inside_s = np.minimum(time - BEGIN_S, BEGIN_S + WAVELET_SCENE.active.encoded_s - time)
        felt = np.clip(inside_s / wavelets.ASSUMED_RUNS.edge_s, 0, 1)
        noise = share_of_noise(SHARED_SIGNALS.snr_dB["2011_oddo"])
        upper, lower = (surface * felt + noise * rng.standard_normal(len(time)) for _ in range(2))
        wavelet = cross_wavelet(upper, lower, RATE_Hz, octaves(*WAVELET_FIGURES.octaves_Hz))
        first, last = _touched(SHOWN_WINDOWS.rub_map_s)
        inside = (time >= first) & (time <= last)
        value = np.abs(wavelet.product)[::every][:, inside]
        shade = Shade(time[inside], wavelet.frequency_Hz[::every], value / value.max(), "power over its greatest",
                      wavelet.significant[::every][:, inside])  # fmt: skip
        panels.append(Panel(name, "time, s", "frequency, Hz", shade=shade, log="y"))
        tops.append(float(wavelet.frequency_Hz[::every][value.max(axis=1).argmax()]))
    words = ", ".join(f"{name[0]} {top:.0f}" for name, top in zip(cloth.weaves_mm, tops, strict=True))
    return Picture(tuple(panels), columns=2, found=f"Frequency of the greatest common power: {words} Hz.")


def expected() -> Picture:
    """Expected frequencies of passive touch, v / p.

    Both speeds of the plate over the periods of the three gratings; frequencies that stand in the paper's text are
    beside them.
    """
    printed_Hz = {(period, speed): f"{value:g}" for period, speed, value in WAVELET_FIGURES.expected.printed}
    rows: list[tuple[str | float, ...]] = []
    for period in PERIODS_MM:
        micrometres = round(UM_PER_MM * period)
        cells = [(speed / period, printed_Hz.get((micrometres, n), "")) for n, speed in enumerate(wavelets.SPEEDS_MM_S)]
        rows.append((f"{micrometres}", *cells[0], *cells[1]))
    heads = ("period, µm", "at 6.7 mm/s, Hz", "printed", "at 10.0 mm/s, Hz", "printed")
    return Picture(table=PrintedTable(heads, tuple(rows)))


INDEX_HEADS = ("mean, Hz", "deviation, Hz", "mean greatest, Hz", "mean least, Hz")


def _in_Hz(indices) -> list[float]:
    return [round(float(index), HZ_DIGITS) for index in indices]


def passive_table() -> Picture:
    """Statistics of f_MP in passive touch.

    Eight runs a grating as in figure 2; 200 samples (667 ms) at each speed, of the pairs (S4, S1) and (S1, S2). The
    paper's deviations are at most 1.6 % of the mean (0.4 Hz of 25.0); its other numbers are lost in the text at hand.
    """
    rows: list[tuple[str | float, ...]] = []
    worst = 0.0
    setup, frequencies = WAVELET_FIGURES.passive_table, octaves(*WAVELET_FIGURES.octaves_Hz)
    reached = zip((wavelets.PASSIVE_TOUCH.rest_s, STEP_S), setup.after_s, strict=True)
    begins = [round((at + after) * RATE_Hz) for at, after in reached]
    for period in PERIODS_MM:
        ridges = []
        for run in range(wavelets.RUNS_A_GRATING):
            fourth, first, second = _passive(period, setup.first_seed + run)
            pairs = ((fourth, first), (first, second))
            ridges.append([cross_wavelet(*pair, RATE_Hz, frequencies).ridge.frequency_Hz for pair in pairs])
        values = np.array(ridges)
        for speed, begin in zip(wavelets.SPEEDS_MM_S, begins, strict=True):
            for pair, name in enumerate(TEXTURE_PAIRS):
                cells = wavelets.indices(values[:, pair, begin : begin + setup.samples])
                rows.append((f"{UM_PER_MM * period:.0f} µm", f"{speed:.2g} mm/s", name, *_in_Hz(cells)))
                worst = max(worst, PER_CENT * cells[1] / cells[0])
    heads = ("grating", "speed", "pair", *INDEX_HEADS)
    finding = f"Largest deviation: {worst:.1f} % (printed at most 1.6 %)."
    return Picture(table=PrintedTable(heads, tuple(rows)), found=finding)


def active_table() -> Picture:
    """Statistics of f_MP in active touch.

    The runs of figure 7, the 20 samples around t_MP of each. The largest deviation of the print is 8.3 % (5.5 Hz of
    65.9); its other numbers are lost in the text at hand.
    """
    table = wavelets.table_3(_runs())
    rows: list[tuple[str | float, ...]] = [
        (f"{UM_PER_MM * period:.0f} µm", name, *_in_Hz(table[k, pair]))
        for k, period in enumerate(PERIODS_MM)
        for pair, name in enumerate(TEXTURE_PAIRS)
    ]
    worst = PER_CENT * float((table[..., 1] / table[..., 0]).max())
    finding = f"Largest deviation: {worst:.1f} % (printed 8.3 %)."
    return Picture(table=PrintedTable(("grating", "pair", *INDEX_HEADS), tuple(rows)), found=finding)


def neighbours() -> Picture:
    """Share of gratings that a nearest neighbour names right, against the runs left out.

    Features are the mean f_MP of two pairs in 24 active runs, leave-M-out over 1000 random splits (10,000 in print),
    one neighbour. The number measures how well the speed repeats from run to run, which is not published.
    """
    assumed_spread = wavelets.ASSUMED_RUNS.speed_spread
    seed = WAVELET_FIGURES.campaigns.other_spreads
    sets = {
        spread: _runs()
        if spread == assumed_spread
        else wavelets.campaign(seed, replace(wavelets.ASSUMED_RUNS, speed_spread=spread))
        for spread in WAVELET_SCENE.spreads
    }
    printed = dict(WAVELET_FIGURES.neighbours.printed)
    rows: list[tuple[str | float, ...]] = [
        (
            f"{left_out}",
            f"{wavelets.RUNS_A_GRATING - left_out // len(PERIODS_MM)}",
            *(wavelets.accuracy(runs, left_out) for runs in sets.values()),
            f"{printed[left_out]:g}" if left_out in printed else "",
        )
        for left_out in WAVELET_FIGURES.neighbours.left_out
    ]
    heads = (
        "left out",
        "runs a grating",
        *(f"speed ± {PER_CENT * spread:g} %, % right" for spread in WAVELET_SCENE.spreads),
        "printed",
    )
    finding = f"With one run a grating and a speed that repeats to 1 %: {rows[-1][3]:.1f} % (printed 97.6 %)."
    return Picture(table=PrintedTable(heads, tuple(rows)), found=finding)
