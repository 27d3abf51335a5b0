"""The least-squares solver: against closed forms, and what it confesses."""

import numpy as np
import pytest

from papilla.core.least_squares import LeastSquares, least_squares

X = np.linspace(0.0, 2.0, 60)


def test_a_straight_line_has_its_closed_form():
    """Unknowns of sizes 1e-3 and 1e3: solution, covariance and condition by the normal equations."""
    columns = np.column_stack([1e3 * np.ones(60), 1e-3 * X])
    measured = columns @ [2.0, -5.0] + 1e-4 * np.random.default_rng(1).normal(size=60)
    fit = least_squares(lambda vector: (columns @ vector - measured, columns), [0.0, 0.0], both=True, x_scale="jac")
    best = np.linalg.lstsq(columns, measured, rcond=None)[0]
    assert fit.vector == pytest.approx(best, rel=1e-6) and fit.converged and fit.determined.all()
    left = measured - columns @ best
    expected = np.linalg.inv(columns.T @ columns) * (left @ left) / 58
    assert fit.covariance == pytest.approx(expected, rel=1e-5) and fit.cost == pytest.approx(left @ left)
    assert fit.condition == pytest.approx(np.linalg.cond(columns / np.linalg.norm(columns, axis=0)))


def test_what_cannot_be_trusted_is_confessed():
    fit = least_squares(lambda v: v[0] - X + 0 * v[1], [0.5, 0.3], bounds=([-1.0, 0.0], [0.8, 1.0]))
    assert fit.determined.tolist() == [True, False] and np.isnan(fit.covariance[1]).all()
    assert np.isfinite(fit.covariance[0, 0]) and fit.at_bound.tolist() == [True, False]
    twins = least_squares(lambda v: (v.sum() - X, np.ones((60, 2))), [0.0, 0.0], both=True)
    assert twins.determined.all() and twins.condition > 1e12
    assert not least_squares(lambda v: np.exp(v) - 5.0 * X, [9.0], max_nfev=2).converged


def test_the_best_of_all_starts_is_the_answer_and_both_needs_one_evaluation():
    calls = []

    def wave(v):
        calls.append(v.copy())
        return np.sin(v[0] * X) - np.sin(3 * X), (X * np.cos(v[0] * X))[:, None]

    far = least_squares(wave, [9.0], both=True)
    assert far.cost > 1 and len(calls) == len({vector.tobytes() for vector in calls})
    near = least_squares(wave, [9.0], [2.8], both=True)
    assert near.cost < 1e-12 and near.vector == pytest.approx([3.0])


@pytest.mark.parametrize("size, determined", [(1.05e-10, True), (0.95e-10, False)])
def test_a_column_of_next_to_nothing_determines_nothing(size, determined):
    jacobian = np.column_stack([np.ones(4), size * np.array([1.0, -1.0, 1.0, -1.0])])
    fit = LeastSquares(np.zeros(2), np.ones(4), jacobian, np.zeros(2, bool), True, "")
    assert fit.determined.tolist() == [True, determined] and np.isfinite(fit.covariance[1, 1]) == determined
    assert fit.condition == pytest.approx(1.0) and fit.covariance[0, 0] == pytest.approx(4 / 2 / 4)
