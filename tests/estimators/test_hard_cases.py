"""What breaks roughness estimators in the field, on scenes with a known truth, each with the answer that is expected.

Three bounds a case: of those that know the velocity, of the corrected spectra, and of the corrected counters, whose
window of 80-200 ms holds few periods. As printed, only sound answers are asked for: their errors are in the comparison.
"""

import math
from functools import partial

import numpy as np
import pytest

from papilla.estimators.wavelength import SpaceTracker, TrackingStatus
from papilla.scenes.scenes import scene
from papilla_papers.methods.roughness import (
    ImpulseDensity,
    ImpulseInterval,
    Okamoto,
    RoughnessStatus,
    ShortTimeSpectrum,
    ZeroCrossing,
)

PUBLISHED = (ImpulseDensity, ImpulseInterval, ShortTimeSpectrum, ZeroCrossing, Okamoto)
SPECTRA = (ShortTimeSpectrum, Okamoto)
TRACKERS = {"space tracker": SpaceTracker}
MAKERS = {f"{kind.__name__} {variant}": partial(kind, variant=variant) for kind in PUBLISHED for variant in
          ("as_printed", "corrected")} | TRACKERS  # fmt: skip
EXACT = {
    name: "tracker" if name in TRACKERS else "spectrum" if make.func in SPECTRA else "counter"
    for name, make in MAKERS.items()
    if not name.endswith("as_printed")
}
"""Name -> which of the three bounds it must keep."""

every = pytest.mark.parametrize("name", MAKERS)
accurate = pytest.mark.parametrize("name", EXACT)


SNR = 30.0


def run(name, block, **options):
    """The estimator's answers to the block, after a look at whether each is one."""
    found = MAKERS[name](**options).process(block)
    sound(name, found, len(block))
    return found


def sound(name, found, rows):
    """A known status a row, no infinity, no wavelength or sigma that is not positive."""
    statuses = TrackingStatus if name in TRACKERS else RoughnessStatus
    assert len(found.status) == len(found.wavelength_mm) == rows
    assert {statuses(code) for code in found.status.tolist()} <= set(statuses)
    columns = [found.wavelength_mm] + ([found.wavelength_sigma_mm] if name in TRACKERS else [])
    assert all(np.all(np.isnan(column) | ((column > 0) & (column < math.inf))) for column in columns)
    assert np.all(np.isnan(found.frequency_Hz) | ((found.frequency_Hz >= 0) & (found.frequency_Hz < math.inf)))


def good(found):
    """(n,) rows that may be used."""
    return np.array([sentence.startswith("ok") for sentence in found.sentence])


def grating(wavelength=1.2, **options):
    return scene("const", wavelength, snr_dB=SNR, seed=11, **{"seconds": 1.8, **options})


def error_of(found, truth, rows=slice(1000, None)):
    """Median |relative error|, where there is no answer infinite."""
    wavelength = found.wavelength_mm[rows]
    return float(np.median(np.where(np.isfinite(wavelength), np.abs(wavelength / truth - 1), math.inf)))


@pytest.mark.parametrize(
    "name, case", [(name, case) for case in ("hum", "jitter", "two", "counts", "clean", "steps") for name in EXACT]
)
def test_disturbed_readings(name, case):
    """The texture's wavelength is found beside what is not texture."""
    made = grating()
    block, time = made.block(), made.time_s
    rng = np.random.default_rng(3)
    if case == "hum":
        block[:, 0] += 0.3 * np.sin(2 * math.pi * 50 * time)
    elif case == "steps":
        block[:, 0] += 5.0 * (np.floor(time / 0.35) % 2)
    elif case == "jitter":
        late = rng.uniform(-2e-4, 2e-4, time.size)
        block[:, 0] = np.interp(time + late, time, made.readings[:, 0])
    elif case == "two":
        block[:, 0] += 0.3 * np.sin(2 * math.pi * made.position_mm / 2.9)
    elif case == "counts":
        block[:, 0] = np.round(2048 + 20 * block[:, 0])
    bounds = {"tracker": 0.005, "spectrum": 0.01, "counter": 0.12}
    # Rows well after the last step of the baseline: a window that holds one is not asked.
    assert error_of(run(name, block), 1.2, slice(1650, 1740)) < bounds[EXACT[name]]


@accurate
def test_a_clock_that_is_wrong_shows_in_the_wavelength(name):
    """1 % more samples a second than is known: each stands for 1 % more distance than it has."""
    made = grating(sample_rate_Hz=1010.0)
    ratio = np.median(run(name, made.block()).wavelength_mm[1000:]) / 1.2
    width = {"tracker": 0.002, "spectrum": 0.005, "counter": 0.12}[EXACT[name]]
    assert ratio == pytest.approx(1.01, abs=width)


@accurate
@pytest.mark.parametrize("rate", [500.0, 2000.0])
def test_other_sampling_rates(name, rate):
    made = grating(2.4, sample_rate_Hz=rate)
    found = run(name, made.block(), sample_rate_Hz=rate)
    bounds = {"tracker": 0.005, "spectrum": 0.01, "counter": 0.2}
    assert error_of(found, 2.4, slice(round(rate), None)) < bounds[EXACT[name]]


@every
def test_float32_and_contiguity_do_not_matter(name):
    block = grating(seconds=0.6).block().astype(np.float32)
    whole = run(name, block)
    same = run(name, np.asfortranarray(block.astype(float)))
    assert all(np.array_equal(a, b, equal_nan=True) for a, b in zip(whole, same, strict=True))


@every
def test_standing_still_for_two_seconds(name):
    """Nobody says that noise at rest is a texture; where a wavelength is held, it is the right one; then it goes on."""
    made, rest = grating(), 2000
    noise = made.noise_sd * np.random.default_rng(5).standard_normal(rest)
    still = np.column_stack([made.signal[-1, 0] + noise, np.zeros(rest)])
    found = run(name, np.vstack([made.block(), still, made.block()]))
    held = found.wavelength_mm[2100:3800]
    assert np.all(found.status[2100:3800] != 0)
    if name in EXACT:
        assert np.all(np.isnan(held) | (np.abs(held / 1.2 - 1) < 0.15))
        assert error_of(found, 1.2, slice(-600, None)) < 0.12
    if name in TRACKERS:
        assert set(found.status[2100:3800]) == {int(TrackingStatus.STANDSTILL)}
        assert held == pytest.approx(np.full(held.size, 1.2), rel=0.01)
        assert np.all(found.frequency_Hz[2100:3800] == 0)


def test_at_rest_the_sigma_does_not_shrink():
    made = grating()
    still = np.column_stack([np.full(1000, made.signal[-1, 0]), np.zeros(1000)])
    sigma = run("space tracker", np.vstack([made.block(), still])).wavelength_sigma_mm[1810:]
    assert np.all(np.diff(sigma) >= -1e-4 * sigma[0])


@pytest.mark.parametrize("name", TRACKERS)
def test_reversals(name):
    """Three strokes out and back: no answer that is called ok is off by more than 3 %."""
    made = scene("act1", 1.8, snr_dB=SNR, seed=11, seconds=2.6)
    found = run(name, made.block())
    after = made.time_s > 1
    answered = found.wavelength_mm[after & good(found)]
    assert answered.size > 0.9 * after.sum()
    assert np.abs(answered / 1.8 - 1).max() < 0.03


@every
def test_a_dead_gauge_has_no_wavelength(name):
    found = run(name, np.column_stack([np.full(900, 3.0), np.full(900, 100.0)]))
    assert np.isnan(found.wavelength_mm).all()
    assert np.all(found.status != 0)


def test_noise_without_texture_is_never_called_ok():
    rng = np.random.default_rng(8)
    for _ in range(3):
        found = run("space tracker", np.column_stack([rng.standard_normal(2000), np.full(2000, 100.0)]))
        assert not any(sentence.startswith("ok") for sentence in found.sentence)


@every
def test_a_saturated_stretch(name):
    """At the rail for 300 ms: each such sample says so, and half a second later the wavelength is known again."""
    made = grating(seconds=2.4)
    block = made.block()
    block[1000:1300, 0] = 4.0
    found = run(name, block, saturation=3.0)
    wanted = TrackingStatus.MISSING if name in TRACKERS else RoughnessStatus.SATURATED
    assert set(found.status[1000:1300]) == {int(wanted)}
    if name in EXACT:
        bounds = {"tracker": 0.005, "spectrum": 0.01, "counter": 0.12}
        assert error_of(found, 1.2, slice(1800, None)) < bounds[EXACT[name]]


@every
def test_bursts_of_nan(name):
    """20 ms of every 300 ms are lost: each lost sample is called missing, the wavelength between them is kept."""
    block = grating().block()
    lost = np.arange(len(block)) % 300 < 20
    block[lost, 0] = math.nan
    found = run(name, block)
    missing = int(TrackingStatus.MISSING if name in TRACKERS else RoughnessStatus.MISSING)
    after = np.arange(len(block)) >= 500
    assert set(found.status[after & lost]) == {missing}
    assert missing not in set(found.status[after & ~lost])
    if name in EXACT:
        bounds = {"tracker": 0.01, "spectrum": 0.02, "counter": 0.3}
        assert error_of(found, 1.2, after & ~lost) < bounds[EXACT[name]]


@every
def test_an_unknown_velocity_gives_no_new_wavelength(name):
    block = grating(seconds=0.9).block()
    block[600:, 1] = math.nan
    found = run(name, block)
    # What pairs a count with a distance has known speeds in its window for up to 200 ms.
    assert np.all(found.status[805:] != 0)
    if name in TRACKERS:
        assert set(found.status[605:]) == {int(TrackingStatus.NO_VELOCITY)}
        assert np.isnan(found.frequency_Hz[605:]).all()
        assert found.wavelength_mm[605:] == pytest.approx(np.full(295, 1.2), rel=0.02)


@every
def test_aliases_are_refused(name):
    """2500 mm/s at 1 kHz: not even 5 mm is sampled twice a period, so nothing between 0.4 and 4 mm can be told.

    No paper prints such a limit: what is as printed does not have one.
    """
    fast = 2500.0
    at = fast * np.arange(900) / 1000
    block = np.column_stack([np.sin(2 * math.pi * at / 1.2), np.full(900, fast)])
    found = run(name, block, wavelength_range_mm=(0.4, 4.0))
    if name.endswith("as_printed"):
        assert int(RoughnessStatus.ALIASED) not in found.status
        return
    if name in TRACKERS:
        assert set(found.status[300:]) == {int(TrackingStatus.ALIASED)}
    else:
        # Equal slopes make no impulse: then nothing is told either.
        assert set(found.status[300:]) <= {int(RoughnessStatus.ALIASED), int(RoughnessStatus.SILENT)}
    assert np.isnan(found.wavelength_mm[300:]).all()


@pytest.mark.parametrize("name", TRACKERS)
def test_two_equal_wavelengths(name):
    """One of the two, or none: never something between."""
    made, other = grating(), scene("const", 2.1, snr_dB=SNR, seed=11, seconds=1.8)
    block = made.block()
    block[:, 0] += other.readings[:, 0]
    answer = run(name, block).wavelength_mm[1000:]
    near = [np.abs(answer / truth - 1) < 0.02 for truth in (1.2, 2.1)]
    assert np.mean(near[0] | near[1] | np.isnan(answer)) > 0.95
