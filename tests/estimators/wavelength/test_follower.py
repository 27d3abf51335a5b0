"""The wavelength over the path: what is answered, what is refused, and how sure it is, on scenes with a known truth."""

import numpy as np
import pytest

from papilla.core.errors import InputError
from papilla.estimators import Pipeline, SpaceTracker
from papilla.estimators.wavelength import TrackingStatus
from papilla.scenes.scenes import scene

RATE = 1000.0


def good(found):
    """(n,) rows that may be used."""
    return np.array([sentence.startswith("ok") for sentence in found.sentence])


@pytest.mark.parametrize("kind, bound", [("const", 2e-4), ("act1", 5e-4), ("harsh", 2e-2)])
def test_a_grating_is_known_to_a_fraction_of_a_percent(kind, bound):
    made = scene(kind, 1.8, seed=3, seconds=2.5)
    found = SpaceTracker(scale_sigma=0.0).process(made.block())
    usable = good(found) & made.judged()
    assert usable.sum() > 0.7 * made.judged().sum()
    assert np.sqrt(np.mean((found.wavelength_mm[usable] / 1.8 - 1) ** 2)) < bound


@pytest.mark.slow
def test_sigma_is_true_and_holds_the_scale():
    ratios = []
    for seed in range(30):
        made = scene("const", 1.1, seed=seed, seconds=1.0, snr_dB=10)
        found = SpaceTracker(scale_sigma=0.0).process(made.block())
        ratios.append((found.wavelength_mm[-1] - 1.1) / found.wavelength_sigma_mm[-1])
    assert 0.5 < np.sqrt(np.mean(np.square(ratios))) < 1.6
    told = SpaceTracker(scale_sigma=0.02).process(made.block()).wavelength_sigma_mm[-1]
    assert told == pytest.approx(np.hypot(found.wavelength_sigma_mm[-1], 0.02 * 1.1), rel=1e-3)


def test_hum_at_a_constant_speed_is_not_a_texture():
    time = np.arange(2500) / RATE
    hum = np.sin(2 * np.pi * 50 * time) + np.random.default_rng(0).normal(0, 0.1, 2500)
    found = SpaceTracker().process(np.column_stack([hum, np.full(2500, 97.0)]))
    assert not good(found).any() and TrackingStatus.TIME_LOCKED in found.status
    # A motor's line, alone from 25 to 90 Hz, is refused; above it a line may be a surface's, unless it is a resonance
    for frequency, usable in ((77, False), (117, True)):
        other = np.sin(2 * np.pi * frequency * time) + np.random.default_rng(0).normal(0, 0.1, 2500)
        block = np.column_stack([other, np.full(2500, 97.0)])
        status = SpaceTracker().process(block).status
        assert (status[-1] == TrackingStatus.CONSTANT_SPEED) == usable
        assert good(SpaceTracker().process(block)).any() == usable
        assert not good(SpaceTracker(resonances_Hz=(float(frequency),)).process(block)).any()


@pytest.mark.parametrize("name", ["const, missing fundamental", "strokes, missing fundamental", "const, two lines"])
def test_harmonics_are_told_from_another_texture(name):
    made = scene(name, 1.8, seed=2, seconds=2.0)
    found = SpaceTracker().process(made.block())
    usable = good(found)[800:]
    off = np.abs(found.wavelength_mm[800:, None] / [made.wavelength_mm[-1], *made.others_mm] - 1)
    assert usable.mean() > 0.9 and np.nanmin(off, axis=1)[usable].max() < 0.01


@pytest.mark.parametrize("gain, told", [(1.0, False), (1.08, True)])
def test_gauges_at_known_places_contradict_a_wrong_velocity(gain, told):
    places = (0.0, 2.3, 5.9, 7.1)
    made = scene("const", 1.3, seed=2, seconds=1.2, gauge_positions_mm=places)
    pipeline = Pipeline(None, gauges=4, gauge_positions_mm=places, columns=("velocity_mm_s",))
    found = pipeline.process(np.column_stack([made.time_s, made.block(gain=gain)]))
    assert found.wavelength_status[-1].startswith("ok")
    assert ("phases between the gauges" in found.status[-1]) == told
    assert found.wavelength_status[-1].endswith(", phases differ") == told
    with pytest.raises(InputError, match="gauge_positions_mm must be 4 places"):
        Pipeline(None, gauges=4, gauge_positions_mm=(0.0, 1.0), columns=("velocity_mm_s",))


def test_a_hand_with_everything_at_once_is_followed_and_never_wrong():
    made = scene("hand, realistic", 1.5, seed=7, seconds=3.0)
    found = SpaceTracker().process(made.block())
    usable = good(found)
    assert usable[1000:].mean() > 0.8 and np.abs(found.wavelength_mm[usable] / 1.5 - 1).max() < 0.05
