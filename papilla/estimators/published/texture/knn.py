"""Nearest-neighbour discrimination: leave-M-out over random splits (2011 Oddo), and splits by repetition."""

from dataclasses import dataclass

import numpy as np

from papilla.errors import InputError, MissingExtraError


@dataclass(frozen=True, eq=False)
class Accuracy:
    """accuracy : fraction of the tests that were right; low, high : the worst and the best split.

    confusion (labels, labels) : tests of each true label (row) that got each label (column); labels : their names;
    tests : how many.
    """

    accuracy: float
    low: float
    high: float
    confusion: np.ndarray
    labels: tuple
    tests: int


def leave_m_out(
    features, labels, left_out: int, *, seed: int, splits: int = 1000, neighbours: int = 1, scale: bool = False
) -> Accuracy:
    """Accuracy over random splits with `left_out` of the runs as test and the same number of each label in training.

    features (n, d), labels (n,). As printed (2011 Oddo): 24 runs of three gratings, M = 3, 6, ... 21, 10,000 splits,
    features f_MP of two channel pairs, not scaled. The number of neighbours is not stated; more than one leaves
    nothing to vote about in the worst case of one training run a label.

    What it measures is how well runs repeat, the speed included: f_MP = v / period, so a spread of 1, 2, 3, 5 % of the
    speed between runs caps three gratings 10 % apart, one training run each, at about 100, 94, 82, 66 %.
    Raises `InputError` for shapes that do not fit or splits that cannot be even, `MissingExtraError` without
    scikit-learn.
    """
    table, names, codes = _checked(features, labels)
    counts = np.bincount(codes)
    training = len(codes) - left_out
    each, rest = divmod(training, len(names))
    if rest or each < 1 or each >= counts.min():
        raise InputError(
            f"left_out = {left_out} of {len(codes)} runs does not leave an equal training set of each of "
            f"{len(names)} labels and something to test"
        )
    if each < neighbours:
        raise InputError(f"{neighbours} neighbours need as many training runs of each label, got {each}")
    generator = np.random.default_rng(seed)
    places = [np.flatnonzero(codes == code) for code in range(len(names))]
    chosen = (np.concatenate([generator.choice(own, each, replace=False) for own in places]) for _ in range(splits))
    return _tested(table, codes, names, (np.isin(np.arange(len(codes)), some) for some in chosen), neighbours, scale)


def split_by_repetition(features, labels, repetitions, *, neighbours: int = 1, scale: bool = True) -> Accuracy:
    """Accuracy with every repetition in turn as the test and all others as training.

    Windows of one run are alike for reasons other than the texture (drift, temperature, how it was mounted); folds that
    mix them flatter. features (n, d), labels (n,), repetitions (n,), at least two different; features are scaled by the
    training set's mean and deviation. Raises as `leave_m_out`.
    """
    table, names, codes = _checked(features, labels)
    runs = np.asarray(repetitions)
    if runs.shape != codes.shape or np.unique(runs).size < 2:
        raise InputError(f"repetitions must be a column of {len(codes)} with two different values at least")
    masks = [runs != run for run in np.unique(runs)]
    for mask in masks:
        if np.unique(codes[mask]).size < len(names):
            raise InputError("every label must occur in two repetitions at least")
    return _tested(table, codes, names, masks, neighbours, scale)


def _checked(features, labels) -> tuple[np.ndarray, tuple, np.ndarray]:
    table = np.asarray(features, float)
    names, codes = np.unique(np.asarray(labels), return_inverse=True)
    if table.ndim != 2 or len(table) != len(codes) or not np.isfinite(table).all():
        raise InputError(f"features (n, d) must be finite and fit {len(codes)} labels, got {table.shape}")
    if len(names) < 2:
        raise InputError("there must be two different labels at least to be told apart")
    return table, tuple(names.tolist()), codes


def _tested(table, codes, names, masks, neighbours: int, scale: bool) -> Accuracy:
    """Train on each mask, test on the rest."""
    classifier = _classifier(neighbours, scale)
    confusion = np.zeros((len(names), len(names)), int)
    right = []
    for training in masks:
        found = classifier.fit(table[training], codes[training]).predict(table[~training])
        np.add.at(confusion, (codes[~training], found), 1)
        right.append(float(np.mean(found == codes[~training])))
    tests = int(confusion.sum())
    return Accuracy(float(np.trace(confusion)) / tests, min(right), max(right), confusion, names, tests)


def _classifier(neighbours: int, scale: bool):
    try:
        from sklearn.neighbors import KNeighborsClassifier
        from sklearn.pipeline import make_pipeline
        from sklearn.preprocessing import StandardScaler
    except ImportError as error:
        raise MissingExtraError(
            "nearest neighbours need scikit-learn; install it with: pip install 'papilla[texture]'"
        ) from error
    # Exact as the default, which sets up threads anew for each of thousands of small splits and takes 3-5 x longer.
    nearest = KNeighborsClassifier(n_neighbors=neighbours, algorithm="kd_tree")
    return make_pipeline(StandardScaler(), nearest) if scale else nearest
