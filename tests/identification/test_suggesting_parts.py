"""The choice of presses from information alone: scores, greedy choice and exchange, against all choices."""

from itertools import combinations_with_replacement

import numpy as np
import pytest

from papilla.identification import suggest
from papilla.identification.suggest import _exchanged, _Finger, _greedy, _score


@pytest.fixture(scope="module")
def fingers():
    """Two fingers of three parameters, six candidates of two channels, and four points of the domain."""
    rng, found = np.random.default_rng(1), []
    for _ in range(2):
        jacobian = rng.normal(size=(6, 2, 3))
        found.append(_Finger(0.1 * np.eye(3), np.einsum("ncf,nch->nfh", jacobian, jacobian), rng.normal(size=(4, 3))))
    return found


def test_the_criterion_is_the_mean_variance_of_ln_e_or_the_determinant(fingers):
    one = fingers[0]
    information = one.known + one.each[2]
    variances = [row @ np.linalg.solve(information, row) for row in one.slope]
    assert one.log_variance(information) == pytest.approx(np.log(np.mean(variances)))
    both = _score(fingers, [1, 4], "I")
    expected = [sum(f.log_variance(f.known + f.each[1] + f.each[4] + f.each[k]) for f in fingers) for k in range(6)]
    assert both == pytest.approx(expected)
    dets = [-sum(np.log(np.linalg.det(f.known + f.each[1] + f.each[4] + f.each[k])) for f in fingers) for k in range(6)]
    assert _score(fingers, [1, 4], "D") == pytest.approx(dets)


@pytest.mark.parametrize("criterion", ["I", "D"])
def test_exchange_finds_the_best_of_all_choices(fingers, criterion):
    def score(rows):
        return _score(fingers, list(rows[1:]), criterion)[rows[0]]

    first = _greedy(fingers, 3, criterion)
    assert len(first) == 3 and first[0] == int(np.argmin(_score(fingers, [], criterion)))
    best = min(combinations_with_replacement(range(6), 3), key=score)
    for begin in (first, [0, 0, 0], [5, 3, 5]):
        found = _exchanged(fingers, begin, criterion)
        assert score(found) == pytest.approx(score(best)) and score(found) <= score(begin) + 1e-12


def test_presses_are_suggested_between_5_and_100_gf_for_the_published_domain():
    assert (suggest.FORCES_N[0], suggest.FORCES_N[-1]) == pytest.approx((0.04903325, 0.980665))
    assert pytest.approx((0.196133, 0.980665)) == suggest.CHECKED_FORCE_N
    assert suggest.CHECKED_MODULUS_MPA == (0.05, 0.72)
