"""The streaming ridge against the cross-wavelet of the whole record, and what noise and faults become."""

import numpy as np
import pytest
from scipy.signal import lfilter

from papilla.core.errors import InputError
from papilla_papers.methods.wavelet import CrossRidge, RidgeStatus, cross_wavelet

RATE = 300.0


def make(**more):
    return CrossRidge(**{"low_Hz": 20.0, "sample_rate_Hz": RATE, **more})


def touch(period_mm=0.48, distance_mm=0.6, noise=0.05, count=900):
    """(n, 2) of two channels a distance apart on a grating while the speed grows, and the frequency (n,)."""
    speed = np.interp(np.arange(count), [0, count], [12.0, 35.0])
    place = np.cumsum(speed) / RATE
    generator = np.random.default_rng(0)
    rows = [np.cos(2 * np.pi * (place - at) / period_mm) for at in (0.0, distance_mm)]
    return np.column_stack(rows) + noise * generator.normal(size=(count, 2)), speed / period_mm


def test_each_instant_is_that_of_the_whole_record():
    rows, truth = touch()
    estimator = make()
    assert CrossRidge().frequency_Hz[0] == 10.0 and 95 < CrossRidge().frequency_Hz[-1] <= 100.0
    assert CrossRidge().lag_s == pytest.approx(3 * (6 + np.sqrt(38)) / (4 * np.pi * 10), abs=1e-3)
    found = estimator.process(rows)
    whole = cross_wavelet(rows[:, 0], rows[:, 1], RATE, estimator.frequency_Hz).ridge
    lag = round(estimator.lag_s * RATE)
    ahead = np.arange(100, 700)
    late = ahead + lag
    np.testing.assert_array_equal(found.frequency_Hz[late], whole.frequency_Hz[ahead])
    np.testing.assert_allclose(found.magnitude[late], whole.magnitude[ahead], rtol=0.01)
    turned = np.angle(np.exp(1j * (found.phase[late] - whole.phase[ahead])))
    assert np.abs(turned).max() < 0.01
    np.testing.assert_allclose(found.frequency_Hz[late], truth[ahead], rtol=0.04)
    assert (found.status[late] == RidgeStatus.OK).all() and found.sentence[late[0]] == "ok"
    moved = make().process(rows + [5.0, -90.0])
    np.testing.assert_array_equal(moved.frequency_Hz[late], found.frequency_Hz[late])
    np.testing.assert_allclose(moved.magnitude[late], found.magnitude[late], rtol=1e-6)
    window = whole.window(300 - 19, 300)
    assert found.mean_Hz[300 + lag] == pytest.approx(window.mean_Hz)
    assert found.sd_Hz[300 + lag] == pytest.approx(window.sd_Hz)


def test_answers_are_held_for_a_three_hundredth_of_a_second():
    rows = np.repeat(touch(count=400)[0], 4, axis=0)
    found = make(sample_rate_Hz=1200.0).process(rows)
    changes = np.flatnonzero(np.diff(found.magnitude[400:]) != 0)
    assert changes.size > 200 and (np.diff(changes) % 4 == 0).all()


def test_single_samples_are_the_block_over_many_windows():
    """The window of 20 Hz is 91 samples; the first instant is answered with the last of them."""
    rows, _ = touch(count=700)
    rows[200:203, 1], rows[420:424, 0] = np.nan, np.inf
    whole, estimator = make().process(rows), make()
    single = np.array([estimator.update(row) for row in rows.tolist()]).T
    for number, (column, of_block) in enumerate(zip(single, whole, strict=True)):
        np.testing.assert_array_equal(column, of_block, err_msg=f"column {number}")
    full = 2 * round(estimator.lag_s * RATE) + 1
    assert (whole.status[: full - 1] == RidgeStatus.WARMING_UP).all() and whole.status[full - 1] == RidgeStatus.OK


def test_noise_is_seldom_a_ridge():
    """Noise with a memory: one in twenty instants at most twice over; nor is what both channels have at once."""
    white = np.random.default_rng(3).normal(size=(6000, 2))
    status = make().process(lfilter([1.0], [1.0, -0.9], white, axis=0)).status[500:]
    assert 0.005 < (status != RidgeStatus.NOT_SIGNIFICANT).mean() < 0.1 and (status == RidgeStatus.OK).mean() < 0.01
    hum = 3 * np.sin(2 * np.pi * 50 * np.arange(2000) / RATE)
    status = make().process(np.outer(hum, [1.0, -1.4]) + white[:2000]).status[300:]
    assert (status == RidgeStatus.OK).mean() < 0.12 and (status == RidgeStatus.COMMON).mean() > 0.85
    # The same in both to the last bit: nothing at all is apart.
    assert (make().process(np.outer(hum, [1.0, 1.0])).status[300:] == RidgeStatus.COMMON).all()


def test_faults_are_statuses():
    rows, _ = touch()
    clean, (few, many, still) = make().process(rows), (rows.copy() for _ in range(3))
    few[400:403, 0], many[400:440, 1], still[:, 1] = np.nan, np.inf, 3.1
    answer = make().process(few)
    assert (answer.status == clean.status).all()
    np.testing.assert_allclose(answer.mean_Hz[600:], clean.mean_Hz[600:])
    answer = make().process(many)
    assert (answer.status[440:480] == RidgeStatus.GAP).all() and np.isnan(answer.frequency_Hz[440:480]).all()
    assert (answer.status[700:] == RidgeStatus.OK).all(), "forgotten once it is out of reach"
    assert (make().process(still).status[200:] == RidgeStatus.SILENT).all()
    assert make().update(rows[0]).sentence == "the wavelets extend beyond the first sample"


@pytest.mark.parametrize(
    "refused, message",
    [
        (lambda: CrossRidge(sample_rate_Hz=150.0), "high_Hz must be below half of sample_rate_Hz, got 100 at 150 Hz"),
        (lambda: make().process(np.zeros((3, 1))), "n x 2 .first, second., got 3 x 1"),
        (lambda: make().update((1.0, 2.0, 3.0)), "first, second, got 3 values"),
        (lambda: setattr(make(), "state", make(low_Hz=30.0).state), "the wavelets reach over"),
    ],
)
def test_unusable_values_are_refused(refused, message):
    with pytest.raises(InputError, match=message):
        refused()


@pytest.mark.parametrize("size, status", [(1e-200, RidgeStatus.SILENT), (1e-9, RidgeStatus.OK), (1e11, RidgeStatus.OK),
                                          (1e300, RidgeStatus.GAP)])  # fmt: skip
def test_readings_of_any_size_are_answered(size, status):
    found = make().process(touch(count=300)[0] * size)
    assert (found.status[-50:] == status).all()
