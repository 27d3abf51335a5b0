"""What a follower remembers of a long way, and that nothing keeps it from noticing another surface."""

import numpy as np
import pytest

from papilla.estimators import FusedTracker, LineTracker

RANGE_MM = (1.0, 6.0)


def texture(position, wavelength, seed=0, noise=0.2, gauges=1):
    """(n, g) readings; wavelength : (n,) or one, the phase goes on where it changes."""
    turns = np.cumsum(np.diff(position, prepend=position[0]) / wavelength)
    # With a harmonic: at a constant speed a sine of 25 to 90 Hz may be a motor's.
    waves = sum(np.sin(2 * np.pi * n * turns[:, None] + np.arange(gauges)) / n for n in (1, 2))
    return waves + noise * np.random.default_rng(seed).standard_normal((len(position), gauges))


def test_another_surface_is_noticed_after_any_length_of_way():
    """Much more than the memory of 96 mm and the room that is kept for it."""
    position = np.arange(2100) * 0.4
    wavelength = np.where(position < 700, 2.1, 3.4)
    tracker = LineTracker(1, wavelength_range_mm=RANGE_MM)
    found = tracker.process(np.column_stack([texture(position, wavelength), position]))
    ok = np.array([sentence.startswith("ok") for sentence in found.sentence])
    before, after = position < 700, position > 780
    assert ok[before & (position > 60)].mean() > 0.95 and ok[after].mean() > 0.8
    assert found.wavelength_mm[before & ok] == pytest.approx(2.1, rel=0.01)
    assert found.wavelength_mm[after & ok] == pytest.approx(3.4, rel=0.01)
    # What is known of 96 mm is known for as long as they are of one surface.
    late = found.wavelength_sigma_mm[(position > 300) & before]
    assert late.max() < 1.1 * late.min()


@pytest.mark.parametrize("height, lost", [(30.0, True), (0.3, False)])
def test_a_spike_is_no_reading_and_what_follows_a_step_is_one(height, lost):
    """The first sample of a step is left out, as it may be a spike; a change of usual size is none."""
    readings = 0.1 * np.random.default_rng(4).standard_normal(400)
    readings[200], readings[300:] = readings[200] + height, readings[300:] + height
    seen = FusedTracker(1).process(np.column_stack([readings, np.full(400, 100.0)])).gauges
    assert np.flatnonzero(seen == 0).tolist() == ([200, 300] if lost else [])
