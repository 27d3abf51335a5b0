"""Five gauges together where something is wrong: with a gauge, with all of them, with their places, with the clock.

One gauge that is dead or that contradicts the others, and a velocity that is wrong, are in `test_small_trackers`.
"""

import math

import numpy as np
import pytest

from papilla.estimators.tracking import FusedTracker, TrackingStatus
from papilla.studies.estimator_bench.scenes import scene

PLACES = (-8.0, -4.5, 0.0, 3.9, 8.0)
TRUTH = 2.3
LATE = slice(-150, None)
OK, MISSING, STANDSTILL = (int(code) for code in (TrackingStatus.OK, TrackingStatus.MISSING, TrackingStatus.STANDSTILL))


@pytest.fixture(scope="module")
def rows():
    """(900, 6) five gauges over 2.3 mm at about 100 mm/s, 20 dB."""
    return scene("const", TRUTH, seed=2, seconds=0.9, gauge_positions_mm=PLACES).block()


@pytest.fixture(scope="module")
def clean(rows):
    return tracked(rows)


def tracked(rows, places=PLACES, **options):
    return FusedTracker(places, compiled=False, **options).process(rows)


def right(found, used, truth=TRUTH):
    """Both wavelengths of the last rows, from so many gauges."""
    assert set(found.status[LATE]) == {OK} and set(found.used[LATE]) == {used}
    assert np.abs(found.wavelength_mm[LATE] / truth - 1).max() < 1e-3
    assert np.abs(found.wavelength_by_phase_mm[LATE] / truth - 1).max() < 3e-3
    assert (found.wavelength_sigma_mm[LATE] > 0).all()


def doubt(found):
    """How uncertain the phase is of its wavelength, as a fraction, at the end."""
    return float(np.median((found.wavelength_by_phase_sigma_mm / found.wavelength_by_phase_mm)[LATE]))


@pytest.mark.parametrize("gauge", range(5))
def test_a_gauge_without_a_number_is_done_without(rows, clean, gauge):
    spoilt = rows.copy()
    spoilt[:, gauge] = np.nan
    found = tracked(spoilt)
    right(found, 4)
    assert found.wavelength_sigma_mm[-1] > clean.wavelength_sigma_mm[-1]
    assert found.wavelength_by_phase_sigma_mm[-1] < 0.01, "also without the first, which the others are compared with"


def test_a_gauge_at_the_rail_is_done_without_and_comes_back(rows):
    spoilt = rows.copy()
    spoilt[300:600, 3] = 9.0
    found = tracked(spoilt, saturation=9.0)
    assert set(found.used[310:600]) == {4} and set(found.status[310:]) == {OK}
    right(found, 5)


def test_bursts_in_which_every_gauge_is_silent_hold_the_wavelength(rows):
    spoilt, lost = rows.copy(), np.zeros(len(rows), bool)
    for begin in (400, 550, 680):
        lost[begin : begin + 30] = True
    spoilt[lost, :5] = np.nan
    found = tracked(spoilt)
    assert set(found.status[lost]) == {MISSING}
    assert np.isnan(found.wavelength_by_phase_mm[lost]).all(), "no phase is known now"
    assert found.wavelength_mm[lost] == pytest.approx(np.full(90, TRUTH), rel=2e-3)
    assert set(found.status[350:][~lost[350:]]) == {OK}
    right(found, 5)


def test_nothing_but_gaps_is_no_answer():
    found = tracked(np.column_stack([np.full((200, 5), np.nan), np.full(200, 100.0)]))
    assert set(found.status) == {MISSING} and set(found.used) == {0}
    assert np.isnan(found.wavelength_mm).all() and np.isnan(found.wavelength_by_phase_mm).all()


def test_a_reversal_and_a_rest():
    """To and fro in act1, then at rest for 0.3 s: the phase counts backwards as it did forwards."""
    made = scene("act1", 1.8, seed=3, seconds=1.25, gauge_positions_mm=PLACES)
    rest = np.column_stack([np.tile(made.readings[-1], (300, 1)), np.zeros(300)])
    rest[:, :5] += 0.1 * np.random.default_rng(1).standard_normal((300, 5))
    found = tracked(np.vstack([made.block(), rest]))
    backwards = slice(600, 950)
    assert (made.velocity_mm_s[backwards] < 0).all()
    assert np.mean(found.status[backwards] == OK) > 0.95
    assert np.nanmax(np.abs(found.wavelength_mm[backwards] / 1.8 - 1)) < 3e-3
    assert np.nanmedian(np.abs(found.wavelength_by_phase_mm[backwards] / 1.8 - 1)) < 3e-3
    assert set(found.status[1255:]) == {STANDSTILL} and set(found.frequency_Hz[1255:]) == {0.0}
    assert found.wavelength_mm[1255:] == pytest.approx(np.full(295, 1.8), rel=2e-3)
    assert found.wavelength_sigma_mm[-1] > found.wavelength_sigma_mm[1255]
    assert np.isnan(found.wavelength_by_phase_mm[1255:]).all()


@pytest.mark.parametrize("one, other", [(0, 1), (1, 2), (0, 4), (1, 3)])
def test_exchanged_gauges_show_in_the_phase_alone(rows, clean, one, other):
    """Each gauge sees the same texture: only the phases between them disagree. Their wavelength says how much, or, if
    other whole turns would do as well, nothing."""
    exchanged = rows.copy()
    exchanged[:, [one, other]] = rows[:, [other, one]]
    found = tracked(exchanged)
    np.testing.assert_array_equal(found.wavelength_mm, clean.wavelength_mm)
    np.testing.assert_array_equal(found.wavelength_sigma_mm, clean.wavelength_sigma_mm)
    off = (found.wavelength_by_phase_mm - TRUTH) / found.wavelength_by_phase_sigma_mm
    assert np.isnan(off[LATE]).all() or (np.nanmax(np.abs(off[LATE])) < 4 and doubt(found) > 5 * doubt(clean))


@pytest.mark.parametrize("factor", [0.95, 0.98, 1.0, 1.05])
def test_whole_turns_are_not_taken_from_a_wrong_velocity(factor):
    """27 mm are 45 wavelengths: 5 % of the velocity are two turns. Even places cannot tell, and do not."""
    uneven, even = (-13.5, -7.2, 0.0, 7.2, 13.5), (-14.0, -7.0, 0.0, 7.0, 14.0)
    for places in (uneven, even):
        rows = scene("const", 0.6, seed=4, seconds=0.9, gauge_positions_mm=places).block(gain=factor)
        found = tracked(rows, places)
        assert np.median(found.wavelength_mm[LATE]) == pytest.approx(0.6 * factor, rel=2e-3)
        known = np.isfinite(found.wavelength_by_phase_mm[LATE])
        assert known.all() if places is uneven else not known.any()
        assert np.abs(found.wavelength_by_phase_mm[LATE][known] / 0.6 - 1).max(initial=0) < 2e-3


@pytest.mark.parametrize("factor", [1e3, 1e-3, -1.0])
def test_places_in_another_unit_or_order_do_not_confirm_the_wavelength(rows, clean, factor):
    """Places in µm or m where mm are asked for, and places counted from the other end."""
    found = tracked(rows, tuple(factor * place for place in PLACES))
    np.testing.assert_array_equal(found.wavelength_mm, clean.wavelength_mm)
    assert math.isnan(found.wavelength_by_phase_mm[-1]) or doubt(found) > 30 * doubt(clean)


@pytest.mark.parametrize("lost", [True, False])
def test_rows_that_are_lost_or_doubled_unnoticed_show_between_the_two_wavelengths(lost):
    """Two rows in a hundred: path and wavelength are 2 % too short or too long, the wavelength by phase is not."""
    rows = scene("const", 3.0, seed=2, seconds=0.9, gauge_positions_mm=PLACES).block()
    chosen = np.random.default_rng(0).permutation(len(rows))[: len(rows) // 50]
    spoilt = np.delete(rows, chosen, axis=0) if lost else np.insert(rows, chosen, rows[chosen], axis=0)
    found = tracked(spoilt)
    assert set(found.status[LATE]) == {OK}
    assert np.median(found.wavelength_mm[LATE] / 3.0) == pytest.approx(len(spoilt) / len(rows), abs=0.004)
    assert np.median(found.wavelength_by_phase_mm[LATE] / 3.0) == pytest.approx(1.0, abs=0.006)


@pytest.mark.parametrize("kind", [np.int64, np.float32])
def test_counts_and_single_precision(rows, kind):
    """Counts of 2 % of the texture's rms around the middle of a converter, as integers or as floats."""
    counts = np.round(np.column_stack([2048 + 50 * rows[:, :5], rows[:, 5]]))
    found = tracked(counts.astype(kind))
    for a, b in zip(found, tracked(counts), strict=True):
        np.testing.assert_array_equal(a, b)
    found = found._replace(wavelength_mm=found.wavelength_mm * rows[0, 5] / counts[0, 5])
    right(found, 5)
