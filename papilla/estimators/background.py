"""The smooth background of a spectrum: red noise or drift over a white floor, fitted past the lines on it."""

from dataclasses import dataclass

import numpy as np

from papilla.errors import InputError

ROUNDS, TRIM = 8, 2.5
"""Most rounds of refitting without the lines, and from how many spreads above the background a point is a line."""
LEAST_POINTS = 8
STEEPEST, MOST_STEPS = 8.0, 200
"""Greatest slope of the background, and most steps of one of its fits."""


@dataclass(frozen=True)
class Background:
    """power(k) = (red (reference / k)^slope + floor) of wavenumber or frequency k.

    freedom : degrees of freedom of the chi-square that the power follows around it: 2 for one spectrum, more for the
    mean of several independent ones; measured from the scatter below the background, which lines cannot reach.
    """

    reference: float
    red: float
    slope: float
    floor: float
    freedom: float

    def power(self, k) -> np.ndarray:
        """Expected power at k (scalar or (n,)), > 0."""
        return self.red * (self.reference / np.asarray(k, float)) ** self.slope + self.floor

    def chance(self, ratio) -> np.ndarray:
        """Probability that the background alone reaches `ratio` times its expected power at one k."""
        from scipy.stats import chi2

        return chi2.sf(self.freedom * np.asarray(ratio, float), self.freedom)

    def threshold(self, chance: float) -> float:
        """Ratio to the expected power that the background alone exceeds with this probability at one k."""
        from scipy.stats import chi2

        return float(chi2.isf(chance, self.freedom) / self.freedom)


def fit_background(k, power) -> Background:
    """Fit a background to the power (n,) of independent lines at rising k (n,) > 0.

    Least squares on the logarithm, repeated without what stands out above (8 points or more must remain).
    Raises `InputError` for fewer than 8 points or power that is not positive.
    """
    from scipy.special import digamma

    k, power = np.asarray(k, float), np.asarray(power, float)
    if k.size < LEAST_POINTS:
        raise InputError(f"a background needs {LEAST_POINTS} lines of the spectrum, got {k.size}")
    if not (np.isfinite(power).all() and (power > 0).all()):
        raise InputError("the power of a spectrum must be positive and finite for a background to be fitted")
    reference = float(np.exp(np.log(k).mean()))
    seen = np.log(power)
    steps = np.log(reference / k)
    level = float(np.median(seen))
    used = np.ones(k.size, bool)
    values = np.array([level - 1.0, 1.0, level - 1.0])
    for _ in range(ROUNDS):
        values = _fitted(steps[used], seen[used], values)
        above = seen - np.logaddexp(values[0] + values[1] * steps, values[2])
        spread = _spread_below(above[used])
        kept = above <= np.median(above[used]) + TRIM * spread
        if kept.sum() < LEAST_POINTS or (kept == used).all():
            break
        used = kept
    freedom = _freedom(_spread_below(above[used]))
    # The mean of the logarithm of a chi-square lies below the logarithm of its mean.
    lift = np.log(freedom / 2) - digamma(freedom / 2)
    return Background(
        reference, float(np.exp(values[0] + lift)), float(values[1]), float(np.exp(values[2] + lift)), freedom
    )


def _fitted(steps: np.ndarray, seen: np.ndarray, start: np.ndarray) -> np.ndarray:
    """The three values of ln(exp(v0 + v1 steps) + exp(v2)), 0 <= v1 <= `STEEPEST`, nearest to `seen`.

    Levenberg and Marquardt's steps on the loss 2 sqrt(1 + residual^2) - 2, which lets single points go.
    """
    values, damping = start, 1.0
    cost, step, normal = _misfit(steps, seen, values)
    for _ in range(MOST_STEPS):
        scaled = normal + damping * np.diag(np.diag(normal) + 1e-12 * np.trace(normal))
        tried = values + np.linalg.solve(scaled, step)
        tried[1] = min(max(tried[1], 0.0), STEEPEST)
        after = _misfit(steps, seen, tried)
        if not after[0] < cost:
            damping *= 8
            if damping > 1e9:
                break
            continue
        gained = cost - after[0]
        values, damping = tried, damping / 8
        cost, step, normal = after
        if gained < 1e-9 * cost:
            break
    return values


def _misfit(steps: np.ndarray, seen: np.ndarray, values: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    """The loss, its steepest descent and the normal matrix of its weighted squares."""
    red = values[0] + values[1] * steps
    expected = np.logaddexp(red, values[2])
    rest = seen - expected
    root = np.sqrt(1 + rest * rest)
    share = np.exp(red - expected)
    slopes = np.stack([share, share * steps, 1 - share])
    weighted = slopes / root
    return float(np.sum(root - 1)), weighted @ rest, weighted @ slopes.T


def _spread_below(residuals: np.ndarray) -> float:
    """Standard deviation of the logarithm, from the half of it that lines cannot reach."""
    middle = np.median(residuals)
    return float(max(np.sqrt(np.mean((residuals[residuals <= middle] - middle) ** 2)), 1e-3))


def _freedom(spread: float) -> float:
    """Degrees of freedom of the chi-square whose logarithm scatters so much below its median."""
    from scipy.optimize import brentq
    from scipy.stats import chi2

    shares = (np.arange(200) + 0.5) / 400

    def difference(ln_freedom):
        freedom = np.exp(ln_freedom)
        logs = np.log(chi2.ppf(shares, freedom) / chi2.ppf(0.5, freedom))
        return np.sqrt(np.mean(logs**2)) - spread

    # Never fewer than the two of a single spectrum: a few points may scatter more by chance.
    if difference(np.log(2.0)) <= 0:
        return 2.0
    return float(np.exp(brentq(difference, np.log(2.0), np.log(1e4)))) if difference(np.log(1e4)) < 0 else 1e4
