"""What time makes of readings beside the surface: what is taken out, what is left, and whose energy it is."""

import numpy as np
import pytest

from papilla.estimators.stream import completed
from papilla.estimators.wavelength.spectrum import Line, Strokes, spectrum_of, strokes_of
from papilla.estimators.wavelength.time_lines import credits_of, levelled, silenced

TIME = np.arange(900) / 1000
BENT = 80 * TIME + 12 * TIME**2
STRAIGHT = 80 * TIME
K = 0.5


def line(frequency, amplitude=1.0, ratio=100.0):
    return Line(frequency, ratio, amplitude, 1e-9)


def strokes(readings, place=BENT, begin=(0, 900)):
    return completed(strokes_of(place, np.asarray(readings, float).reshape(900, -1), np.array(begin)))


def hum(size, frequency=61.0, phase=0.3):
    return size * np.cos(2 * np.pi * frequency * TIME + phase)


def surface(place=BENT, sizes=(1.0, 0.3)):
    return sum(size * np.cos(2 * np.pi * n * K * place + n) for n, size in enumerate(sizes, 1))


def left(own, of):
    """Standard deviation under the taper of what remains beside `of`, over the inner part."""
    rest = own.readings[100:800, 0] - of.readings[100:800, 0]
    return float(np.std(rest))


@pytest.mark.parametrize("size, taken", [(0.36, True), (0.30, False), (3.0, True)])
def test_a_line_over_time_is_taken_out_where_it_has_a_tenth_of_the_surfaces_energy(size, taken):
    """1 + 0.3^2 of it: from an amplitude of 0.33 on."""
    plain = strokes(surface())
    found = completed(silenced(strokes(surface() + hum(size)), TIME, [line(61.0)], K))
    assert (left(found, plain) < 0.1 * size) == taken
    if not taken:
        np.testing.assert_array_equal(found.readings, strokes(surface() + hum(size)).readings)


def test_each_stroke_has_phases_of_its_own_and_what_is_missing_stays_so():
    place = np.where(np.arange(900) < 450, BENT, 2 * BENT[450] - BENT)
    wave = surface(place)
    turned = np.where(np.arange(900) < 450, hum(2.0), hum(2.0, phase=2.5))
    readings = wave + turned
    readings[200:230] = np.nan
    wave[200:230] = np.nan
    found = completed(silenced(strokes(readings, place, (0, 450, 900)), TIME, [line(61.0)], K))
    plain = strokes(wave, place, (0, 450, 900))
    inner = np.r_[80:370, 530:820]
    assert np.std((found.readings - plain.readings)[inner]) < 0.3
    assert not found.readings[200:230].any()


def credit(readings, others, place=BENT, begin=(0, 900)):
    noise = 0.2 * np.random.default_rng(0).standard_normal((900, 1))
    own = strokes(np.reshape(readings, (900, -1)) + noise, place, begin)
    spectrum = completed(spectrum_of(own, 0.1, 2048))
    best = max(completed(spectrum.lines(0.3, 4.0, 5)), key=lambda one: one.amplitude)
    return best, completed(credits_of(best, spectrum, own, TIME, others))


@pytest.mark.parametrize("begin", [(0, 900), (0, 450, 900)])
def test_energy_is_credited_to_the_one_that_explains_it(begin):
    """All of a line over the path's own, in units of the background as the line's; none to a line unlike it."""
    place = BENT if len(begin) == 2 else np.where(np.arange(900) < 450, BENT, 2 * BENT[450] - BENT)
    best, (path, time) = credit(surface(place, (1.0,)), [line(120.0), line(300.0)], place, begin)
    assert best.wavenumber == pytest.approx(K, rel=0.02)
    assert path == pytest.approx(best.ratio, rel=0.25) and time < 0.02 * path
    best, (path, time) = credit(hum(2.0, 47.0), [line(47.0), line(300.0)], place, begin)
    assert time > 10 * path


def test_what_is_slower_than_a_period_is_taken_out_and_its_harmonics_stay():
    """A ripple of 20 mm, six times as loud, beside a line of 3 mm with its second harmonic."""
    place = np.cumsum(np.random.default_rng(0).uniform(0.1, 0.3, 300))
    line = np.cos(2 * np.pi * place / 3.0 + 1) + 0.5 * np.cos(4 * np.pi * place / 3.0)
    ripple = 6 * np.sin(2 * np.pi * place / 20.0)

    def of(readings, place=place):
        ones = np.ones((300, 1))
        return Strokes(place, readings[:, None], ones, ones[:, 0], np.array([0, 300]), float(np.ptp(place)))

    one = of(line + ripple)
    left = completed(levelled(one, 1 / 3.0)).readings[:, 0]
    inner = (place > place[0] + 3) & (place < place[-1] - 3)
    assert np.abs(left - line)[inner].max() < 0.35 and np.abs(left - line).max() < 1.5
    quiet = of(line + 0.1 * ripple)
    assert np.array_equal(completed(levelled(quiet, 1 / 3.0)).readings, quiet.readings)
    short = of(line + ripple, place / 20)
    assert completed(levelled(short, 1 / 3.0)) is short
