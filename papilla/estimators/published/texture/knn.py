"""Nearest-neighbour discrimination, leave-M-out over random splits (2011 Oddo)."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.distance import cdist

from papilla.errors import InputError


@dataclass(frozen=True)
class Accuracy:
    """accuracy : fraction of the tests that were right; low, high : the worst and the best split."""

    accuracy: float
    low: float
    high: float


def leave_m_out(features, labels, left_out: int, *, seed: int, splits: int = 1000, neighbours: int = 1) -> Accuracy:
    """Accuracy over random splits with `left_out` of the runs as test and the same number of each label in training.

    features (n, d), labels (n,). As printed (2011 Oddo): 24 runs of three gratings, M = 3, 6, ... 21, 10,000 splits,
    features f_MP of two channel pairs, not scaled. The number of neighbours is not stated; more than one is not
    possible in the worst case of one training run per label.

    It measures how well runs repeat, including their speed: f_MP = v / period, so a spread of 1, 2, 3, 5 % of the speed
    between runs caps three gratings 10 % apart, one training run each, at about 100, 94, 82, 66 %. Raises `InputError`
    for shapes that do not fit or splits that cannot be even.
    """
    table = np.asarray(features, float)
    names, codes = np.unique(np.asarray(labels), return_inverse=True)
    if table.ndim != 2 or len(table) != len(codes) or not np.isfinite(table).all():
        raise InputError(f"features (n, d) must be finite and fit {len(codes)} labels, got {table.shape}")
    if len(names) < 2:
        raise InputError("there must be at least two different labels")
    counts = np.bincount(codes)
    each, rest = divmod(len(codes) - left_out, len(names))
    if rest or each < 1 or each >= counts.min():
        raise InputError(
            f"left_out = {left_out} of {len(codes)} runs does not leave an equal training set of each of "
            f"{len(names)} labels and something to test"
        )
    if each < neighbours:
        raise InputError(f"{neighbours} neighbours need as many training runs of each label, got {each}")
    generator = np.random.default_rng(seed)
    places = [np.flatnonzero(codes == code) for code in range(len(names))]
    distance, votes, right = cdist(table, table), np.eye(len(names))[codes], []
    for _ in range(splits):
        training = np.concatenate([generator.choice(own, each, replace=False) for own in places])
        test = np.setdiff1d(np.arange(len(codes)), training)
        order = distance[np.ix_(test, training)].argsort(axis=1, kind="stable")[:, :neighbours]
        found = votes[training[order]].sum(axis=1).argmax(axis=1)
        right.append(float(np.mean(found == codes[test])))
    return Accuracy(float(np.mean(right)), min(right), max(right))
