"""Scores of a panel: Grubbs' outliers, and the removal of each assessor's own scale."""

import numpy as np

from papilla import checks
from papilla.errors import InputError


def grubbs_critical(count: int, level: float = 0.05) -> float:
    """Largest deviation over standard deviation (ddof 1) of `count` normal values, exceeded with this chance.

    Two-sided: (n - 1) / sqrt(n) sqrt(t^2 / (n - 2 + t^2)), t the quantile of Student's t with n - 2 degrees of freedom
    exceeded with level / (2 n) (Grubbs 1969, Technometrics 11:1, doi 10.1080/00401706.1969.10490657).
    Raises `InputError` for fewer than three values.
    """
    from scipy.stats import t as student

    if count < 3:
        raise InputError(f"Grubbs' test needs three values or more, got {count}")
    t2 = float(student.isf(checks.within("level", level, 1e-9, 0.5) / (2 * count), count - 2)) ** 2
    return (count - 1) / np.sqrt(count) * np.sqrt(t2 / (count - 2 + t2))


def grubbs_outliers(values, level: float = 0.05) -> np.ndarray:
    """(n,) bool: values that Grubbs' test rejects, one at a time, the largest deviation first.

    Testing stops at the first value that stays, and with three values left. Raises `InputError` for fewer than three
    values or values that are not finite.
    """
    samples = np.asarray(values, float)
    if samples.ndim != 1 or samples.size < 3 or not np.isfinite(samples).all():
        raise InputError(f"Grubbs' test needs one column of three or more finite values, got {samples.shape}")
    outlier = np.zeros(samples.size, bool)
    while (~outlier).sum() > 3 or not outlier.any():
        kept = samples[~outlier]
        deviation = np.where(outlier, 0.0, np.abs(samples - kept.mean()))
        if not deviation.max() > grubbs_critical(kept.size, level) * kept.std(ddof=1):
            break
        outlier[int(deviation.argmax())] = True
    return outlier


def normalised_scores(scores) -> np.ndarray:
    """Magnitude estimates (assessors, items) > 0 without each assessor's own scale.

    Each row is divided by its geometric mean and multiplied by that of all, as usual for magnitude estimates; the
    textile paper normalises, but does not say how. Raises `InputError` for what is not a table of positive numbers.
    """
    table = np.asarray(scores, float)
    if table.ndim != 2 or table.size == 0 or not (np.isfinite(table).all() and (table > 0).all()):
        raise InputError("scores must be a table (assessors, items) of positive finite numbers")
    logs = np.log(table)
    return np.exp(logs - logs.mean(axis=1, keepdims=True) + logs.mean())
