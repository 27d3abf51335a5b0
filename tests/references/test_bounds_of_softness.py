"""The bound of a modulus: closed forms, a maximum-likelihood fit that reaches it, and what it refuses."""

import math

import numpy as np
import pytest

from papilla.core.errors import InputError
from papilla.references.bounds import modulus_bound


def test_one_reading_whose_force_is_noisy():
    """The force's noise adds to that of the reading: sigma^2 = noise^2 + (slope force_sigma)^2."""
    assert modulus_bound([[3.0]], [[50.0]], 4.0, 0.06) == pytest.approx(math.hypot(4, 3) / 3)


def test_without_a_force_sensor_one_reading_tells_nothing_and_two_do():
    assert modulus_bound([[3.0]], [[50.0]], 4.0, math.inf) == math.inf
    assert modulus_bound([[3.0, 0.0]], [[0.0, 50.0]], 4.0, math.inf) == pytest.approx(4 / 3)
    assert modulus_bound([[3.0, 6.0]], [[50.0, 100.0]], 4.0, math.inf) == math.inf


def test_a_maximum_likelihood_fit_reaches_it():
    rng = np.random.default_rng(0)
    a, b = rng.normal(size=(2, 30, 5)) * [[[20.0]], [[9e3]]]
    noise, force_sigma, truth, found = 50.0, 0.004, 0.1, []
    for _ in range(4000):
        force_error = force_sigma * rng.normal(size=30)
        readings = a * truth - b * force_error[:, None] + noise * rng.normal(size=a.shape)
        # Whitening: every sample's covariance is noise^2 + force_sigma^2 b b'.
        left = np.linalg.cholesky(noise**2 * np.eye(5) + force_sigma**2 * b[:, :, None] * b[:, None, :])
        design, data = (np.linalg.solve(left, part[..., None])[..., 0].ravel() for part in (a, readings))
        found.append(design @ data / (design @ design))
    assert np.std(found) == pytest.approx(modulus_bound(a, b, noise, force_sigma), rel=0.04)


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
    covariance = (
        50.0**2 * np.eye(5) + 0.004**2 * b[:, :, None] * b[:, None, :] + 0.02**2 * c[:, :, None] * c[:, None, :]
    )
    information = np.einsum("ni,nij,nj->", a, np.linalg.inv(covariance), a)
    assert one == pytest.approx(information**-0.5)


@pytest.mark.parametrize(
    "arguments, message",
    [
        (([[1.0]], [[1.0]], 0, 1), "reading_sigma must be greater than 0"),
        (([[1.0]], [[1.0]], 1, 0), "force_sigma must be greater than 0, got 0"),
        (([1.0], [1.0], 1, 1), r"slopes must be two arrays \(n, g\), got \(1,\) and \(1,\)"),
        (
            ([[1.0]], [[1.0]], 1, 1, None, [([[1.0, 2.0]], 1)]),
            r"a nuisance must be slopes \(1, 1\) and a sigma above 0",
        ),
        (([[1.0]], [[1.0]], 1, 1, None, [([[1.0]], 0)]), r"a sigma above 0, got \(1, 1\), 0"),
        (([[1.0]], [[1.0]], 1, 1, [[1.0]]), r"errors must be \(n, g, k\) with n x g = \(1, 1\), got \(1, 1\)"),
    ],
)
def test_what_it_refuses(arguments, message):
    with pytest.raises(InputError, match=message):
        modulus_bound(*arguments)
