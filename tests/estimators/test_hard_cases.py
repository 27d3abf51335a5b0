"""What breaks estimators of a wavelength in the field, on scenes with a known truth, each with its right answer."""

import math

import numpy as np
import pytest

from papilla.estimators import ChirpTracker, SpaceTracker
from papilla.estimators.wavelength import TrackingStatus
from papilla.scenes.scenes import scene


def tracked(block, **options):
    """The tracker's answers to the block, after a look at whether each is one; and the rows that may be used."""
    found = SpaceTracker(**options).process(block)
    assert {TrackingStatus(code) for code in found.status.tolist()} <= set(TrackingStatus)
    for column in (found.wavelength_mm, found.wavelength_sigma_mm):
        assert len(column) == len(block) and np.all(np.isnan(column) | ((column > 0) & (column < math.inf)))
    assert np.all(np.isnan(found.frequency_Hz) | ((found.frequency_Hz >= 0) & (found.frequency_Hz < math.inf)))
    return found, np.array([sentence.startswith("ok") for sentence in found.sentence])


def grating(wavelength=1.2, **options):
    return scene("const", wavelength, snr_dB=30.0, seed=11, **{"seconds": 1.8, **options})


@pytest.mark.parametrize("case", ["hum", "jitter", "two", "counts", "clean", "steps", "clock", "dropped", "spikes"])
def test_disturbed_readings(case):
    """The texture's wavelength is found beside what is not texture."""
    made = grating(sample_rate_Hz=1010.0 if case == "clock" else 1000.0)
    block, time, rng, truth = made.block(), made.time_s, np.random.default_rng(3), 1.2
    if case == "hum":
        block[:, 0] += 0.3 * np.sin(2 * math.pi * 50 * time)
    elif case == "steps":
        block[:, 0] += 5.0 * (np.floor(time / 0.35) % 2)
    elif case == "jitter":
        block[:, 0] = np.interp(time + rng.uniform(-2e-4, 2e-4, time.size), time, made.readings[:, 0])
    elif case == "two":
        block[:, 0] += 0.3 * np.sin(2 * math.pi * made.position_mm / 2.9)
    elif case == "counts":
        block[:, 0] = np.round(2048 + 20 * block[:, 0])
    elif case == "clock":
        truth = 1.01 * 1.2
    elif case == "dropped":
        block[np.arange(len(block)) % 300 < 20, 0] = math.nan
    elif case == "spikes":
        block[rng.random(len(block)) < 0.004, 0] += 25.0
    found, ok = tracked(block)
    assert found.wavelength_mm[1000:] == pytest.approx(truth, rel=0.01)
    # A path with gaps shows no harmonic: a lone line at a constant speed is not believed.
    assert ok[1000:].mean() > 0.9 or case == "dropped"
    assert (found.status[np.isnan(block[:, 0])] == TrackingStatus.MISSING).all()


def test_standing_still_for_two_seconds():
    """Nobody says that noise at rest is a texture; what is held is right, and no surer than before; then it goes on."""
    made, rng = grating(), np.random.default_rng(5)
    still = np.column_stack([made.signal[-1, 0] + made.noise_sd * rng.standard_normal(2000), np.zeros(2000)])
    found, ok = tracked(np.vstack([made.block(), still, made.block()]))
    rest = slice(2100, 3800)
    assert set(found.status[rest]) == {int(TrackingStatus.STANDSTILL)} and (found.frequency_Hz[rest] == 0).all()
    assert found.wavelength_mm[rest] == pytest.approx(1.2, rel=0.01)
    sigma = found.wavelength_sigma_mm[1810:3800]
    assert np.all(np.diff(sigma) >= -1e-4 * sigma[0])
    assert ok[-600:].all() and found.wavelength_mm[-600:] == pytest.approx(1.2, rel=0.01)


@pytest.mark.parametrize("tracker", [SpaceTracker, ChirpTracker])
@pytest.mark.parametrize("seed", range(3))
def test_neither_noise_nor_a_dead_gauge_is_a_texture(tracker, seed):
    noise = np.random.default_rng(seed).standard_normal(1500)
    for reading in (noise, np.full(1500, 3.0), np.full(1500, math.nan)):
        found = tracker().process(np.column_stack([reading, np.full(1500, 100.0)]))
        assert not any(sentence.startswith("ok") for sentence in found.sentence)
        assert reading is noise or np.isnan(found.wavelength_mm).all()


DRAWN = [
    "const", "act1", "act2", "harsh", "strokes, hum", "const, hum", "strokes, hum only", "const, rough, white",
    "strokes, 10 ms late", "strokes, encoder counts", "hand, realistic", "const, missing fundamental",
    "const, two lines",
]  # fmt: skip


@pytest.mark.slow
def test_what_is_called_ok_is_right_and_its_sigma_covers_it():
    """Scenes drawn with their parameters: hardly any false among ok in any kind, and errors within stated sigmas."""
    ratios, false, told = [], {}, {}
    for name in DRAWN:
        wrong, usable = 0, 0
        for seed in range(3):
            made = scene(name, np.random.default_rng(seed).uniform(0.8, 3.0), seed=seed, seconds=2.5, drawn=True)
            found, ok = tracked(made.block())
            truths = np.column_stack([made.wavelength_mm, *(np.full(len(ok), other) for other in made.others_mm)])
            off = np.abs(found.wavelength_mm[:, None] / np.nan_to_num(truths, nan=1e9) - 1).min(axis=1)
            wrong, usable = wrong + (ok & ~(off < 0.1)).sum(), usable + ok.sum()
            if made.others_mm == () and np.isfinite(made.wavelength_mm).all() and ok.any():
                ratios.append(np.median((off * found.wavelength_mm / found.wavelength_sigma_mm)[ok]))
        false[name], told[name] = wrong / max(usable, 1), usable
    assert sum(rate > 0.05 for rate in false.values()) <= 1 and max(false.values()) < 0.3, false
    assert told["const"] > 1000 and told["act2"] > 5000, told
    assert told["strokes, hum only"] == told["const, rough, white"] == 0, told
    assert np.sqrt(np.mean(np.square(ratios))) < 1.5
