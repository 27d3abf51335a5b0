"""Bounds of a modulus and of a frequency that glides: closed forms, and a fit that reaches them."""

import math

import numpy as np
import pytest

from papilla.core.errors import InputError
from papilla.references.bounds import chirp_bound, frequency_bound, modulus_bound, wavelength_bound

RATE, COUNT, NOISE = 1000.0, 200, 0.05
TIME = np.arange(COUNT) / RATE
FREQUENCY, SLOPE = 60.0, 150.0


def test_a_noisy_force_and_none():
    """The force's noise adds to that of the reading: sigma^2 = noise^2 + (slope force_sigma)^2; of two readings without
    a force sensor one gives the force."""
    assert modulus_bound([[3.0]], [[50.0]], 4.0, 0.06) == pytest.approx(math.hypot(4, 3) / 3)
    assert modulus_bound([[3.0]], [[50.0]], 4.0, math.inf) == math.inf
    assert modulus_bound([[3.0, 0.0]], [[0.0, 50.0]], 4.0, math.inf) == pytest.approx(4 / 3)
    assert modulus_bound([[3.0, 6.0]], [[50.0, 100.0]], 4.0, math.inf) == math.inf


def test_a_nuisance_takes_away_what_looks_like_it():
    """Orthogonal slopes cost nothing; parallel ones leave the prior's share; a prior of zero width is knowledge."""
    a, b = np.array([[3.0, 4.0]]), np.zeros((1, 2))
    free = modulus_bound(a, b, 10.0, 1.0)
    assert modulus_bound(a, b, 10.0, 1.0, nuisances=[([[4.0, -3.0]], math.inf)]) == pytest.approx(free)
    assert modulus_bound(a, b, 10.0, 1.0, nuisances=[(a, math.inf)]) == math.inf
    assert modulus_bound(a, b, 10.0, 1.0, nuisances=[(2 * a, 0.5)]) == pytest.approx(math.hypot(free, 2 * 0.5))
    assert modulus_bound(a, b, 10.0, 1.0, nuisances=[(a, 1e-9)]) == pytest.approx(free)


def test_a_second_force_is_a_nuisance_as_the_first():
    rng = np.random.default_rng(4)
    a, b, c = rng.normal(size=(3, 20, 5)) * [[[20.0]], [[9e3]], [[3e3]]]
    one = modulus_bound(a, b, 50.0, 0.004, nuisances=[(c, 0.02)])
    assert one == pytest.approx(modulus_bound(a, c, 50.0, 0.02, nuisances=[(b, 0.004)]))
    assert one > modulus_bound(a, b, 50.0, 0.004)
    # By hand: each sample's covariance, inverted.
    of_forces = (sigma**2 * part[:, :, None] * part[:, None, :] for sigma, part in ((0.004, b), (0.02, c)))
    covariance = 50.0**2 * np.eye(5) + sum(of_forces)
    information = np.einsum("ni,nij,nj->", a, np.linalg.inv(covariance), a)
    assert one == pytest.approx(information**-0.5)


@pytest.mark.parametrize(
    "arguments, message",
    [
        (([[1.0]], [[1.0]], 1, 0), "force_sigma must be greater than 0, got 0"),
        (([1.0], [1.0], 1, 1), r"slopes must be two arrays \(n, g\), got \(1,\) and \(1,\)"),
        (([[1.0]], [[1.0]], 1, 1, None, [([[1.0, 2.0]], 1)]), r"nuisance must be slopes \(1, 1\) and a sigma"),
        (([[1.0]], [[1.0]], 1, 1, None, [([[1.0]], 0)]), r"a sigma above 0, got \(1, 1\), 0"),
        (([[1.0]], [[1.0]], 1, 1, [[1.0]]), r"errors must be \(n, g, k\) with n x g = \(1, 1\), got \(1, 1\)"),
    ],
)
def test_what_it_refuses(arguments, message):
    with pytest.raises(InputError, match=message):
        modulus_bound(*arguments)


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


def by_differences(reading, count, noise):
    """Standard deviation bound of the first unknown: the Fisher information of `reading(unknowns)` by differences."""
    slopes = np.column_stack([(reading(step) - reading(-step)) / 2e-6 for step in 1e-6 * np.eye(count)])
    return noise * math.sqrt(np.linalg.inv(slopes.T @ slopes)[0, 0])


@pytest.mark.parametrize("seed", [1, 2])
def test_bounds_are_those_of_the_readings_by_differences(seed):
    """Drawn places, amplitudes and filters; the unknowns are the wanted one, offset, complex amplitudes, and a phase's
    polynomial."""
    rng = np.random.default_rng(seed)
    place, amplitudes = rng.uniform(3, 9, 80), rng.normal(size=3) + 1j * rng.normal(size=3)
    place, present = place - place.mean(), rng.random((80, 3)) < 0.7  # the amplitudes are those in the middle

    def reading(phase, change, mask):
        c = amplitudes + change[1:4] + 1j * change[4:]
        return change[0] + (mask * (c * np.exp(-1j * phase[:, None] * [1, 2, 3])).real).sum(axis=1)

    for mask, present_harmonics in ((1, None), (present, present)):
        smallest = by_differences(
            lambda u, mask=mask: reading(2 * math.pi / 1.9 * place * (1 + u[0]), u[1:], mask), 8, 0.1
        )
        assert wavelength_bound(place, 1.9, amplitudes, 0.1, present_harmonics) == pytest.approx(smallest, rel=1e-6)
    time = np.sort(rng.uniform(2, 3, 80))
    phase = 2 * math.pi * (9 * time + 3 * time**2)
    for degree, at in ((0, None), (1, None), (2, 2.6)):
        end = time[-1] if at is None else at
        after = (time - end)[:, None] ** np.arange(1, degree + 2) / np.arange(1, degree + 2)
        rate = 9 + 6 * end

        def of_time(u, after=after, rate=rate, degree=degree):
            return reading(phase + 2 * math.pi * rate * after @ u[: degree + 1], u[degree + 1 :], 1)

        expected = by_differences(of_time, degree + 8, 0.1)
        bound = frequency_bound(time, phase, rate, amplitudes, 0.1, degree=degree, at_s=at)
        assert bound == pytest.approx(expected, rel=1e-5)


def test_readings_that_tell_nothing_have_no_bound_and_wrong_shapes_are_refused():
    assert wavelength_bound([], 2.0, [1.0], 0.1) == wavelength_bound(TIME, 2.0, [0.0], 0.1) == math.inf
    assert wavelength_bound(TIME, 2.0, [1.0], 0.1, np.zeros((COUNT, 1))) == math.inf
    for present in (np.ones((COUNT, 2)), np.ones((3, 1))):
        with pytest.raises(InputError, match="shapes do not fit: 200 samples, 1 harmonics"):
            wavelength_bound(TIME, 2.0, [1.0], 0.1, present)
    with pytest.raises(InputError, match="degree of the frequency must be at least 0, got -1"):
        frequency_bound(TIME, TIME, 1.0, [1.0], NOISE, degree=-1)


def test_edges_of_a_gliding_frequency():
    end, middle = (chirp_bound(COUNT, RATE, 100.0, [1.0], NOISE, lag) for lag in (0.0, 0.1))
    assert end / middle == pytest.approx(4.0), "no delay costs a factor of four"
    assert frequency_bound(TIME, 0 * TIME, 1.0, [1.0], NOISE, degree=1) == math.inf
    with pytest.raises(InputError, match="count must be at least 4"):
        chirp_bound(3, RATE, 100.0, [1.0], NOISE)
