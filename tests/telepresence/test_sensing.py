"""The sensor side: lines of the texture from a pipeline that slides, amplitudes of a short window, and when it says
nothing."""

import math

import numpy as np
import pytest

from papilla.core.errors import InputError
from papilla.estimators import Pipeline
from papilla.telepresence import QuantityTrust
from papilla.telepresence.sensing import Sensing

WAVELENGTH_MM, NOISE = 1.2, 2.0


def place_of(time):
    """A hand whose speed varies between 70 and 130 mm/s."""
    return 100 * time + 30 / (2 * math.pi) * math.sin(2 * math.pi * time)


def sensing_of(components=1, columns=("position_mm",), gauges=2, **options):
    return Sensing(Pipeline(gauges=gauges, columns=columns, gauge_sigma=NOISE), components=components, **options)


def slid(sensing, rows, sizes=(50.0, 80.0), second=0.0, rng=None):
    """Samples of a millisecond over lines of 1.2 mm, and of 2.9 mm with a `second` size."""
    for row in rows:
        place = place_of(row / 1000)
        turns = 2 * math.pi * place
        texture = [size * math.sin(turns / WAVELENGTH_MM) + second * math.cos(turns / 2.9) for size in sizes]
        noise = rng.normal(0, NOISE, len(sizes)) if rng is not None else np.zeros(len(sizes))
        sensing.update((row / 1000, *(100.0 + np.array(texture) + noise), place))
    return sensing.lines()


@pytest.mark.parametrize("sizes", [(50.0, 80.0), (80.0, 50.0)])
def test_a_line_has_the_amplitude_of_the_gauge_that_feels_it_most_and_the_sigma_of_its_noise(sizes):
    (line,), trust = slid(sensing_of(), range(1000), sizes, rng=np.random.default_rng(1))
    assert trust == QuantityTrust.OK and abs(line.wavelength_mm - WAVELENGTH_MM) < 4 * line.wavelength_sigma_mm
    assert line.amplitude_sigma_microstrain == pytest.approx(NOISE * math.sqrt(2 / 200), rel=0.2)
    assert abs(line.amplitude_microstrain - 80.0) < 4 * line.amplitude_sigma_microstrain + 0.1


def test_amplitudes_are_of_the_last_fifth_of_a_second():
    sensing, rng = sensing_of(), np.random.default_rng(3)
    slid(sensing, range(800), rng=rng)
    (mixed,), _ = slid(sensing, range(800, 980), (20.0, 10.0), rng=rng)
    (line,), _ = slid(sensing, range(980, 1000), (20.0, 10.0), rng=rng)
    assert mixed.amplitude_microstrain > 22 and line.amplitude_microstrain == pytest.approx(20.0, abs=0.9)
    sensing.reset()
    assert sensing.lines() == ((), QuantityTrust.UNKNOWN)


@pytest.mark.parametrize("components, wanted", [(1, [1.2]), (2, [1.2, 2.9]), (4, [1.2, 2.9])])
def test_further_lines_are_significant_and_apart_from_the_first(components, wanted):
    lines, _ = slid(sensing_of(components, gauges=1), range(2000), (50.0,), 20.0, rng=np.random.default_rng(2))
    assert [line.wavelength_mm for line in lines] == pytest.approx(wanted, rel=5e-3)
    assert [line.amplitude_microstrain for line in lines] == pytest.approx([50.0, 20.0][: len(wanted)], rel=0.03, abs=3)
    assert all(math.isnan(line.wavelength_sigma_mm) for line in lines[1:]), "the search of further lines tells none"


def test_the_texture_is_held_at_rest_and_in_a_gap_and_unknown_before_the_first_line():
    sensing = sensing_of()
    assert slid(sensing, range(5))[1] == QuantityTrust.UNKNOWN
    assert slid(sensing, range(5, 1000))[1] == QuantityTrust.OK
    sensing.update((1.0, 100.0, 100.0, math.nan))
    assert sensing.lines() == ((), QuantityTrust.HELD), "no place"
    resting = sensing_of()
    slid(resting, range(1000))
    for row in range(400):
        resting.update((1.0 + row / 1000, 100.0, 100.0, place_of(0.999)))
    assert resting.lines() == ((), QuantityTrust.HELD)


def test_a_velocity_is_integrated_over_the_sample_rate():
    sensing = sensing_of(columns=("velocity_mm_s",), gauges=1, sample_rate_Hz=2000.0)
    for row in range(1, 1601):
        time = row / 2000
        reading = 30 * math.sin(2 * math.pi * place_of(time) / WAVELENGTH_MM)
        sensing.update((time, reading, math.nan if row == 7 else 100 + 30 * math.cos(2 * math.pi * time)))
    (line,), trust = sensing.lines()
    assert trust == QuantityTrust.OK and line.amplitude_microstrain == pytest.approx(30.0, rel=0.01)


def test_a_pipeline_without_a_wavelength_is_refused():
    with pytest.raises(InputError, match="needs a wavelength: .*position_mm"):
        sensing_of(columns=("force_N",))
