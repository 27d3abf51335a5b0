"""Small parts of the search for a wavelength, each against its closed form or the same number by another way."""

import numpy as np
import pytest

from papilla.estimators.wavelength.fundamental import hints
from papilla.estimators.wavelength.spectrum import (
    Line,
    Spectrum,
    background,
    highest_shown,
    middle,
    share_of,
    size_of,
    slope,
    vertex,
)


def flat_spectrum(bumps, seed=0):
    """Noise of mean 1 with the given powers at wavenumbers; a resolution is 0.04 / mm."""
    power = np.random.default_rng(seed).exponential(size=600)
    for wavenumber, size in bumps.items():
        power[round(wavenumber / 0.01)] = size
    return Spectrum(power, power[None], np.ones(1), 0.01, 4.0)


CHOSEN = Line(1.2, 400.0, 20.0, 1e-12)


@pytest.mark.parametrize(
    "bumps, divisor, lines, lowest, hinted",
    [
        ({}, 2, [], 0.1, False), ({0.6: 60.0}, 2, [], 0.1, True), ({0.6: 60.0}, 3, [], 0.1, False),
        ({0.4: 60.0}, 3, [], 0.1, True), ({0.8: 60.0}, 3, [], 0.1, True), ({1.8: 60.0}, 2, [], 0.1, True),
        ({1.8: 60.0}, 2, [], 0.7, False), ({0.6: 60.0}, 2, [], 0.7, True), ({2.4: 60.0}, 2, [], 0.1, False),
        ({3.0: 60.0}, 2, [], 0.1, True), ({3.6: 60.0}, 2, [], 0.1, False),
        ({0.6: 60.0}, 2, [Line(0.62, 50.0, 7.0, 1e-6)], 0.1, False),
        ({0.6: 60.0}, 2, [Line(0.7, 50.0, 7.0, 1e-6)], 0.1, True), ({1.8: 20.0}, 2, [], 0.1, False),
    ],
)  # fmt: skip
def test_a_hint_is_more_than_noise_where_a_multiple_of_a_lower_fundamental_would_be(
    bumps, divisor, lines, lowest, hinted
):
    """Up to the multiple 2 divisor + 1, none of them those of a lower divisor; below the range the first alone; a
    quarter of the amplitude at least, of which 20 has a power of 25."""
    for seed in (0, 1):
        quiet = flat_spectrum(bumps, seed)
        assert hints(quiet, [CHOSEN, *lines], CHOSEN, divisor, 0.08, lowest) == hinted


def test_helpers_are_numpys_and_sizes_powers_of_two():
    rng = np.random.default_rng(4)
    for count in (2, 7, 40):
        values = rng.normal(size=count)
        assert slope(values) == pytest.approx(np.gradient(values)) and middle(values) == pytest.approx(
            np.median(values)
        )
        assert share_of(values, 0.7) == np.sort(values)[int(0.7 * (count - 1))]
    assert middle(np.empty(0)) == 0.0
    assert [size_of(extent, 0.1) for extent in (39.9, 40.1, 80.1)] == [1024, 1024, 2048]
    place = np.concatenate([np.arange(0, 9, 0.1), [11.0, 14.0]])
    assert highest_shown(place) == pytest.approx(4.5) and highest_shown(place, 0.5) == pytest.approx(0.9)
    assert vertex([1.0, 4.0, 1.0]) == 0 and vertex([0.0, 4.0, 1.0]) == vertex([4.0, 1.0, 4.0]) == 0
    assert vertex(np.exp(-((np.array([-1, 0, 1]) - 0.3) ** 2))) == pytest.approx(0.3)


def test_the_chance_of_a_power_is_that_of_the_greatest_within_half_a_resolution():
    quiet = flat_spectrum({1.0: 40.0})
    (expected,) = background(quiet.power, np.array([100]), 4.0, pooled=False).chance(np.array([40.0]))
    assert quiet.chance(1.0) == quiet.chance(1.02) == quiet.chance(0.98) == pytest.approx(expected)
    assert expected < 1e-4 and quiet.chance(1.03) > 1e3 * expected and quiet.chance(20.0) == 1.0
    tops = quiet.tops(1, 599)
    assert 100 in tops and np.diff(tops).min() > 8
    assert all(quiet.power[max(top - 8, 0) : top + 9].max() == quiet.power[top] for top in tops.tolist())
