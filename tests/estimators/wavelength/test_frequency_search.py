"""The search for a frequency in a window, and the test whether what it found is a harmonic, on waves with a truth."""

import math

import numpy as np
import pytest

from papilla.estimators.stream import completed
from papilla.estimators.wavelength.frequency_search import FrequencySearch, SubharmonicTest

RATE, COUNT = 1000.0, 133
TIME = (np.arange(COUNT) - 0.5 * (COUNT - 1)) / RATE


def chirped(frequency, chirp=0.0, noise=0.02, sizes=(1.0, 0.3)):
    """(133,) readings whose frequency in the middle of the window is this one, and rises by `chirp` of it a second."""
    turns = 2 * np.pi * frequency * (TIME + 0.5 * chirp * TIME**2)
    waves = sum(size * np.cos(n * turns + 0.4 * n) for n, size in enumerate(sizes, 1))
    return 5.0 + waves + noise * np.random.default_rng(2).standard_normal(COUNT)


def fitted(readings):
    """The best fit of a search, and its price."""
    return completed(FrequencySearch(readings, TIME, 15.0, 400.0, RATE).run())


@pytest.mark.parametrize("frequency, chirp", [(60.0, 0.0), (90.0, 2.0), (45.0, -5.0), (150.0, 2.0), (110.0, -9.0)])
def test_a_search_finds_a_chirp_in_the_middle_of_its_window(frequency, chirp):
    readings = chirped(frequency, chirp)
    best, price = fitted(readings)
    assert best.motion[1] == pytest.approx(frequency, rel=0.01)
    assert best.motion[2] == pytest.approx(frequency * chirp, abs=0.6 * frequency)
    assert best.noise == pytest.approx(0.02**2, rel=0.6) and best.proved and math.isfinite(price)
    # In pieces that are small enough for a loop.
    assert sum(1 for _ in FrequencySearch(readings, TIME, 15.0, 400.0, RATE).run()) < 400
    back, _ = fitted(readings[::-1].copy())
    assert abs(back.motion[1]) == pytest.approx(best.motion[1], rel=5e-3)
    assert back.motion[2] / back.motion[1] == pytest.approx(-best.motion[2] / best.motion[1], abs=0.25)


@pytest.mark.parametrize("frequency", [45.0, 70.0])
@pytest.mark.parametrize("sizes", [(0.4, 1.0), (0.4, 0.0, 1.0)])
def test_a_wave_whose_harmonic_is_louder_has_the_fundamental_s_frequency(frequency, sizes):
    assert fitted(chirped(frequency, sizes=sizes))[0].motion[1] == pytest.approx(frequency, rel=0.01)


def test_what_holds_no_wave_has_no_fit():
    rng = np.random.default_rng(3)
    few = np.where(np.arange(COUNT) < 31, chirped(60.0), np.nan)
    for readings in (rng.standard_normal(COUNT), np.full(COUNT, 3.0), np.full(COUNT, np.nan), few):
        assert fitted(readings) == (None, math.inf)
    gaps = chirped(60.0, 2.0)
    gaps[[5, 40, 41, 42, 90, 128]] = np.nan
    best, _ = fitted(gaps)
    assert best.motion[1] == pytest.approx(60.0, rel=0.01) and best.noise == pytest.approx(0.02**2, rel=0.6)


def subharmonic(followed, sizes, noise, turns):
    """Share of the followed frequency that is another possible one, of a wave whose harmonics 1, 2 ... are so large."""
    waves = sum(size * np.cos(2 * np.pi * n * turns + n) for n, size in enumerate(sizes, 1))
    readings = 5.0 + waves + noise * np.random.default_rng(3).standard_normal(len(turns))
    return completed(SubharmonicTest(followed * turns, readings, 0.1).run())


@pytest.mark.parametrize(
    "followed, sizes, expected",
    [
        (1, (1.0, 0.5, 0.3), 0.0), (3, (0.0, 0.0, 1.0, 0.0, 0.0, 0.4), 0.0),
        (3, (0.15, 0.0, 1.0, 0.0, 0.0, 0.4), 1 / 3), (3, (0.0, 0.3, 1.0), 1 / 3),
        (2, (0.0, 1.0, 0.0, 0.7, 0.6), 1 / 2),
    ],
)  # fmt: skip
def test_what_may_be_a_harmonic_names_the_other_frequency(followed, sizes, expected):
    """Of a movement one way, and there and back; from 20 readings nothing is known."""
    for turns in (np.linspace(0, 60, 1000), 30 - np.abs(np.linspace(-30, 30, 1000))):
        assert subharmonic(followed, sizes, 0.1, turns) == pytest.approx(expected)
        assert math.isnan(subharmonic(followed, sizes, 0.1, turns[:20]))


@pytest.mark.parametrize("weak, expected", [(0.06, 1 / 2), (0.0, 0.0)])
def test_a_wave_too_weak_for_a_line_still_names_the_lower_frequency(weak, expected):
    """Odd harmonics of half the followed frequency, under noise in which a search finds no line of them."""
    sizes = (weak, 1.0, weak, 0.0, weak)
    assert subharmonic(2, sizes, 0.3, np.linspace(0, 60, 1000)) == pytest.approx(expected)
