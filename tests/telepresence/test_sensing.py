"""The sensor side: further lines beside the wavelength, amplitudes of a short window, and when it says nothing."""

import math

import numpy as np
import pytest

from papilla.core.errors import InputError
from papilla.estimators.pipeline import PipelineEstimate
from papilla.estimators.wavelength.memory import TrackingStatus
from papilla.telepresence import QuantityTrust
from papilla.telepresence.sensing import Sensing


class Told:
    """Stands for a pipeline that knows the wavelength."""

    off, sentences, friction = {}, {}, None

    def __init__(self, columns=("t_s", "g1", "g2", "position_mm"), status="ok", lines=(), wavelength=1.2):
        self.columns, self.lines = columns, lines
        none = dict.fromkeys(PipelineEstimate._fields, math.nan)
        told = {"wavelength_status": status, "wavelength_mm": wavelength, "wavelength_sigma_mm": 0.01}
        self.answer = PipelineEstimate(**none | told)

    def reset(self):
        pass

    def update(self, sample):
        return self.answer


def wave(place, wavelength=1.2):
    return math.sin(2 * math.pi * place / wavelength + 0.3)


def slid(sensing, number, step_mm, amplitudes=(50.0, 80.0), first=0):
    """Samples at even steps of the path."""
    for row in range(first, first + number):
        place = row * step_mm
        sensing.update((row / 1000, *(100.0 + size * wave(place) for size in amplitudes), place))
    return sensing.lines()


def test_a_line_has_the_amplitude_of_the_gauge_that_feels_it_most():
    for amplitudes in ((50.0, 80.0), (80.0, 50.0)):
        (line,), trust = slid(Sensing(Told()), 150, 0.1, amplitudes)
        assert trust == QuantityTrust.OK and (line.wavelength_mm, line.wavelength_sigma_mm) == (1.2, 0.01)
        assert line.amplitude_microstrain == pytest.approx(80.0) and line.amplitude_sigma_microstrain < 1e-9


def test_amplitudes_are_of_the_last_fifth_of_a_second():
    sensing = Sensing(Told())
    slid(sensing, 300, 0.1)
    (mixed,), _ = slid(sensing, 199, 0.1, (20.0, 10.0), first=300)
    assert mixed.amplitude_microstrain > 20.001
    (line,), _ = slid(sensing, 1, 0.1, (20.0, 10.0), first=499)
    assert line.amplitude_microstrain == pytest.approx(20.0)
    sensing.reset()
    assert sensing.lines() == ((), QuantityTrust.UNKNOWN)


def test_the_sigma_of_an_amplitude_is_that_of_its_noise():
    rng, found = np.random.default_rng(0), []
    for _ in range(60):
        sensing = Sensing(Told(("t_s", "g1", "position_mm")))
        for row in range(200):
            sensing.update((row / 1000, 40 * wave(0.1 * row) + rng.normal(0, 3.0), 0.1 * row))
        found.append(sensing.lines()[0][0])
    sigma = 3.0 * math.sqrt(2 / 200)
    assert np.mean([line.amplitude_sigma_microstrain for line in found]) == pytest.approx(sigma, rel=0.05)
    assert np.std([line.amplitude_microstrain for line in found]) == pytest.approx(sigma, rel=0.3)


@pytest.mark.parametrize("step_mm, enough", [(0.3, 12), (0.1, 19)])
def test_twelve_samples_and_one_and_a_half_periods_are_needed(step_mm, enough):
    sensing = Sensing(Told())
    assert slid(sensing, enough - 1, step_mm) == ((), QuantityTrust.HELD)
    sensing.update((0.5, math.nan, 3.0, 90.0))
    assert sensing.lines() == ((), QuantityTrust.HELD), "a sample with a missing gauge does not count"
    assert slid(sensing, 1, step_mm, first=enough - 1)[1] == QuantityTrust.OK


def test_two_lines_need_sixteen_samples():
    sensing = Sensing(Told(lines=((2.0, 0.0, 0.0),)), components=2)
    assert slid(sensing, 15, 0.3)[1] == QuantityTrust.HELD and slid(sensing, 1, 0.3, first=15)[1] == QuantityTrust.OK


def test_further_lines_are_significant_and_two_per_cent_from_all_others():
    lines = (
        (1.223, 0.0, 0.0),
        (2.0, 0.0, 0.9e-6),
        (2.041, 0.0, 0.0),
        (3.0, 0.0, 1.1e-6),
        (2.039, 0.0, 0.0),
        (5.0, 0.0, 0.0),
    )
    for components, wanted in ((1, {1.2}), (3, {1.2, 2.0, 2.041}), (4, {1.2, 2.0, 2.041, 5.0})):
        found, _ = slid(Sensing(Told(lines=lines), components=components), 200, 0.1)
        assert {line.wavelength_mm for line in found} == wanted
        assert found[0].wavelength_mm == 1.2 and found[0].amplitude_microstrain == pytest.approx(80.0, rel=1e-6)
        assert all(math.isnan(line.wavelength_sigma_mm) for line in found[1:]), "their search tells none"


@pytest.mark.parametrize("status", list(TrackingStatus))
def test_a_wavelength_is_held_where_the_path_or_the_speed_is_missing(status):
    held = {TrackingStatus.STANDSTILL, TrackingStatus.MISSING, TrackingStatus.NO_VELOCITY, TrackingStatus.ALIASED}
    lines, trust = slid(Sensing(Told(status=status.code)), 200, 0.1)
    if status.code.startswith("ok"):
        assert trust == QuantityTrust.OK
    else:
        assert lines == () and trust == (QuantityTrust.HELD if status in held else QuantityTrust.UNKNOWN)


def test_a_velocity_is_integrated_over_the_sample_rate():
    sensing = Sensing(Told(("t_s", "g1", "velocity_mm_s")), sample_rate_Hz=2000.0)
    for row in range(1, 501):
        sensing.update((row / 2000, 30 * wave(row * 0.05), math.nan if row == 7 else 100.0))
    (line,), trust = sensing.lines()
    assert trust == QuantityTrust.OK and line.amplitude_microstrain == pytest.approx(30.0)


def test_a_pipeline_without_a_wavelength_is_refused():
    told = Told()
    told.off = {"wavelength": "no column position_mm"}
    with pytest.raises(InputError, match="needs a wavelength: no column position_mm"):
        Sensing(told)
