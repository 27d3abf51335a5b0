"""Scenes in numbers: what each part makes against a closed form, and what a scene says about itself."""

import math
from dataclasses import replace

import numpy as np
import pytest

from papilla.references.bounds import wavelength_bound
from papilla.scenes import parts as parts
from papilla.scenes.parts import SCENE_HARMONICS, profile_amplitudes
from papilla.scenes.scenes import WAVELENGTHS_MM, scene

ORDERS = np.arange(1, SCENE_HARMONICS + 1)
FACTOR = 1.5
"""How far a parameter is drawn from its value where its rule says nothing."""


def draft_of(seed=5, drawn=False, speed=100.0, rate=1000.0, seconds=1.0, asked=1.2):
    """At a constant speed, with a texture of 1 on two gauges 0.3 mm apart."""
    time = np.arange(round(seconds * rate)) / rate
    made = parts.Draft(np.random.default_rng(seed), drawn, rate, time, np.array([0.0, 0.3]), asked)
    parts.constant(made, speed, 0.0)
    made.texture = np.ones((time.size, 2))
    return made


def waves(draft, wavelength, amplitudes):
    """(n, g) real part of a sum of harmonics over the place of the skin under each gauge."""
    place = draft.skin[:, None] + draft.offsets_mm
    return np.real(sum(a * np.exp(-2j * np.pi * k * place / wavelength) for k, a in enumerate(amplitudes, start=1)))


def drawn_sizes(make):
    """Sizes that 200 drafts give, in logarithms of `FACTOR`."""
    return np.log([make(draft_of(seed, True)) for seed in range(200)]) / math.log(FACTOR)


@pytest.mark.parametrize("duty, skin_mm", [(0.5, 0.1), (0.3, 0.1), (0.5, 0.3)])
def test_the_felt_profile_is_a_trapezoid_averaged_by_the_skin(duty, skin_mm):
    """In place, not only in size: the trapezoid's own harmonics, each weakened by a Gaussian."""
    draft = draft_of(speed=10.0)
    draft.skin = draft.skin + 0.4
    parts.grating(draft, duty=duty, skin_mm=skin_mm)
    x = (np.arange(1 << 14) + 0.5) / (1 << 14)
    trapezoid = np.interp(x, [0, 0.08, duty, duty + 0.15, 1], [0, 1, 1, 0, 0])
    felt = (
        np.exp(2j * np.pi * np.outer(ORDERS, x)) @ trapezoid * np.exp(-0.5 * (2 * np.pi * ORDERS * skin_mm / 1.2) ** 2)
    )
    felt *= math.sqrt(2 / np.sum(np.abs(felt) ** 2))
    assert profile_amplitudes(1.2, duty, skin_mm) == pytest.approx(felt, abs=1e-6)
    assert draft.texture == pytest.approx(waves(draft, 1.2, felt), abs=1e-5)


def test_steps_and_two_lines_are_made_of_gratings():
    pieces = {}
    for wavelength in (1.2, 4.0, 0.8):
        alone = draft_of()
        parts.grating(alone, times=wavelength / 1.2)
        pieces[wavelength] = alone.texture
    draft = draft_of()
    parts.step(draft, 0.7, 4.0, 2.0)
    assert (draft.texture == np.where(draft.time_s[:, None] < 0.4995, pieces[1.2], pieces[4.0])).all()
    parts.two_lines(draft, 2 / 3)
    assert draft.texture == pytest.approx((pieces[1.2] + pieces[0.8]) / math.sqrt(2))
    assert draft.others_mm == pytest.approx((0.8, 2.4))
    parts.out_of_range(draft, 4.0)
    assert draft.texture == pytest.approx(pieces[4.0]) and np.isnan(draft.wavelength).all()


def test_a_period_without_its_fundamental_has_two_strong_harmonics_that_are_drawn():
    """Four pairs; in every second draw the others are faint, in the rest they are absent."""
    pairs, seen, faint = [(2, 3), (2, 5), (3, 4), (3, 5)], set(), []
    for seed in range(80):
        draft = draft_of(seed, True, asked=4.0)
        parts.hollow(draft, 2.0, (0.0, 1.0, 0.8, 0.1, 0.3), pairs, 0.2, (0.3, 1.0))
        assert (draft.wavelength == 8.0).all()
        turns = np.outer(np.arange(1, 7), draft.position) / 8.0
        rows = slice(0, 960)  # 12 periods
        size = np.abs(np.exp(2j * np.pi * turns[:, rows]) @ draft.texture[rows, 0]) / 480
        first, second = np.sort(np.argsort(size)[-2:]) + 1
        seen.add((first, second))
        assert size[0] < 1e-9 > size[5] and 0.28 < size[first - 1] / size[second - 1] < 3.4
        rest = np.delete(size, [0, first - 1, second - 1, 5])
        faint.append(rest.max() / size.max())
        assert (
            np.sum(size**2) == pytest.approx(2) and rest.max() <= 0.2 / 0.3 * size[[first - 1, second - 1]].min() + 1e-9
        )
    assert seen == set(pairs) and 0.3 < np.mean(np.array(faint) > 1e-9) < 0.7 and 0.1 < max(faint) < 0.67
    draft = draft_of(asked=4.0)
    parts.hollow(draft, 2.0, (0.0, 1.0, 0.8, 0.1, 0.3), pairs, 0.2, (0.3, 1.0))
    size = np.abs(np.exp(2j * np.pi * np.outer(ORDERS, draft.position[:960]) / 8.0) @ draft.texture[:960, 0])
    assert size / size[1] == pytest.approx([0, 1, 0.8, 0.1, 0.3, 0, 0, 0, 0], abs=1e-9)


def test_a_rough_surface_has_its_slope_its_longest_wave_and_its_skin():
    """Power over wavenumber, mean of 60 surfaces: flat above 10 mm, then with the 4th power; a Gaussian of the skin."""

    def power(slope, skin_mm, longest_mm, drawn=False):
        mean = np.zeros(501)
        for seed in range(60):
            draft = draft_of(seed, drawn, seconds=1.0)
            parts.rough(draft, skin_mm, slope, 0.02, 3.0, longest_mm)
            mean += np.abs(np.fft.rfft(draft.texture[:, 0] * np.hanning(1000))) ** 2
        return mean / 60  # at k / 100 mm

    steep = power(2.0, 1e-3, 10.0)
    assert steep[3:6].mean() / steep[7:10].mean() == pytest.approx(1, abs=0.25)
    assert steep[14:17].mean() / steep[28:33].mean() == pytest.approx(16, rel=0.25)
    white, averaged, varied = power(0.0, 1e-3, 30.0), power(0.0, 0.3, 30.0), power(0.0, 0.3, 30.0, True)
    weaker = [(mean[60:80] / mean[15:25].mean()).mean() / (white[60:80] / white[15:25].mean()).mean()
              for mean in (averaged, varied)]  # fmt: skip
    assert weaker[0] == pytest.approx(math.exp(-((2 * math.pi * 0.3) ** 2) * (0.7**2 - 0.2**2)), rel=0.4)
    assert 0.1 < weaker[1] < 0.7, "a thinner skin in every second draw"


def test_hum_and_counts_are_exact():
    draft = draft_of()
    parts.hum(draft, 60.0, 0.4, 1.5, 0.25)
    turns = 2 * np.pi * 60 * draft.time_s + 0.4
    assert (
        draft.added == pytest.approx(1.5 * 2**0.5 * (np.sin(turns) + 0.25 * np.sin(3 * turns))) and draft.mains_Hz == 60
    )
    parts.strokes(draft, 80.0, 2.0)
    assert draft.velocity == pytest.approx(80 * np.sin(4 * np.pi * draft.time_s))
    parts.counted(draft, 0.05)
    counts = np.floor(draft.position / 0.05)
    assert np.cumsum(draft.known) / 1000 == pytest.approx(0.05 * (counts - counts[0])) and draft.known[0] == 0


@pytest.mark.parametrize("ms, rate, samples", [(10, 1000.0, 10), (1, 200.0, 1), (12, 200.0, 2), (13, 200.0, 3)])
def test_an_encoder_is_late_by_whole_samples_and_at_least_by_one(ms, rate, samples):
    draft = draft_of(rate=rate)
    draft.known = np.arange(draft.time_s.size, dtype=float)
    parts.late(draft, ms)
    assert draft.known.tolist() == [*[0.0] * samples, *np.arange(draft.time_s.size - samples, dtype=float)]


def test_drawn_sizes_reach_to_their_factor_on_both_sides():
    def spikes(draft):
        parts.spikes(draft, 0.5, 1.0)
        assert set(np.sign(draft.added)) == {-1, 0, 1} and 0.4 < np.mean(draft.added != 0) < 0.6
        return np.abs(draft.added).max()

    def force(draft):
        parts.force(draft, 1.0, 0.3, 0.1, 0.1)
        return draft.added.std()

    for make, most in ((spikes, math.log(2) / math.log(FACTOR)), (force, 1.0)):
        sizes = drawn_sizes(make)
        assert most * 0.95 < sizes.max() <= most + 1e-9 and -most - 1e-9 <= sizes.min() < -most * 0.95
    slow = draft_of(seconds=40.0)
    parts.force(slow, 1.0, 0.3, 0.1, 0.1)
    later = np.corrcoef(slow.added[:-200], slow.added[200:])[0, 1]
    assert later == pytest.approx(math.exp(-1), abs=0.12), "0.2 s later, twice the deviation of the Gaussian"


def test_presses_have_sizes_of_their_range_to_both_sides():
    draft = draft_of(seconds=100.0)
    parts.steps(draft, 0.5, 0.25, (1.5, 4.0), 0.02)
    sizes = np.diff(draft.added[::500])
    assert 1.5 <= np.abs(sizes).min() < 1.6 and 3.8 < np.abs(sizes).max() <= 4 and 0.4 < np.mean(sizes > 0) < 0.6


def test_teeth_scatter_about_their_length():
    """Lognormal lengths: the medians of 1000 teeth and the deviation of their logarithm."""
    draft = draft_of(seconds=50.0)
    parts.stick_slip(draft, 5.0, 0.3, 1.0)
    slips = draft.position[np.flatnonzero(np.diff(draft.added) < -1)]
    lengths = np.log(np.diff(slips) / 5)
    assert np.median(lengths) == pytest.approx(0, abs=0.05) and lengths.std() == pytest.approx(0.3, rel=0.1)
    assert draft.added.min() == pytest.approx(-math.sqrt(3), abs=0.1) and draft.added.max() == pytest.approx(
        3**0.5, abs=0.1
    )


# ---- What a scene says about itself


def test_a_scene_has_its_defaults_and_follows_its_seed():
    made = scene("const", 1.8)
    assert made.time_s == pytest.approx(np.arange(4000) / 1000) and made.noise_sd == pytest.approx(0.1)
    assert (made.readings == scene("const", 1.8, seed=0).readings).all() and made.readings.shape == (4000, 1)
    noise = made.readings - made.signal
    assert noise.std() == pytest.approx(0.1, rel=0.05) and abs(noise.mean()) < 0.01
    assert scene("const", 1.8, snr_dB=6).noise_sd == pytest.approx(10**-0.3)
    board = scene("slow board", 1.0)
    assert board.time_s.size == round(35.6 * 12) and board.wavelength_mm[0] == 1.9 and board.sample_rate_Hz == 35.6
    assert scene("const", 1.8, sample_rate_Hz=500.0, seconds=2.0).time_s[-1] == pytest.approx(1.998)
    changed = scene("const", 1.8, step_to_mm=2.5)
    assert np.flatnonzero(np.diff(changed.wavelength_mm)).tolist() == [1999] and changed.wavelength_mm[-1] == 2.5
    tuned, claims = (
        [scene("strokes, hum", 1.8, seed=seed, seconds=0.5, drawn=drawn) for seed in range(30)]
        for drawn in (False, True)
    )
    assert {np.abs(one.velocity_mm_s).max() for one in tuned} == {np.abs(tuned[0].velocity_mm_s).max()}
    peaks = [np.abs(one.velocity_mm_s).max() for one in claims]
    assert 100 / 1.3 <= min(peaks) < 90 < 110 < max(peaks) <= 130 and {one.mains_Hz for one in claims} == {50.0, 60.0}
    assert np.diff(WAVELENGTHS_MM) == pytest.approx(0.6) and made.travelled_mm[0] == 0
    back = scene("act1", 1.8, seconds=1.0)
    assert back.travelled_mm[-1] == pytest.approx(np.abs(np.diff(back.position_mm)).sum())
    assert np.flatnonzero(made.judged()).tolist() == list(range(1001, 4000))


@pytest.mark.parametrize("path_mm, window_s", [(None, 0.2), (15.0, None)])
def test_the_bound_is_the_median_over_windows_that_end_in_judged_rows(path_mm, window_s):
    made = scene("act1", 1.8, seed=2, seconds=2.0)
    along, size = (made.time_s, window_s or 0.0) if path_mm is None else (made.travelled_mm, path_mm)
    present = made.frequency_Hz[:, None] * ORDERS < 400
    ends = [end for end in np.flatnonzero(made.judged()) if along[end] >= size]
    expected = []
    for end in ends[:: len(ends) // 7]:
        rows = (along >= along[end] - size - 1e-9) & (np.arange(2000) < end)
        found = wavelength_bound(made.position_mm[rows], 1.8, profile_amplitudes(1.8), made.noise_sd, present[rows])
        expected.append(found)
    assert made.bound(window_s, path_mm, count=7) == pytest.approx(np.median(expected), rel=1e-9)


@pytest.mark.parametrize("way", [1, -1])
@pytest.mark.parametrize(
    "line_Hz, resolutions, mains, told",
    [
        (150, 0.95, None, False), (150, 1.05, None, True), (150, -0.95, None, False), (180, 0.9, None, False),
        (60, 0.9, None, False), (50, 1.1, None, True), (480, 0.9, None, False), (500, 0.0, None, True),
        (50, 2.9, 50.0, False), (50, 3.1, 50.0, True), (60, 2.9, 50.0, True), (300, 2.0, 50.0, False),
        (250, 2.0, 50.0, False), (350, 2.0, 50.0, True), (75, 0.0, 50.0, True), (50, 1.1, 60.0, True),
    ],
)  # fmt: skip
def test_a_line_must_be_apart_from_the_mains_and_from_what_hum_hides(way, line_Hz, resolutions, mains, told):
    """At 100 mm/s over 100 mm the resolution is 1 Hz; hum hides a line whose first to sixth part is within three."""
    rows = np.arange(100)
    made = scene("const", 1.8, seconds=0.1)
    line = 100 / (line_Hz + resolutions)
    made = replace(made, velocity_mm_s=np.full(100, 100.0 * way), mains_Hz=math.nan if mains is None else mains)
    half = replace(made, wavelength_mm=np.where(rows < 50, line, np.nan))
    assert half.tellable(np.full(100, 100.0)).tolist() == [told] * 50 + [True] * 50, (
        "where there is no line, all is told"
    )
    faster = replace(half, velocity_mm_s=half.velocity_mm_s + np.linspace(0, 0.5, 100))
    assert faster.tellable(np.full(100, 100.0)).all(), "a speed that changes tells them apart"
    to_and_fro = scene("act1", 1.8, seconds=0.1)
    assert to_and_fro.tellable(np.full(100, 100.0)).all(), "over the path the hum is no line"
