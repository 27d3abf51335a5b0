"""The bound of a frequency that glides: closed form against the numerical one, and a fit that reaches it."""

import math

import numpy as np
import pytest

from papilla.core.errors import InputError
from papilla.references.bounds import chirp_bound, frequency_bound

RATE, COUNT, NOISE = 1000.0, 200, 0.05
TIME = np.arange(COUNT) / RATE
FREQUENCY, SLOPE = 60.0, 150.0


def phase_of(frequency, slope, start=0.3):
    return start + 2 * math.pi * (frequency * TIME + 0.5 * slope * TIME**2)


def numerical(amplitudes, lag_s):
    phase, at = phase_of(FREQUENCY, SLOPE), float(TIME[-1]) - lag_s
    return frequency_bound(TIME, phase, FREQUENCY + SLOPE * at, amplitudes, NOISE, degree=1, at_s=at)


@pytest.mark.parametrize("lag_s", [0.0, 0.014, 0.1])
@pytest.mark.parametrize("amplitudes", [[1.0], [1.0, 0.4j, -0.3]])
def test_the_closed_form_is_what_many_periods_approach(amplitudes, lag_s):
    at = FREQUENCY + SLOPE * (TIME[-1] - lag_s)
    assert numerical(amplitudes, lag_s) == pytest.approx(
        chirp_bound(COUNT, RATE, at, amplitudes, NOISE, lag_s), rel=0.05
    )


def test_no_delay_costs_a_factor_of_four():
    end, middle = (chirp_bound(COUNT, RATE, 100.0, [1.0], NOISE, lag) for lag in (0.0, 0.1))
    assert end / middle == pytest.approx(4.0)


def test_a_maximum_likelihood_fit_reaches_it():
    """Least squares of phase, frequency, slope and amplitude over many noises: scatter of the last frequency."""
    rng = np.random.default_rng(4)
    clean = np.cos(phase_of(FREQUENCY, SLOPE))
    at_end = []
    for _ in range(400):
        reading = clean + NOISE * rng.standard_normal(COUNT)
        guess = np.array([0.3, FREQUENCY, SLOPE])
        for _ in range(5):
            phase = guess[0] + 2 * math.pi * (guess[1] * TIME + 0.5 * guess[2] * TIME**2)
            waves = np.column_stack([np.cos(phase), np.ones(COUNT)])
            amplitude, offset = np.linalg.lstsq(waves, reading, rcond=None)[0]
            turn = -amplitude * np.sin(phase)
            slopes = np.column_stack([turn, 2 * math.pi * TIME * turn, math.pi * TIME**2 * turn, waves])
            guess += np.linalg.lstsq(slopes, reading - waves @ [amplitude, offset], rcond=None)[0][:3]
        at_end.append(guess[1] + guess[2] * TIME[-1])
    truth = FREQUENCY + SLOPE * TIME[-1]
    assert np.std(at_end) / truth == pytest.approx(numerical([1.0], 0.0), rel=0.1)
    assert abs(np.mean(at_end) - truth) < 4 * np.std(at_end) / math.sqrt(len(at_end))


def test_a_window_that_cannot_tell_says_so():
    assert frequency_bound(TIME, 0 * TIME, 1.0, [1.0], NOISE, degree=1) == math.inf


def test_unusable_values():
    with pytest.raises(InputError, match="count must be at least 4"):
        chirp_bound(3, RATE, 100.0, [1.0], NOISE)
