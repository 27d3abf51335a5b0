"""What must not matter: units of path and readings, where the path begins, which way it goes, the order of gauges.

Powers of two scale without rounding, so that answers agree to the last bits.
"""

import numpy as np
import pytest

from papilla.estimators import LineTracker
from papilla.estimators.wavelength.lines import find_lines

RANGE_MM = (0.8, 6.0)
GAIN, UNIT = 1024.0, 1 / 64


@pytest.fixture(scope="module")
def log():
    """position (n,) with uneven steps, and readings (n, 3): a line that grows out of noise, and then another one."""
    rng, n = np.random.default_rng(0), 800
    position = np.cumsum(0.2 * (1 + 0.2 * rng.uniform(-1, 1, n)))
    share = np.arange(n) / n
    size = np.where(share < 0.6, 3.0 * share, 0.0)[:, None] * (1.0, 0.7, 1.3)
    late = np.array([0.0, 0.4, -0.7])
    first = size * np.sin(2 * np.pi * (position[:, None] - late) / 1.7)
    second = np.where(share < 0.6, 0.0, 1.6)[:, None] * np.sin(2 * np.pi * (position[:, None] - late) / 2.6)
    return position, first + second + rng.standard_normal((n, 3))


def followed(position, readings, low_high=RANGE_MM):
    return LineTracker(readings.shape[1], wavelength_range_mm=low_high).process(np.column_stack([readings, position]))


def assert_same(found, other, unit=1.0, rel=1e-9):
    """The second answers are the first in another unit, status by status."""
    assert (found.status == other.status).all() and len(set(found.status.tolist())) > 2
    np.testing.assert_allclose(other.wavelength_mm, unit * found.wavelength_mm, rtol=rel)
    np.testing.assert_allclose(other.wavelength_sigma_mm, unit * found.wavelength_sigma_mm, rtol=100 * rel)


@pytest.fixture(scope="module")
def plain(log):
    position, readings = log
    return followed(position, readings[:, :1])


@pytest.mark.parametrize("unit", [UNIT, 1.0])
def test_a_line_is_followed_in_any_unit_of_path_and_reading(log, plain, unit):
    position, readings = log
    scaled = tuple(unit * end for end in RANGE_MM)
    assert_same(plain, followed(unit * position, GAIN * readings[:, :1], scaled), unit)


def test_where_the_path_begins_and_which_way_it_goes_do_not_matter(log, plain):
    position, readings = log
    assert_same(plain, followed(4096.0 + position, -readings[:, :1]))
    back = followed(4096.0 - position[:500], readings[:500, :1])
    assert (back.status[-10:] == plain.status[490:500]).all()
    assert back.wavelength_mm[-1] == pytest.approx(plain.wavelength_mm[499], rel=1e-3)


def test_gauges_count_by_their_noise_not_by_their_unit_or_place(log):
    position, readings = log[0][:470], log[1][:470]
    once = followed(position, readings)
    other = followed(position, np.array([1.0, GAIN, 1 / GAIN]) * readings[:, [2, 0, 1]])
    assert once.sentence[-1].startswith("ok") and (other.status == once.status).mean() > 0.85
    np.testing.assert_allclose(other.wavelength_mm[-50:], once.wavelength_mm[-50:], rtol=2e-3)
    np.testing.assert_allclose(other.wavelength_sigma_mm[-50:], once.wavelength_sigma_mm[-50:], rtol=0.5)


def test_a_gauge_that_feels_no_texture_however_loud_hides_none(log):
    position, readings = log[0][:470], 2 * log[1][:470, 0]
    noise = np.random.default_rng(1).standard_normal(len(position))
    once, loud = (followed(position, np.column_stack([readings, size * noise])) for size in (1.0, GAIN))
    assert loud.wavelength_mm[-1] == pytest.approx(1.7, rel=5e-3)
    np.testing.assert_allclose(loud.wavelength_mm, once.wavelength_mm, rtol=1e-9)


def lines_of(position, readings, low_high=(1.0, 6.0)):
    found = find_lines(position, readings, wavelength_range_mm=low_high)
    return np.array([(line.wavelength_mm, line.sigma_mm, line.amplitude) for line in found.lines]).reshape(-1, 3)


def test_lines_of_a_log_are_the_same_in_any_unit_order_and_direction(log):
    position, readings = log[0][480:], log[1][480:]
    once = lines_of(position, readings)
    assert len(once) and once[0, 0] == pytest.approx(2.6, rel=5e-3)
    unit = lines_of(UNIT * position, GAIN * readings, (UNIT, 6 * UNIT))
    np.testing.assert_allclose(unit, once * (UNIT, UNIT, GAIN), rtol=1e-9)
    turned = lines_of(100 - position, readings[:, [1, 2, 0]] + 5.0)
    np.testing.assert_allclose(turned, once, rtol=0.01)
    np.testing.assert_allclose(turned[:, 0], once[:, 0], rtol=2e-4)
